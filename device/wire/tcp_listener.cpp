#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <deque>
#include <list>
#include <utility>
#include <vector>

#include "device/wire/handshake_limits.hpp"
#include "device/wire/socket_link.hpp"
#include "device/wire/tcp_link.hpp"
#include "device/wire/tls_link.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::wire {

namespace {

constexpr int kMostCalling = 128;  // whoever finds no room here tries again a second later
constexpr int kMostUnsentBytes = 256 << 10;
constexpr std::size_t kMostArrivals = 32, kMostArrivalsOfAHost = 4;
// Who speaks TLS speaks first, and at once. Where plain is allowed, who has said nothing by then is plain.
constexpr Duration kFirstByte = Duration::from_ms(300);
constexpr std::uint8_t kHandshakeRecord = 22;
// A handshake takes a good part of a millisecond of the thread that sends poses.
constexpr Duration kPerHandshake = Duration::from_ms(200);
constexpr std::int64_t kHandshakesAtOnce = 10;
constexpr std::size_t kMostHostsRemembered = 1024;  // as four whole networks have, in some 100 kB
// Of all hosts, between two looks at the clients: the poses wait no longer for many handshakes than for these.
constexpr int kMostStepsAtOnce = 4;

/// Somebody from another machine who is not let in yet.
struct Arrival {
  UniqueFd fd;  ///< until it is known how it speaks
  std::string host;
  DeviceTime due;
  std::unique_ptr<TlsLink> tls;

  [[nodiscard]] pollfd entry() const {
    return {tls ? tls->fd() : fd.get(), static_cast<short>(POLLIN | (tls && tls->has_unsent() ? POLLOUT : 0)), 0};
  }
};

/// Those who have arrived, until each is let in or sent away.
class Gate {
 public:
  explicit Gate(Admission admission) : admission_(std::move(admission)) {}

  [[nodiscard]] bool is_local(const std::string& host) const { return admission_.is_local(host); }
  void take(UniqueFd fd, std::string host);
  void add_to(std::vector<pollfd>& entries) const;
  /// When one of them has to be looked at even where none of them does anything.
  [[nodiscard]] Deadline next_look(Deadline deadline) const;
  /// Goes on with each, whose entries have been waited for.
  void go_on(std::span<const pollfd> entries);
  [[nodiscard]] bool has_links() const { return !let_in_.empty(); }
  std::unique_ptr<Link> next_link();

 private:
  /// Whether it stays.
  bool go_on(Arrival& arrival, short told);
  bool begin_tls(Arrival& arrival);
  void refuse(const std::string& host, const std::string& why) { refusals_.note(host, why, device_now()); }
  void let_in(std::unique_ptr<Link> link) { let_in_.push_back(std::move(link)); }

  Admission admission_;
  RefusalLog refusals_{admission_.tell_refused};
  std::list<Arrival> arrivals_;
  std::deque<std::unique_ptr<Link>> let_in_;
  HandshakeLimits handshakes_{kPerHandshake, kHandshakesAtOnce, kMostHostsRemembered};
};

void Gate::take(UniqueFd fd, std::string host) {
  if (!admission_.tls && !admission_.allow_plain) return refuse(host, "programs of this machine alone are let in");
  if (!admission_.tls) return let_in(link_over(std::move(fd), false));
  const auto of_host = [&](const Arrival& other) { return other.host == host; };
  if (std::ranges::count_if(arrivals_, of_host) >= std::ptrdiff_t{kMostArrivalsOfAHost})
    return refuse(host, fmt::format("it has {} handshakes that are not done", kMostArrivalsOfAHost));
  if (arrivals_.size() + let_in_.size() >= kMostArrivals) {
    if (arrivals_.empty()) return refuse(host, "too many have just been let in");
    refuse(arrivals_.front().host, "its handshake was not done when others needed the place");
    arrivals_.pop_front();  // which has had the most time
  }
  const Duration patience = admission_.allow_plain ? kFirstByte : admission_.patience;
  arrivals_.push_back({std::move(fd), std::move(host), device_now() + patience, nullptr});
  if (!admission_.allow_plain && !begin_tls(arrivals_.back())) arrivals_.pop_back();
}

bool Gate::begin_tls(Arrival& arrival) {
  if (!handshakes_.pass(arrival.host, device_now())) {
    refuse(arrival.host, "it begins handshakes too often");
    return false;
  }
  auto link = TlsLink::over(std::move(arrival.fd), admission_.tls, TlsLink::Side::server);
  if (!link) {
    refuse(arrival.host, link.error().what);
    return false;
  }
  arrival.tls = *std::move(link);
  arrival.due = device_now() + admission_.patience;
  return true;
}

void Gate::add_to(std::vector<pollfd>& entries) const {
  for (const Arrival& arrival : arrivals_) entries.push_back(arrival.entry());
}

Deadline Gate::next_look(Deadline deadline) const {
  if (has_links()) return device_now();
  for (const Arrival& arrival : arrivals_) deadline = std::min<Deadline>(deadline, arrival.due);
  return deadline;
}

void Gate::go_on(std::span<const pollfd> entries) {
  auto entry = entries.begin();
  int steps = 0;
  for (auto arrival = arrivals_.begin(); arrival != arrivals_.end() && entry != entries.end(); ++entry) {
    const bool waits = arrival->tls && entry->revents != 0 && ++steps > kMostStepsAtOnce;
    arrival = go_on(*arrival, waits ? short{0} : entry->revents) ? std::next(arrival) : arrivals_.erase(arrival);
  }
  refusals_.tell_due(device_now());
}

bool Gate::go_on(Arrival& arrival, short told) {
  const bool late = device_now() >= arrival.due;
  if (arrival.tls) {
    if (told != 0) {
      arrival.tls->send_unsent();
      const auto done = arrival.tls->shake();
      if (!done) refuse(arrival.host, done.error().what);
      if (done && *done) let_in(std::move(arrival.tls));
      if (!done || *done) return false;
    }
    if (late) refuse(arrival.host, "its handshake was not done in time");
    return !late;
  }
  std::uint8_t first = 0;
  const ssize_t got = told == 0 ? -1 : ::recv(arrival.fd.get(), &first, 1, MSG_PEEK | MSG_DONTWAIT);
  if (got == 0) {
    refuse(arrival.host, "it went without a word");
    return false;
  }
  if (got < 0 && !late) return true;
  if (got > 0 && first == kHandshakeRecord) return begin_tls(arrival);
  let_in(link_over(std::move(arrival.fd), false));
  return false;
}

std::unique_ptr<Link> Gate::next_link() {
  auto link = std::move(let_in_.front());
  let_in_.pop_front();
  return link;
}

class TcpListener final : public Listener {
 public:
  TcpListener(UniqueFd fd, UniqueFd wake_fd, int port, Admission admission)
      : fd_(std::move(fd)), wake_fd_(std::move(wake_fd)), port_(port), gate_(std::move(admission)) {}

  bool wait(std::span<LinkWatch> links, bool to_accept, Deadline deadline) override {
    entries_.assign({{fd_.get(), static_cast<short>(to_accept ? POLLIN : 0), 0}, {wake_fd_.get(), POLLIN, 0}});
    if (to_accept || !gate_.has_links()) deadline = gate_.next_look(deadline);
    for (const LinkWatch& watch : links) {
      const SocketLink& link = socket_of(watch);
      const auto events =
          static_cast<short>((watch.to_read ? POLLIN : 0) | (watch.to_write || link.has_unsent() ? POLLOUT : 0));
      entries_.push_back({link.fd(), events, 0});
      if (watch.to_read && link.has_read_ahead()) deadline = device_now();
    }
    gate_.add_to(entries_);
    wait_ready(entries_, deadline);
    if ((entries_[1].revents & POLLIN) != 0) {
      std::uint64_t count = 0;
      (void)!::read(wake_fd_.get(), &count, sizeof count);
    }
    for (std::size_t i = 0; i < links.size(); ++i) tell(links[i], entries_[i + 2].revents);
    gate_.go_on(std::span(entries_).subspan(2 + links.size()));
    return to_accept && ((entries_[0].revents & POLLIN) != 0 || gate_.has_links());
  }

  std::unique_ptr<Link> accept() override {
    if (gate_.has_links()) return gate_.next_link();
    UniqueFd fd(::accept4(fd_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!fd) return nullptr;
    const int on = 1;
    ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    // What the kernel holds unsent is no longer ours to shed, and a pose waits behind it.
    ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kMostUnsentBytes, sizeof kMostUnsentBytes);
    std::string host = peer_of(fd);
    if (gate_.is_local(host)) return link_over(std::move(fd), true);
    gate_.take(std::move(fd), std::move(host));
    return gate_.has_links() ? gate_.next_link() : nullptr;
  }

  void wake() override {
    const std::uint64_t one = 1;
    (void)!::write(wake_fd_.get(), &one, sizeof one);
  }

  [[nodiscard]] int port() const override { return port_; }

 private:
  static SocketLink& socket_of(const LinkWatch& watch) { return *static_cast<SocketLink*>(watch.link); }

  static void tell(LinkWatch& watch, short told) {
    SocketLink& link = socket_of(watch);
    if ((told & POLLOUT) != 0) link.send_unsent();
    watch.readable = watch.to_read && ((told & (POLLIN | POLLHUP)) != 0 || link.has_read_ahead());
    const int gone = watch.to_read ? 0 : POLLHUP;  // else read_some() tells, after the last that came
    watch.broken = (told & (POLLERR | POLLNVAL | gone)) != 0;
  }

  UniqueFd fd_, wake_fd_;
  int port_;
  Gate gate_;
  std::vector<pollfd> entries_;
};

/// Why the last call of the kernel did not do what it should.
Error cannot_listen(const std::string& bind_address, int port) {
  if (errno == EADDRINUSE) {
    return {Errc::in_use, fmt::format("[wire] port {} on {} is in use; stop the other program or choose another", port,
                                      bind_address)};
  }
  if (errno == EADDRNOTAVAIL) {
    return {Errc::bad_value, fmt::format("[wire] bind {}: this machine has no such address; give one of its own, or "
                                         "0.0.0.0 for all that it has",
                                         bind_address)};
  }
  return {Errc::bad_value, fmt::format("[wire] bind {} port {}: this machine cannot listen there", bind_address, port)};
}

Result<UniqueFd> bound_socket(const std::string& bind_address, int port) {
  if (const std::string fault = fault_of_bind(bind_address); !fault.empty())
    return Error{Errc::bad_value, "[wire] bind " + fault};
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  ::inet_pton(AF_INET, bind_address.c_str(), &address.sin_addr);
  UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int on = 1;
  if (fd) ::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (!fd || ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return cannot_listen(bind_address, port);
  return fd;
}

}  // namespace

Result<void> check_bind(const std::string& bind_address) {
  if (const auto fd = bound_socket(bind_address, 0); !fd) return fd.error();
  return {};
}

Result<std::unique_ptr<Listener>> listen_tcp(const std::string& bind_address, int port, Admission admission) {
  auto fd = bound_socket(bind_address, port);
  if (!fd) return fd.error();
  sockaddr_in address{};
  socklen_t size = sizeof address;
  if (::listen(fd->get(), kMostCalling) != 0 ||
      ::getsockname(fd->get(), reinterpret_cast<sockaddr*>(&address), &size) != 0)
    return cannot_listen(bind_address, port);
  UniqueFd wake_fd(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  return std::unique_ptr<Listener>(
      std::make_unique<TcpListener>(*std::move(fd), std::move(wake_fd), ntohs(address.sin_port), std::move(admission)));
}

}  // namespace birdseye::wire
