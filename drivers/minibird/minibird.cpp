#include "drivers/minibird/minibird.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "drivers/io/monotonic.hpp"

namespace birdseye::drivers::minibird {

namespace {

std::uint16_t word_of(const Bytes& bytes) {
  return static_cast<std::uint16_t>(bytes[0] + 256U * bytes[1]);
}

/// Sleeps for span, or until stop is requested.
void wait(Duration span, const std::stop_token& stop) {
  const DeviceTime until = now() + span;
  while (now() < until && !stop.stop_requested()) sleep_for(std::min(until - now(), Duration::from_ms(20)));
}

}  // namespace

MiniBird::MiniBird(std::unique_ptr<ByteStream> line, const MiniBirdSettings& settings)
    : line_(std::move(line)), settings_(settings) {}

MiniBird::~MiniBird() {
  // Leave the unit quiet for whoever opens the line next.
  const std::array<std::uint8_t, 1> point{kPoint};
  (void)line_->write(point, now() + Duration::from_ms(50));
}

Result<std::unique_ptr<MiniBird>> MiniBird::start(std::unique_ptr<ByteStream> line, const MiniBirdSettings& settings,
                                                  const std::stop_token& stop) {
  if (settings.birds < 1 || settings.birds > 14) {
    return Error{Errc::bad_value,
                 fmt::format("{}: {} birds; a flock in normal addressing has 1 to 14", line->name(), settings.birds)};
  }
  std::unique_ptr<MiniBird> bird(new MiniBird(std::move(line), settings));
  for (const auto step : {+[](MiniBird&b, const std::stop_token&s) { return b.reset(s); },
                          +[](MiniBird&b, const std::stop_token&) { return b.examine_unit(); },
                          +[](MiniBird&b, const std::stop_token&) { return b.configure(); }}) {
    if (stop.stop_requested())
      return Error{Errc::timeout, fmt::format("{}: stopped while starting", bird->line_->name())};
    if (auto done = step(*bird, stop); !done) return done.error();
  }
  bird->layout_.birds.assign(static_cast<std::size_t>(settings.birds),
                             {settings.format, bird->info_.mm_per_count, into(settings.hemisphere)});
  bird->layout_.group_mode = settings.birds > 1;
  bird->layout_.rate_hz = bird->info_.rate_hz;
  bird->layout_.baud = settings.baud;
  bird->layout_.delay = settings.delay;
  bird->layout_.plausibility = settings.plausibility;
  bird->line_errors_ = bird->line_->line_errors();
  return bird;
}

Result<void> MiniBird::send(const Bytes& command) {
  return line_->write(command, now() + settings_.reply_timeout);
}

Result<Bytes> MiniBird::ask(const Bytes& command, std::size_t reply_bytes) {
  line_->discard_input();
  if (auto sent = send(command); !sent) return sent.error();
  Bytes reply;
  const DeviceTime deadline = now() + settings_.reply_timeout;
  std::array<std::uint8_t, 64> chunk;
  while (reply.size() < reply_bytes) {
    const auto got = line_->read(std::span(chunk).first(reply_bytes - reply.size()), deadline);
    if (!got) return got.error();
    if (*got == 0) {
      return Error{Errc::timeout, fmt::format("{}: the tracker does not answer; check power, cable and baud rate (its "
                                              "DIP switches), and that its FLY switch is on",
                                              line_->name())};
    }
    for (std::size_t i = 0; i < *got; ++i) reply.push_back(chunk[i]);
  }
  return reply;
}

Result<Bytes> MiniBird::ask_parameter(std::uint8_t parameter) {
  return ask(examine(parameter), *examine_bytes(parameter));
}

Result<void> MiniBird::reset(const std::stop_token& stop) {
  info_.has_reset_line = line_->set_rts(true);
  if (info_.has_reset_line) {
    wait(settings_.reset_hold, stop);
    line_->set_rts(false);
    wait(settings_.reset_settle, stop);
  }
  // A unit that streams stops on POINT, with one more record; one that boots says nothing until it is ready.
  const DeviceTime deadline = now() + settings_.answer_within;
  for (;;) {
    if (auto sent = send({kPoint}); !sent) return sent;
    std::array<std::uint8_t, 512> chunk;
    const DeviceTime quiet_by = now() + settings_.reply_timeout;
    for (;;) {
      const auto got = line_->read(chunk, now() + Duration::from_ms(40));
      if (!got) return got.error();
      if (*got == 0 || now() > quiet_by) break;
    }
    const auto status = ask_parameter(kStatus);
    if (status) return {};
    if (status.error().code != Errc::timeout || now() >= deadline || stop.stop_requested()) return status.error();
  }
}

Result<void> MiniBird::examine_unit() {
  const auto revision = ask_parameter(kRevision);
  if (!revision) return revision.error();
  info_.revision_major = (*revision)[0];
  info_.revision_minor = (*revision)[1];
  const auto crystal = ask_parameter(kCrystal);
  if (!crystal) return crystal.error();
  info_.crystal_mhz = (*crystal)[0] == 0 ? 20 : (*crystal)[0];
  const auto model = ask_parameter(kModel);
  if (!model) return model.error();
  info_.model.assign(model->begin(), model->end());
  while (!info_.model.empty() && info_.model.back() == ' ') info_.model.pop_back();
  return {};
}

Result<void> MiniBird::set_rate() {
  // Firmware after 3.63 takes the rate itself; older firmware a count of its crystal.
  const bool by_rate = 256 * info_.revision_major + info_.revision_minor > 256 * 3 + 63;
  if (auto sent = send(by_rate ? set_rate_hz(settings_.rate_hz) : set_rate_count(settings_.rate_hz, info_.crystal_mhz));
      !sent) {
    return sent;
  }
  const auto back = ask_parameter(by_rate ? kRate : kRateCount);
  if (!back) return back.error();
  info_.rate_hz = by_rate ? word_of(*back) / 256.0 : rate_of_count(word_of(*back), info_.crystal_mhz);
  if (std::abs(info_.rate_hz - settings_.rate_hz) > 0.05 * settings_.rate_hz) {
    return Error{Errc::bad_value, fmt::format("{}: the tracker measures at {:.1f} Hz and will not at {:.1f}; set "
                                              "[tracker] rate_hz to what it does",
                                              line_->name(), info_.rate_hz, settings_.rate_hz)};
  }
  return {};
}

Result<void> MiniBird::configure() {
  const auto birds = static_cast<std::uint8_t>(settings_.birds);
  if (birds > 1) {
    sleep_for(settings_.configure_wait);
    if (auto sent = send(auto_configure(birds)); !sent) return sent;
    sleep_for(settings_.configure_wait);
    const auto flock = ask_parameter(kSystemStatus);
    if (!flock) return flock.error();
    for (std::uint8_t i = 0; i < birds; ++i) {
      const UnitStatus unit = decode_unit_status((*flock)[i]);
      if (!unit.accessible || !unit.has_sensor) {
        return Error{Errc::not_found,
                     fmt::format("{}: bird {} of {} is {}; check its address switches, cable and FLY "
                                 "switch, or [tracker] birds",
                                 line_->name(), i + 1, birds, unit.accessible ? "without a sensor" : "not on the bus")};
      }
    }
  }
  if (auto rate = set_rate(); !rate) return rate;
  for (std::uint8_t unit = 1; unit <= birds; ++unit) {
    for (const Bytes& command : {select_format(settings_.format), select_hemisphere(settings_.hemisphere)}) {
      if (auto sent = send(birds > 1 ? to_unit(unit, command) : command); !sent) return sent;
    }
  }
  const auto scale = ask_parameter(kScale);
  if (!scale) return scale.error();
  info_.mm_per_count = word_of(*scale) == 0 ? kMmPerCount36Inch : kMmPerCount72Inch;
  if (birds > 1) {
    if (auto sent = send(set_group_mode(true)); !sent) return sent;
  }
  const auto error = ask_parameter(kErrorCode);
  if (!error) return error.error();
  if ((*error)[0] != 0) info_.latched_error = error_text((*error)[0]);
  if (auto sent = send({kRun}); !sent) return sent;
  sleep_for(settings_.run_wait);
  line_->discard_input();
  return send({kStream});
}

Result<std::optional<Chunk>> MiniBird::read(DeviceTime deadline) {
  std::array<std::uint8_t, 1024> bytes;
  const auto got = line_->read(bytes, deadline);
  if (!got) return got.error();
  if (*got == 0) return std::optional<Chunk>();
  Chunk chunk;
  chunk.arrived = now();
  chunk.bytes.assign(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(*got));
  chunk.after_line_error = line_->line_errors() != std::exchange(line_errors_, line_->line_errors());
  return std::optional<Chunk>(std::move(chunk));
}

}  // namespace birdseye::drivers::minibird
