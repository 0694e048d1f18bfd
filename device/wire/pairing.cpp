#include "device/wire/pairing.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <span>
#include <utility>

#include "device/wire/tcp_link.hpp"
#include "drivers/identity/known_keys.hpp"
#include "drivers/system/durable.hpp"
#include "drivers/system/yes_or_no.hpp"

namespace birdseye::wire {

namespace {

constexpr std::size_t kNameBytes = 64;
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

Result<Card> exchange_as_server(TlsLink& link, const Card& own, Deadline deadline, bool* begun) {
  Sha256 promised{};
  Card others{};
  if (auto got = receive(link, promised, deadline); !got) return got.error();
  if (begun != nullptr) *begun = true;
  if (auto sent = send(link, own, deadline); !sent) return sent.error();
  if (auto got = receive(link, others, deadline); !got) return got.error();
  if (sha256_of({others}) == promised) return others;
  return Error{Errc::bad_value,
               "the other machine is not what it began as: do not pair it, and look who is on this network"};
}

}  // namespace

Result<Introduction> introduce(TlsLink& link, TlsLink::Side side, const std::string& own_name, Deadline deadline,
                               bool* begun) {
  const auto own = card_of(own_name);
  if (!own) return own.error();
  const bool client = side == TlsLink::Side::client;
  const auto others =
      client ? exchange_as_client(link, *own, deadline) : exchange_as_server(link, *own, deadline, begun);
  if (!others) return others.error();
  const Card& of_client = client ? *own : *others;
  const Card& of_server = client ? *others : *own;
  const PublicKey& client_key = client ? link.own_key() : link.peer_key();
  const PublicKey& server_key = client ? link.peer_key() : link.own_key();
  const Sha256 hash =
      sha256_of({link.secret("EXPORTER-birdseye-pairing"), of_client, of_server, client_key.bytes, server_key.bytes});
  return Introduction{code_of(hash), name_of(*others), link.peer_key()};
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

Result<void> write_text(const std::filesystem::path& path, const std::string& text) {
  const std::filesystem::path part = path.string() + ".part";
  std::ofstream out(part, std::ios::binary | std::ios::trunc);
  out << text;
  out.close();
  if (!out) return Error{Errc::unreadable, fmt::format("{}: cannot be written; check the folder", path.string())};
  return replace_durably(part, path);
}

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
    if (auto written = write_text(plan.folder / (std::string(file) + ".crt"), text); !written) return written.error();
  }
  if (auto added = known->add(*name, introduction.key); !added) return added.error();
  return Paired{*name, introduction.key};
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
  while (!deadline.passed()) {
    if (!(*listener)->wait({}, true, deadline)) continue;
    const auto accepted = (*listener)->accept();
    auto* const link = dynamic_cast<TlsLink*>(accepted.get());
    if (link == nullptr) continue;
    bool begun = false;
    const auto introduction =
        introduce(*link, TlsLink::Side::server, machine_name(), std::min(deadline, Deadline::after(kExchange)), &begun);
    if (introduction) return settle(*link, *introduction, plan, *key, deadline);
    if (begun) return introduction.error();
  }
  return Error{Errc::timeout, "nobody came to be paired"};
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
