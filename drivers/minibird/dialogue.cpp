#include "drivers/minibird/dialogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::drivers::minibird {

namespace {

constexpr Duration kLook = Duration::from_ms(50);  // how soon a stop is seen
constexpr int kHushes = 3;
constexpr std::size_t kShown = 16;

}  // namespace

std::string shown(const Bytes& bytes) {
  const auto first = std::span(bytes).first(std::min(bytes.size(), kShown));
  const bool text = std::all_of(first.begin(), first.end(), [](std::uint8_t byte) {
    return (byte >= 0x20 && byte < 0x7F) || byte == '\r' || byte == '\n' || byte == '\t';
  });
  std::string out;
  for (const std::uint8_t byte : first) {
    if (!text) out += fmt::format("{}{:02X}", out.empty() ? "" : " ", byte);
    if (text && byte >= 0x20) out += static_cast<char>(byte);
  }
  return text ? '"' + out + '"' : out;
}

Error Dialogue::stopped() const {
  return {Errc::timeout, fmt::format("{}: stopped while talking to the tracker", name())};
}

Result<void> Dialogue::pause(Duration span) {
  if (still_) still_();
  if (!sleep_for(span, stop_)) return stopped();
  return {};
}

Result<void> Dialogue::send(const Bytes& command, std::uint8_t unit) {
  if (stop_.stop_requested()) return stopped();
  return line_.write(unit == 0 ? command : to_unit(unit, command), device_now() + reply_timeout_);
}

Result<Bytes> Dialogue::listen(std::size_t most, Duration quiet, Duration within) {
  Bytes heard;
  const DeviceTime end = device_now() + within;
  DeviceTime last = device_now();
  std::array<std::uint8_t, 256> chunk;
  while (heard.size() < most) {
    if (stop_.stop_requested()) return stopped();
    if (still_) still_();
    const DeviceTime deadline = std::min({last + quiet, end, device_now() + kLook});
    const auto got = line_.read(std::span(chunk).first(std::min(chunk.size(), most - heard.size())), deadline);
    if (!got) return got.error();
    if (*got > 0) last = device_now();
    for (std::size_t i = 0; i < *got; ++i) heard.push_back(chunk[i]);
    if (device_now() >= end || (*got == 0 && device_now() >= last + quiet)) break;
  }
  return heard;
}

Result<void> Dialogue::hush() {
  Result<Bytes> heard = Bytes();
  for (int i = 0; i < kHushes; ++i) {
    // More than one: a unit that was left in the middle of a command takes the first for its data.
    if (auto sent = send({kPoint}); !sent) return sent;
    heard = listen(std::size_t{1} << 20U, quiet_, std::max(reply_timeout_, quiet_ + quiet_));
    if (!heard) return heard.error();
    line_.discard_input();
    const auto more = listen(1, Duration::from_ms(5), Duration::from_ms(5));
    if (!more) return more.error();
    if (more->empty()) return {};
  }
  return Error{Errc::bad_format,
               fmt::format("{}: this is no miniBIRD, or not at this baud rate: it sends by itself and "
                           "does not stop when told to ({}); check [tracker] device and baud",
                           name(), shown(*heard))};
}

Result<std::optional<Bytes>> Dialogue::exchange(std::uint8_t parameter, std::uint8_t unit) {
  line_.discard_input();
  const Bytes command = examine(parameter);
  if (auto sent = send(command, unit); !sent) return sent.error();
  const std::size_t wanted = *examine_bytes(parameter);
  auto reply = listen(wanted, reply_timeout_, reply_timeout_);
  if (!reply) return reply.error();
  if (*reply == (unit == 0 ? command : to_unit(unit, command))) {
    return Error{Errc::bad_format, fmt::format("{}: this is no miniBIRD: it sends back what it is sent (a loop-back "
                                               "plug, an echoing modem?); check [tracker] device",
                                               name())};
  }
  if (reply->size() < wanted) return std::optional<Bytes>();
  return std::optional<Bytes>(*std::move(reply));
}

Result<std::optional<Bytes>> Dialogue::ask_if_known(std::uint8_t parameter, std::uint8_t unit) {
  return exchange(parameter, unit);
}

Result<Bytes> Dialogue::ask(std::uint8_t parameter, std::uint8_t unit) {
  for (int tries = 0; tries < 2; ++tries) {
    auto reply = exchange(parameter, unit);
    if (!reply) return reply.error();
    if (*reply) return **std::move(reply);
    // It may yet answer, late, and that must not be taken for the answer to the next.
    if (auto quiet = hush(); !quiet) return quiet.error();
  }
  return Error{
      Errc::timeout,
      fmt::format("{}: the tracker does not answer{}; check power, cable and baud rate (its DIP switches), and "
                  "that its FLY switch is on",
                  name(), unit == 0 ? "" : fmt::format(" for bird {}", unit))};
}

}  // namespace birdseye::drivers::minibird
