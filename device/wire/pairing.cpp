#include "device/wire/pairing.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <iterator>
#include <list>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "device/wire/tcp_link.hpp"
#include "drivers/identity/known_keys.hpp"
#include "drivers/system/part_file.hpp"
#include "drivers/system/yes_or_no.hpp"

namespace birdseye::wire {

namespace {

constexpr std::size_t kNameBytes = 64;
constexpr Duration kFirstMessage = Duration::from_ms(1000);  // a client sends it as soon as it is connected
constexpr std::size_t kMostNewcomers = 16, kMostNamed = 5;
constexpr Duration kExchange = Duration::from_ms(10'000);  // which no person takes part in
constexpr std::uint8_t kYes = 'y', kNo = 'n';
constexpr const char* kOwn = "own";  // by which this machine's certificate is kept beside the others'

using Sha256 = std::array<std::uint8_t, 32>;
/// A number that nobody can guess, and what its machine calls itself, zeros behind it.
using Card = std::array<std::uint8_t, 32 + kNameBytes>;

Sha256 sha256_of(std::initializer_list<std::span<const std::uint8_t>> parts) {
  Sha256 out{};
  const std::shared_ptr<EVP_MD_CTX> context(::EVP_MD_CTX_new(), ::EVP_MD_CTX_free);
  ::EVP_DigestInit_ex(context.get(), ::EVP_sha256(), nullptr);
  for (const auto& part : parts) ::EVP_DigestUpdate(context.get(), part.data(), part.size());
  ::EVP_DigestFinal_ex(context.get(), out.data(), nullptr);
  return out;
}

Result<Card> card_of(const std::string& name) {
  Card card{};
  if (::RAND_bytes(card.data(), 32) != 1) return Error{Errc::io, "this machine has no random numbers"};
  std::copy_n(name.begin(), std::min(name.size(), kNameBytes), card.begin() + 32);
  return card;
}

/// As it may be shown and kept: a name could hold what moves a terminal's cursor.
std::string name_of(const Card& card) {
  std::string name;
  for (std::size_t i = 32; i < card.size() && card[i] != 0; ++i) {
    const char c = static_cast<char>(card[i]);
    const bool usual = card[i] < 128 && (std::isalnum(card[i]) != 0 || c == '.' || c == '-' || c == '_');
    name += usual ? c : '?';
  }
  return name.empty() ? "unnamed" : name;
}

Error gone() {
  return {Errc::disconnected, "the other machine has gone before the two were paired"};
}
Error late() {
  return {Errc::timeout, "the other machine does not answer"};
}

Result<void> send(TlsLink& link, std::span<const std::uint8_t> bytes, Deadline deadline) {
  while (!bytes.empty()) {
    const auto put = link.write_some(std::span(&bytes, 1));
    if (!put) return gone();
    bytes = bytes.subspan(*put);
    if (*put == 0 && !link.wait_writable(deadline)) return late();
  }
  return {};
}

Result<void> receive(TlsLink& link, std::span<std::uint8_t> bytes, Deadline deadline) {
  while (!bytes.empty()) {
    const auto got = link.read_some(bytes);
    if (!got) return gone();
    bytes = bytes.subspan(*got);
    if (!bytes.empty() && !link.wait_readable(deadline)) return late();
    if (deadline.passed() && *got == 0) return late();
  }
  return {};
}

std::string code_of(const Sha256& hash) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < 8; ++i) number = number << 8U | hash[i];
  number %= 1'000'000;
  return fmt::format("{:03} {:03}", number / 1000, number % 1000);
}

/// The client's part: commits itself to its card, and shows it once it has the server's.
Result<Card> exchange_as_client(TlsLink& link, const Card& own, Deadline deadline) {
  Card others{};
  if (auto sent = send(link, sha256_of({own}), deadline); !sent) return sent.error();
  if (auto got = receive(link, others, deadline); !got) return got.error();
  if (auto sent = send(link, own, deadline); !sent) return sent.error();
  return others;
}

/// promised: what the client has committed itself to.
Result<Card> exchange_as_server(TlsLink& link, const Sha256& promised, const Card& own, Deadline deadline) {
  Card others{};
  if (auto sent = send(link, own, deadline); !sent) return sent.error();
  if (auto got = receive(link, others, deadline); !got) return got.error();
  if (sha256_of({others}) == promised) return others;
  return Error{Errc::bad_value,
               "the other machine is not what it began as: do not pair it, and look who is on this network"};
}

/// promised: as a server, what the client has committed itself to; as a client nothing.
Result<Introduction> introduce_after(const std::optional<Sha256>& promised, TlsLink& link, const std::string& own_name,
                                     Deadline deadline) {
  const auto own = card_of(own_name);
  if (!own) return own.error();
  const bool client = !promised;
  const auto others =
      client ? exchange_as_client(link, *own, deadline) : exchange_as_server(link, *promised, *own, deadline);
  if (!others) return others.error();
  const Card& of_client = client ? *own : *others;
  const Card& of_server = client ? *others : *own;
  const PublicKey& client_key = client ? link.own_key() : link.peer_key();
  const PublicKey& server_key = client ? link.peer_key() : link.own_key();
  const Sha256 hash =
      sha256_of({link.secret("EXPORTER-birdseye-pairing"), of_client, of_server, client_key.bytes, server_key.bytes});
  return Introduction{code_of(hash), name_of(*others), link.peer_key()};
}

}  // namespace

Result<Introduction> introduce(TlsLink& link, TlsLink::Side side, const std::string& own_name, Deadline deadline,
                               bool* begun) {
  if (side == TlsLink::Side::client) return introduce_after(std::nullopt, link, own_name, deadline);
  Sha256 promised{};
  if (auto got = receive(link, promised, deadline); !got) return got.error();
  if (begun != nullptr) *begun = true;
  return introduce_after(promised, link, own_name, deadline);
}

Result<void> agree(TlsLink& link, bool yes, Deadline deadline) {
  const std::uint8_t said = yes ? kYes : kNo;
  if (auto sent = send(link, std::span(&said, 1), deadline); !sent) return sent;
  if (!yes) return Error{Errc::bad_value, "not paired: the codes are not alike, or nobody said that they are"};
  std::uint8_t heard = 0;
  if (auto got = receive(link, std::span(&heard, 1), deadline); !got) return got;
  if (heard == kYes) return {};
  return Error{Errc::bad_value, "not paired: at the other machine somebody said that the codes are not alike"};
}

bool ask_people(const Introduction& introduction, Deadline deadline) {
  fmt::print("{} (it calls itself so; its key: {})\ncode: {}\nDoes the other machine show the same code? [y/N] ",
             introduction.name, introduction.key.fingerprint(), introduction.code);
  std::fflush(stdout);
  return says_yes(deadline);
}

Result<std::shared_ptr<const Tls>> pairing_tls(const MachineKey& key) {
  return Tls::make(key, [](const PublicKey&) { return std::optional<std::string>(""); });
}

namespace {

/// By which the other machine is to be known here: the name that it has here already, the one that was asked for, or
/// what it calls itself, with a number behind it where another machine has that name.
Result<std::string> name_for(const Introduction& introduction, const PairingPlan& plan, const KnownKeys& known) {
  if (auto has = known.name_of(introduction.key)) return *std::move(has);
  if (plan.name.empty())
    return known.free_name(KnownKeys::is_name(introduction.name) ? introduction.name : "the-other");
  if (const std::string why = known.objection({plan.name, introduction.key}); !why.empty())
    return Error{Errc::bad_value, why};
  return plan.name;
}

/// From the codes to the known keys.
Result<Paired> settle(TlsLink& link, const Introduction& introduction, const PairingPlan& plan, const MachineKey& key,
                      Deadline deadline) {
  auto known = KnownKeys::read(plan.folder, KnownKeys::Machine{machine_name(), key.public_key()});
  const auto name = known ? name_for(introduction, plan, *known) : Result<std::string>(known.error());
  // Before anybody is asked: who has said yes is to be known by both machines.
  const bool yes = name && plan.ask(introduction, deadline);
  const auto agreed = agree(link, yes, deadline);
  if (!name) return name.error();
  if (!agreed) return agreed.error();
  // The certificates first: they let nobody in, and what is in the known keys is whole whenever a machine goes down.
  for (const auto& [file, text] :
       {std::pair(kOwn, link.own_certificate()), std::pair(name->c_str(), link.peer_certificate())}) {
    if (auto written = write_durably(plan.folder / (std::string(file) + ".crt"), text); !written)
      return written.error();
  }
  if (auto added = known->add(*name, introduction.key); !added) return added.error();
  return Paired{*name, introduction.key};
}

/// Those who have come and have not committed themselves yet. They are waited for all at once: who comes and says
/// nothing is in nobody's way.
class Newcomers {
 public:
  explicit Newcomers(Listener& listener) : listener_(listener) {}

  struct Committed {
    std::unique_ptr<Link> owner;
    TlsLink* link = nullptr;
    std::string address;
    Sha256 promised{};
  };
  /// The first who commits itself; empty: nobody by the deadline.
  std::optional<Committed> wait(Deadline deadline);
  /// The addresses of those who came and did not, in words; empty: there were none.
  [[nodiscard]] std::string silent_words() const;

 private:
  struct Newcomer {
    Committed entry;
    std::size_t have = 0;
    Deadline until;
  };

  void take(std::unique_ptr<Link> accepted);
  /// Whether all of its first message is there. An error: it has gone, or has been silent for too long.
  static Result<bool> read(Newcomer& newcomer, bool readable);
  void note_silent(const Newcomer& newcomer);

  Listener& listener_;
  std::list<Newcomer> waiting_;
  std::set<std::string> silent_;
};

void Newcomers::take(std::unique_ptr<Link> accepted) {
  auto* const link = dynamic_cast<TlsLink*>(accepted.get());
  if (link == nullptr) return;
  std::string address = peer_of(UniqueFd(::fcntl(link->fd(), F_DUPFD_CLOEXEC, 0)));
  waiting_.push_back({{std::move(accepted), link, std::move(address), {}}, 0, Deadline::after(kFirstMessage)});
}

Result<bool> Newcomers::read(Newcomer& newcomer, bool readable) {
  Sha256& promised = newcomer.entry.promised;
  if (readable) {
    const auto got = newcomer.entry.link->read_some(std::span(promised).subspan(newcomer.have));
    if (!got) return gone();
    newcomer.have += *got;
  }
  if (newcomer.have == promised.size()) return true;
  if (newcomer.until.passed()) return late();
  return false;
}

void Newcomers::note_silent(const Newcomer& newcomer) {
  if (silent_.size() < kMostNamed) silent_.insert(newcomer.entry.address);
}

std::optional<Newcomers::Committed> Newcomers::wait(Deadline deadline) {
  do {
    std::vector<LinkWatch> watches;
    Deadline look = deadline;
    for (const Newcomer& newcomer : waiting_) {
      watches.push_back({.link = newcomer.entry.link});
      look = std::min(look, newcomer.until);
    }
    const bool somebody = listener_.wait(watches, waiting_.size() < kMostNewcomers, look);
    auto watch = watches.begin();
    for (auto newcomer = waiting_.begin(); newcomer != waiting_.end(); ++watch) {
      const auto committed = watch->broken ? Result<bool>(gone()) : read(*newcomer, watch->readable);
      if (committed && *committed) {
        Committed found = std::move(newcomer->entry);
        waiting_.clear();
        return found;
      }
      if (!committed) note_silent(*newcomer);
      newcomer = committed ? std::next(newcomer) : waiting_.erase(newcomer);
    }
    if (somebody) take(listener_.accept());
  } while (!deadline.passed());
  for (const Newcomer& newcomer : waiting_) note_silent(newcomer);
  return std::nullopt;
}

std::string Newcomers::silent_words() const {
  return silent_.empty() ? "" : fmt::format("; {} came and did not begin", fmt::join(silent_, ", "));
}

}  // namespace

Result<Paired> pair_as_server(const PairingPlan& plan, const std::string& bind_address, int port, Deadline deadline,
                              const std::function<void(int)>& listening) {
  const auto key = MachineKey::open(plan.folder);
  if (!key) return key.error();
  auto tls = pairing_tls(*key);
  if (!tls) return tls.error();
  Admission admission;
  admission.tls = *std::move(tls);
  admission.is_local = [](const std::string&) { return false; };
  auto listener = listen_tcp(bind_address, port, std::move(admission));
  if (!listener) return listener.error();
  if (listening) listening((*listener)->port());
  Newcomers newcomers(**listener);
  const auto first = newcomers.wait(deadline);
  if (!first) return Error{Errc::timeout, "nobody came to be paired" + newcomers.silent_words()};
  const Deadline soon = std::min(deadline, Deadline::after(kExchange));
  const auto introduction = introduce_after(first->promised, *first->link, machine_name(), soon);
  if (!introduction) return introduction.error().with_context(first->address);
  return settle(*first->link, *introduction, plan, *key, deadline);
}

Result<Paired> pair_as_client(const PairingPlan& plan, const std::string& host, int port, Deadline deadline) {
  const auto key = MachineKey::open(plan.folder);
  if (!key) return key.error();
  auto tls = pairing_tls(*key);
  if (!tls) return tls.error();
  const std::string name = fmt::format("{}:{}", host, port);
  const Deadline soon = std::min(deadline, Deadline::after(kExchange));
  auto socket = connect_socket(host, port, soon);
  if (!socket)
    return Error{socket.error().code,
                 socket.error().what + "; is birdseyed pair started there, less than two minutes ago?"};
  auto made = TlsLink::over(*std::move(socket), *std::move(tls), TlsLink::Side::client);
  if (!made) return made.error();
  TlsLink& link = **made;
  for (auto shaken = link.shake(); !shaken || !*shaken; shaken = link.shake()) {
    if (!shaken) return shaken.error().with_context(name);
    if (!link.wait_shaken(soon)) return late().with_context(name);
  }
  const auto introduction = introduce(link, TlsLink::Side::client, machine_name(), soon);
  if (!introduction) return introduction.error().with_context(name);
  return settle(link, *introduction, plan, *key, deadline).with_context(name);
}

}  // namespace birdseye::wire
