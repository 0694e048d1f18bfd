#include "drivers/io/ftdi_port.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::drivers {

namespace {

constexpr Duration kRequest = Duration::from_ms(500);
constexpr Duration kCollect = Duration::from_ms(200);

}  // namespace

FtdiPort::FtdiPort(std::unique_ptr<UsbPort> usb, const FtdiSettings& settings, ftdi::Chip chip)
    : usb_(std::move(usb)),
      settings_(settings),
      chip_(chip),
      receiver_(usb_->identity().max_packet, std::max<std::size_t>(settings.buffer, usb_->identity().max_packet)) {}

Result<std::unique_ptr<FtdiPort>> FtdiPort::open(std::unique_ptr<UsbPort> usb, const FtdiSettings& settings) {
  const UsbIdentity& identity = usb->identity();
  if (settings.latency_ms < 1 || settings.latency_ms > 255 || settings.transfers < 1 || settings.transfers > 64) {
    return Error{Errc::bad_value,
                 fmt::format("{}: latency timer of {} ms; a chip takes 1 to 255", identity.name, settings.latency_ms)};
  }
  const auto chip = ftdi::chip_of(identity.bcd_device, identity.has_serial);
  if (!chip) {
    return Error{Errc::unsupported,
                 fmt::format("{}: chip {:04x} is no FTDI chip known here; use it as a serial port of the operating "
                             "system, /dev/ttyUSB...",
                             identity.name, identity.bcd_device)};
  }
  std::unique_ptr<FtdiPort> port(new FtdiPort(std::move(usb), settings, *chip));
  if (auto done = port->set_up(); !done) return done.error();
  if (auto reading = port->usb_->start_reading(settings.transfers); !reading) return reading.error();
  port->pump_ = OwnedThread([p = port.get()](const std::stop_token& stop) { p->pump(stop); });
  return port;
}

FtdiPort::~FtdiPort() {
  pump_.request_stop();
  usb_->wake();
  pump_.join();
}

Result<void> FtdiPort::send(const SetupPacket& request) {
  auto sent = usb_->control(request, device_now() + kRequest);
  if (!sent) return sent.error();
  return {};
}

Result<void> FtdiPort::purge_both() {
  const std::uint16_t port = ftdi::port_index(chip_);
  if (auto sent = send(ftdi::purge(ftdi::Purge::first, port)); !sent) return sent;
  return send(ftdi::purge(ftdi::Purge::second, port));
}

Result<void> FtdiPort::set_up() {
  const std::uint16_t port = ftdi::port_index(chip_);
  const auto baud = ftdi::set_baud(settings_.baud, chip_);
  if (!baud) return baud.error().with_context(name());
  actual_baud_ = baud->actual;
  // RTS first: it holds the instrument in reset. The reset has dropped it already, and later chips may differ.
  for (const SetupPacket& request :
       {ftdi::reset(port), ftdi::set_rts(false, port), ftdi::set_dtr(true, port),
        ftdi::set_flow_control(ftdi::FlowControl::none, port), baud->request, ftdi::set_data_format({}, port),
        ftdi::set_event_character({}, port), ftdi::set_error_character({}, port)}) {
    if (auto sent = send(request); !sent) return sent;
  }
  if (auto latency = set_up_latency(); !latency) return latency;
  return purge_both();
}

Result<void> FtdiPort::set_up_latency() {
  if (!ftdi::has_latency_timer(chip_)) return {};
  const std::uint16_t port = ftdi::port_index(chip_);
  // Some chips do not take 1 ms. One that takes neither works, with later bytes: describe() tells.
  for (const int wanted : {settings_.latency_ms, std::max(2, settings_.latency_ms)}) {
    auto set = send(ftdi::set_latency(static_cast<std::uint8_t>(wanted), port));
    if (!set && set.error().code != Errc::unsupported) return set;
    const auto back = usb_->control(ftdi::get_latency(port), device_now() + kRequest);
    if (!back && back.error().code != Errc::unsupported) return back.error();
    actual_latency_ms_ = back && !back->empty() ? std::optional<int>(back->front()) : std::nullopt;
    if (actual_latency_ms_ == wanted) break;
  }
  return {};
}

void FtdiPort::pump(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    auto input = usb_->collect(device_now() + kCollect);
    const std::lock_guard lock(mutex_);
    if (!input) {
      ended_ = input.error();
      came_.notify_all();
      return;
    }
    if (!*input) continue;
    if ((*input)->failed) {
      receiver_.push_failed();
    } else {
      receiver_.push((*input)->bytes, (*input)->arrived);
    }
    if (!receiver_.empty()) came_.notify_all();
  }
}

Result<std::size_t> FtdiPort::read(std::span<std::uint8_t> into, Deadline deadline) {
  std::unique_lock lock(mutex_);
  came_.wait(lock, deadline, [this] { return !receiver_.empty() || ended_; });
  // What came before the end is still to be had.
  if (receiver_.empty() && ended_) return *ended_;
  const FtdiReceiver::Taken taken = receiver_.take(into);
  if (taken.bytes > 0) arrival_ = taken.arrived;
  return taken.bytes;
}

Result<void> FtdiPort::write(std::span<const std::uint8_t> bytes, Deadline deadline) {
  while (!bytes.empty()) {
    const auto put = usb_->bulk_out(bytes, deadline);
    if (!put) return put.error();
    bytes = bytes.subspan(*put);
    if (!bytes.empty() && deadline.passed()) {
      return Error{Errc::timeout, fmt::format("{}: does not take commands", name())};
    }
  }
  return {};
}

void FtdiPort::discard_input() {
  // Not by a purge: which of the two is the input's is disputed, and the other one would eat a command on its way out.
  // What the chip holds is here after its latency timer and a frame of the bus.
  sleep_for(Duration::from_ms(std::min(actual_latency_ms_.value_or(settings_.latency_ms), 20) + 1));
  const std::lock_guard lock(mutex_);
  receiver_.clear();
}

bool FtdiPort::set_rts(bool asserted) {
  return send(ftdi::set_rts(asserted, ftdi::port_index(chip_))).has_value();
}

std::uint64_t FtdiPort::line_errors() const {
  const std::lock_guard lock(mutex_);
  return receiver_.errors_passed();
}

FtdiCounters FtdiPort::counters() const {
  const std::lock_guard lock(mutex_);
  return receiver_.counters();
}

std::string FtdiPort::describe() const {
  const UsbIdentity& identity = usb_->identity();
  const std::string latency =
      actual_latency_ms_
          ? fmt::format(
                "latency timer {} ms{}", *actual_latency_ms_,
                *actual_latency_ms_ == settings_.latency_ms ? "" : fmt::format(" instead of {}", settings_.latency_ms))
          : std::string("no latency timer");
  return fmt::format("{}: {}{}{}, chip {}, {:.0f} baud, {}", identity.name,
                     identity.product_text.empty() ? "adapter" : identity.product_text,
                     identity.serial.empty() ? "" : " serial ", identity.serial, ftdi::name_of(chip_), actual_baud_,
                     latency);
}

}  // namespace birdseye::drivers
