#include "device/wire/client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "device/wire/igtl_bytes.hpp"
#include "device/wire/tcp_link.hpp"

namespace birdseye::wire {

namespace {

constexpr Duration kFirstWord = Duration::from_ms(250);
constexpr Duration kPosesAskedAfter = Duration::from_ms(1000);

}  // namespace

Client::Client(std::unique_ptr<Link> link, std::string name, ForeignSettings foreign)
    : link_(std::move(link)), name_(std::move(name)), foreign_settings_(std::move(foreign)), connected_(host_now()) {}

Result<std::unique_ptr<Client>> Client::connect(const std::string& host, int port, Deadline deadline,
                                                ForeignSettings foreign) {
  auto link = connect_tcp(host, port, deadline);
  if (!link) return link.error();
  return over(*std::move(link), fmt::format("{}:{}", host, port), std::move(foreign));
}

std::unique_ptr<Client> Client::over(std::unique_ptr<Link> link, std::string name, ForeignSettings foreign) {
  return std::unique_ptr<Client>(new Client(std::move(link), std::move(name), std::move(foreign)));
}

Error Client::gone() const {
  return {Errc::disconnected, fmt::format("{}: the {} has gone", name_, foreign_ ? "server" : "appliance")};
}

Result<bool> Client::fill(std::size_t size, Deadline deadline) {
  buffer_.resize(std::max(buffer_.size(), size));
  while (have_ < size) {
    const auto got = link_->read_some(std::span(buffer_).subspan(have_, size - have_));
    if (!got) return gone();
    have_ += *got;
    if (*got == 0 && !link_->wait_readable(deadline)) return false;
  }
  return true;
}

Result<void> Client::send(const Packet& packet, Deadline deadline) {
  std::span<const std::uint8_t> rest(*packet.head);
  while (!rest.empty()) {
    const auto put = link_->write_some(std::span(&rest, 1));
    if (!put) return gone();
    rest = rest.subspan(*put);
    if (*put == 0 && !link_->wait_writable(deadline)) {
      return Error{Errc::timeout, fmt::format("{}: the appliance does not take what is sent to it", name_)};
    }
  }
  return {};
}

Result<void> Client::subscribe(const Subscription& subscription, Deadline deadline) {
  return send(pack(subscription), deadline);
}

Result<void> Client::lock_camera(bool on, Deadline deadline) {
  return send(pack(CameraLock{on}), deadline);
}

void Client::ask_the_time() {
  const HostTime now = host_now();
  if (now < next_question_) return;
  // Often at first, so that the clocks are soon related; then as often as drift makes it worth while.
  next_question_ = now + Duration::from_ms(++questions_ < 20 ? 100 : 1000);
  (void)send(pack(ClockPing{now.ns}), now);  // who cannot be asked will be found gone by reading
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
    return exchange_sigma ? std::optional(ClockChoice{ClockChoice::Way::exchange, *exchange_sigma}) : std::nullopt;
  return choose_clock(exchange_sigma, there_->discipline, here_->discipline);
}

std::optional<RelatedTime<HostTime>> Client::host_from_device(DeviceTime time) const {
  if (foreign_) return foreign_->host_from_device(time);
  const auto choice = choose();
  if (!choice) return std::nullopt;
  if (choice->way == ClockChoice::Way::exchange) return relation_.host_from_device(time);
  const Duration shift = there_->wall_minus_monotonic - here_->wall_minus_monotonic;
  return RelatedTime<HostTime>{{time.ns + shift.ns}, choice->sigma};
}

Result<std::optional<std::span<const std::uint8_t>>> Client::next_message(Deadline deadline) {
  using Message = std::optional<std::span<const std::uint8_t>>;
  auto whole = fill(kHeaderBytes, deadline);
  if (!whole) return whole.error();
  if (!*whole) return Message();
  const auto body = body_bytes(std::span(buffer_).first(kHeaderBytes));
  if (!body) return body.error().with_context(name_);
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
  const Duration silent = host_now() - connected_;
  if (appliance_ || (!foreign_ && silent > kFirstWord)) ask_the_time();
  if (appliance_ || asked_for_poses_ || (!foreign_ && silent < kPosesAskedAfter)) return;
  asked_for_poses_ = true;
  (void)send(pack_tracking_request(), host_now());
  (void)send(pack_status_request(), host_now());
}

Result<void> Client::drain() {
  constexpr int kMostAtOnce = 16;
  for (int i = 0; i < kMostAtOnce; ++i) {
    const auto message = next_message(host_now());
    if (!message) return message.error();
    if (!*message) return {};
    const auto header = read_header(**message, kLargestBody);
    if (!header) return header.error().with_context(name_);
    foreign_->push(*header, (*message)->subspan(kHeaderBytes), host_now());
  }
  return {};
}

Result<std::optional<Event>> Client::next(Deadline deadline) {
  for (;;) {
    ask();
    Deadline until = deadline;
    // Who is silent is asked after a while, also where the caller waits for longer.
    if (!appliance_ && !foreign_) until = std::min(until, Deadline::after({kFirstWord.ns / 2}));
    if (foreign_) {
      // What has come already is read first: a pose that lies there is not missed, however late this thread is.
      if (auto drained = drain(); !drained) return drained.error();
      if (auto event = foreign_->next(host_now())) return event;
      if (deadline.passed()) return std::optional<Event>();
      if (const auto due = foreign_->due()) until = std::min(until, Deadline(*due));
    }
    const auto message = next_message(until);
    if (!message) return message.error();
    if (!*message) {
      if (until == deadline) return std::optional<Event>();
      continue;
    }
    const auto header = read_header(**message, kLargestBody);
    if (!header) return header.error().with_context(name_);
    judge(*header);
    if (foreign_) {
      foreign_->push(*header, (*message)->subspan(kHeaderBytes), host_now());
      continue;
    }
    auto told = unpacker_.push(**message);
    if (!told) return told.error().with_context(name_);
    if (*told && std::holds_alternative<ClockPong>(**told)) {
      take(std::get<ClockPong>(**told));
      told->reset();
    }
    if (!*told) {
      if (deadline.passed()) return std::optional<Event>();
      continue;
    }
    auto& event = std::get<Event>(**told);
    if (const auto* health = std::get_if<Health>(&event); health != nullptr && health->clock.known)
      there_ = Discipline{health->clock.discipline(), {health->clock.wall_minus_monotonic_ns}};
    return std::optional<Event>(std::move(event));
  }
}

}  // namespace birdseye::wire
