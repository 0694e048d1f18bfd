#include "device/wire/client.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <thread>

#include "device/wire/igtl_bytes.hpp"

namespace birdseye::wire {

namespace {

constexpr auto kFirstWord = std::chrono::milliseconds(250);
constexpr auto kSilence = std::chrono::seconds(1);

int remaining_ms(Client::Clock::time_point deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Client::Clock::now()).count();
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, 60'000));
}

HostTime host_now() {
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(Client::Clock::now().time_since_epoch()).count()};
}

/// A connected socket, or -1.
int try_connect(const addrinfo& address, Client::Clock::time_point deadline) {
  const int fd = ::socket(address.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return -1;
  if (::connect(fd, address.ai_addr, address.ai_addrlen) == 0) return fd;
  pollfd entry{fd, POLLOUT, 0};
  int failed = 0;
  socklen_t size = sizeof failed;
  if (errno == EINPROGRESS && ::poll(&entry, 1, remaining_ms(deadline)) > 0 &&
      ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &failed, &size) == 0 && failed == 0) {
    return fd;
  }
  ::close(fd);
  return -1;
}

}  // namespace

Client::Client(int fd, std::string name, ForeignSettings foreign)
    : fd_(fd), name_(std::move(name)), foreign_settings_(std::move(foreign)), connected_(Clock::now()) {}

Result<std::unique_ptr<Client>> Client::connect(const std::string& host, int port, Clock::time_point deadline,
                                                ForeignSettings foreign) {
  const std::string name = fmt::format("{}:{}", host, port);
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found) != 0) {
    return Error{Errc::not_found, fmt::format("{}: no such host", name)};
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, ::freeaddrinfo);
  for (;;) {
    if (const int fd = try_connect(*found, deadline); fd >= 0)
      return std::unique_ptr<Client>(new Client(fd, name, std::move(foreign)));
    if (Clock::now() >= deadline) {
      return Error{Errc::not_found, fmt::format("{}: no appliance answers; is birdseyed running there?", name)};
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

Client::~Client() {
  ::close(fd_);
}

Error Client::gone() const {
  return {Errc::disconnected, fmt::format("{}: the {} has gone", name_, foreign_ ? "server" : "appliance")};
}

Result<bool> Client::fill(std::size_t size, Clock::time_point deadline) {
  buffer_.resize(std::max(buffer_.size(), size));
  while (have_ < size) {
    pollfd entry{fd_, POLLIN, 0};
    const int ready = ::poll(&entry, 1, remaining_ms(deadline));
    if (ready == 0 && Clock::now() >= deadline) return false;
    if (ready <= 0) continue;
    const ssize_t got = ::recv(fd_, buffer_.data() + have_, size - have_, 0);
    if (got > 0) {
      have_ += static_cast<std::size_t>(got);
    } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
      return gone();
    }
  }
  return true;
}

Result<void> Client::send(const Packet& packet, Clock::time_point deadline) {
  std::span<const std::uint8_t> rest(*packet.head);
  while (!rest.empty()) {
    const ssize_t put = ::send(fd_, rest.data(), rest.size(), MSG_NOSIGNAL);
    if (put > 0) {
      rest = rest.subspan(static_cast<std::size_t>(put));
      continue;
    }
    if (errno != EAGAIN && errno != EINTR) {
      return gone();
    }
    pollfd entry{fd_, POLLOUT, 0};
    if (::poll(&entry, 1, remaining_ms(deadline)) == 0 && Clock::now() >= deadline) {
      return Error{Errc::timeout, fmt::format("{}: the appliance does not take what is sent to it", name_)};
    }
  }
  return {};
}

Result<void> Client::subscribe(const Subscription& subscription, Clock::time_point deadline) {
  return send(pack(subscription), deadline);
}

Result<void> Client::lock_camera(bool on, Clock::time_point deadline) {
  return send(pack(CameraLock{on}), deadline);
}

void Client::ask_the_time() {
  const auto now = Clock::now();
  if (now < next_question_) return;
  // Often at first, so that the clocks are soon related; then as often as drift makes it worth while.
  next_question_ = now + std::chrono::milliseconds(++questions_ < 20 ? 100 : 1000);
  (void)send(pack(ClockPing{host_now().ns}), now);  // who cannot be asked will be found gone by reading
}

void Client::take(const ClockPong& pong) {
  relation_.push({{pong.host_sent_ns}, pong.received, pong.sent, host_now()});
}

void Client::use_discipline(const ClockDiscipline& discipline, Duration wall_minus_monotonic) {
  here_ = Discipline{discipline, wall_minus_monotonic};
}

std::optional<ClockChoice> Client::choose() const {
  std::optional<Duration> exchange_sigma;
  if (const auto related = relation_.device_from_host(host_now())) exchange_sigma = related->sigma;
  if (!here_ || !there_)
    return exchange_sigma ? std::optional(ClockChoice{ClockChoice::Way::exchange, *exchange_sigma, "by questions"})
                          : std::nullopt;
  return choose_clock(exchange_sigma, there_->discipline, here_->discipline);
}

std::string Client::clock_choice() const {
  if (foreign_) return "by arrivals";
  const auto choice = choose();
  return choice ? choice->reason : "the appliance has not answered yet";
}

std::optional<RelatedTime<HostTime>> Client::host_from_device(DeviceTime time) const {
  if (foreign_) return foreign_->host_from_device(time);
  const auto choice = choose();
  if (!choice) return std::nullopt;
  if (choice->way == ClockChoice::Way::exchange) return relation_.host_from_device(time);
  const Duration shift = there_->wall_minus_monotonic - here_->wall_minus_monotonic;
  return RelatedTime<HostTime>{{time.ns + shift.ns}, choice->sigma};
}

Result<std::optional<std::span<const std::uint8_t>>> Client::next_message(Clock::time_point deadline) {
  using Message = std::optional<std::span<const std::uint8_t>>;
  auto whole = fill(kHeaderBytes, deadline);
  if (!whole) return whole.error();
  if (!*whole) return Message();
  const auto body = body_bytes(std::span(buffer_).first(kHeaderBytes));
  if (!body) return Error{body.error().code, fmt::format("{}: {}", name_, body.error().what)};
  const std::size_t size = kHeaderBytes + *body;
  whole = fill(size, deadline);
  if (!whole) return whole.error();
  if (!*whole) return Message();
  have_ = 0;
  return Message(std::span(buffer_).first(size));
}

void Client::judge(const Header& header) {
  if (appliance_ || foreign_) return;
  if (is_of_appliance(header)) {
    appliance_ = true;
  } else {
    foreign_.emplace(foreign_settings_, host_now());
  }
}

/// An appliance speaks first: who has not is asked for the time after a moment, and for poses, which some send only to
/// those who ask. Others are not bothered with questions that they do not know.
void Client::ask() {
  const auto silent = Clock::now() - connected_;
  if (appliance_ || (!foreign_ && silent > kFirstWord)) ask_the_time();
  if (appliance_ || asked_for_poses_ || (!foreign_ && silent < kSilence)) return;
  asked_for_poses_ = true;
  (void)send(pack_tracking_request(), Clock::now());
}

Result<void> Client::drain() {
  constexpr int kMostAtOnce = 16;
  for (int i = 0; i < kMostAtOnce; ++i) {
    const auto message = next_message(Clock::now());
    if (!message) return message.error();
    if (!*message) return {};
    const auto header = read_header(**message, kLargestBody);
    if (!header) return Error{header.error().code, fmt::format("{}: {}", name_, header.error().what)};
    foreign_->push(*header, (*message)->subspan(kHeaderBytes), host_now());
  }
  return {};
}

Result<std::optional<Event>> Client::next(Clock::time_point deadline) {
  for (;;) {
    ask();
    auto until = deadline;
    // Who is silent is asked after a while, also where the caller waits for longer.
    if (!appliance_ && !foreign_) until = std::min(until, Clock::now() + kFirstWord / 2);
    if (foreign_) {
      // What has come already is read first: a pose that lies there is not missed, however late this thread is.
      if (auto drained = drain(); !drained) return drained.error();
      if (auto event = foreign_->next(host_now())) return event;
      if (Clock::now() >= deadline) return std::optional<Event>();
      if (const auto due = foreign_->due())
        until = std::min(until, Clock::time_point(std::chrono::nanoseconds(due->ns)));
    }
    const auto message = next_message(until);
    if (!message) return message.error();
    if (!*message) {
      if (until == deadline) return std::optional<Event>();
      continue;
    }
    const auto header = read_header(**message, kLargestBody);
    if (!header) return Error{header.error().code, fmt::format("{}: {}", name_, header.error().what)};
    judge(*header);
    if (foreign_) {
      foreign_->push(*header, (*message)->subspan(kHeaderBytes), host_now());
      continue;
    }
    auto told = unpacker_.push(**message);
    if (!told) return Error{told.error().code, fmt::format("{}: {}", name_, told.error().what)};
    if (*told && std::holds_alternative<ClockPong>(**told)) {
      take(std::get<ClockPong>(**told));
      told->reset();
    }
    if (!*told) {
      if (Clock::now() >= deadline) return std::optional<Event>();
      continue;
    }
    auto& event = std::get<Event>(**told);
    if (const auto* health = std::get_if<Health>(&event); health != nullptr && health->clock.known)
      there_ = Discipline{health->clock.discipline(), {health->clock.wall_minus_monotonic_ns}};
    return std::optional<Event>(std::move(event));
  }
}

}  // namespace birdseye::wire
