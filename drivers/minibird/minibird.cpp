#include "drivers/minibird/minibird.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/minibird/configuration.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::drivers::minibird {

namespace {

constexpr int kPoints = 3;
constexpr double kRateAgrees = 0.005;

bool is_one_cycle(const Bytes& bytes, const StreamLayout& layout) {
  if (bytes.size() != cycle_bytes(layout)) return false;
  std::size_t at = 0;
  for (std::size_t bird = 0; bird < layout.birds.size(); ++bird) {
    const std::size_t end = at + record_bytes(layout, bird);
    for (std::size_t i = at; i < end; ++i) {
      if ((bytes[i] >= 0x80U) != (i == at)) return false;
    }
    if (layout.group_mode && bytes[end - 1] != bird + 1) return false;
    at = end;
  }
  return true;
}

void append(std::string& words, const std::string& more) {
  if (!more.empty()) words += (words.empty() ? "" : "; ") + more;
}

}  // namespace

MiniBird::MiniBird(std::unique_ptr<ByteStream> line, const MiniBirdSettings& settings)
    : line_(std::move(line)), settings_(settings), dialogue_(*line_, settings_.reply_timeout, settings_.quiet) {}

MiniBird::~MiniBird() {
  // Leave the unit quiet for whoever opens the line next.
  const std::array<std::uint8_t, 1> point{kPoint};
  (void)line_->write(point, device_now() + Duration::from_ms(50));
}

Result<std::unique_ptr<MiniBird>> MiniBird::start(std::unique_ptr<ByteStream> line, const MiniBirdSettings& settings,
                                                  const std::stop_token& stop, const std::function<void()>& still) {
  if (const auto faults = faults_of(settings); !faults.empty()) {
    return Error{Errc::bad_value, fmt::format("{}: {}", line->name(), fmt::join(faults, "; "))};
  }
  std::unique_ptr<MiniBird> bird(new MiniBird(std::move(line), settings));
  bird->dialogue_.obey(stop, still);
  auto begun = bird->begin();
  bird->dialogue_.obey({});
  if (!begun) return begun.error();
  return bird;
}

std::uint8_t MiniBird::address_of(std::size_t index) const {
  return settings_.birds > 1 ? static_cast<std::uint8_t>(index + 1) : std::uint8_t{0};
}

Result<void> MiniBird::begin() {
  // Opening a port asserts RTS, which holds the unit in reset.
  info_.has_reset_line = line_->set_rts(false);
  info_.not_warm = "not wanted";
  if (settings_.warm_restart) {
    auto why_not = try_warm();
    if (why_not) {
      info_.not_warm = *why_not;
    } else if (why_not.error().code == Errc::disconnected) {
      return why_not.error();
    } else {
      info_.not_warm = why_not.error().what;  // a reset may help; if not, that says why
    }
  }
  info_.warm = info_.not_warm.empty();
  if (!info_.warm) {
    if (auto done = reset(); !done) return done;
    if (auto done = configure(); !done) return done;
  }
  if (auto done = run(); !done) return done;
  if (auto done = check_record(); !done) return done;
  return stream();
}

/// Why the unit cannot be left as it is; empty if it can.
Result<std::string> MiniBird::try_warm() {
  if (auto quiet = dialogue_.hush(); !quiet) return quiet.error();
  const auto revision = dialogue_.ask_if_known(kRevision);
  if (!revision) return revision.error();
  if (!*revision) return std::string("it did not answer at once");
  if (settings_.birds > 1) {
    if (auto flock = check_flock(); !flock) return flock.error();
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(settings_.birds); ++i) {
    auto odd = odd_status(i);
    if (!odd || !odd->empty()) return odd;
  }
  if (auto examined = examine_units(); !examined) return examined.error();
  if (auto noted = note_errors(); !noted) return noted.error();
  const auto rate = settle_rate(dialogue_, settings_, info_.units.front(), true);
  if (!rate) return rate.error();
  if (std::abs(*rate - settings_.rate_hz) > kRateAgrees * settings_.rate_hz) {
    return fmt::format("it measured at {:.1f} Hz", *rate);
  }
  std::vector<Setting> list;
  for (std::size_t i = 0; i < info_.units.size(); ++i) {
    for (Setting& setting : settings_of_unit(settings_, info_.units[i], i, info_.notes))
      list.push_back(std::move(setting));
  }
  for (Setting& setting : settings_of_port(settings_, info_.units.front())) list.push_back(std::move(setting));
  auto different = first_difference(dialogue_, list);
  if (!different) return different.error();
  if (!different->empty()) return fmt::format("it had another {}, or does not tell it", *different);
  for (std::size_t i = 0; i < info_.units.size(); ++i) {
    const auto scale = mm_per_count_of(dialogue_, address_of(i));
    if (!scale) return scale.error();
    info_.units[i].mm_per_count = *scale;
  }
  info_.mm_per_count = info_.units.front().mm_per_count;
  info_.rate_hz = *rate;
  layout_ = layout_of(settings_, info_.units, *rate);
  return std::string();
}

/// What in a unit's status a warm restart does not mend; empty for nothing.
Result<std::string> MiniBird::odd_status(std::size_t index) {
  const auto reply = dialogue_.ask(kStatus, address_of(index));
  if (!reply) return reply.error();
  const StatusWord status = decode_status_word(static_cast<std::uint16_t>((*reply)[0] + 256U * (*reply)[1]));
  if (status.format_code != static_cast<std::uint8_t>(format_of(settings_, index))) {
    return std::string("it had another record format");
  }
  if (status.xoff || status.host_sync || status.crt_sync || status.expanded_addressing || status.factory_test) {
    return words_of(status);
  }
  return std::string();
}

Result<void> MiniBird::reset() {
  info_.units.clear();
  info_.notes.clear();
  if (info_.has_reset_line) {
    line_->set_rts(true);
    auto held = dialogue_.pause(settings_.reset_hold);
    line_->set_rts(false);
    if (!held) return held;
    if (auto waited = dialogue_.pause(settings_.reset_settle); !waited) return waited;
  }
  // A unit that boots says nothing until it is ready.
  const Deadline deadline = Deadline::after(settings_.answer_within);
  for (bool first = true;; first = false) {
    auto quiet = dialogue_.hush();
    if (quiet) {
      const auto revision = dialogue_.ask_if_known(kRevision);
      if (!revision) return revision.error();
      // An answer to an earlier question may be yet to come.
      if (*revision) return first ? Result<void>() : dialogue_.hush();
    } else if (quiet.error().code != Errc::bad_format) {
      return quiet;
    }
    if (!deadline.passed()) continue;
    if (!quiet) return quiet;
    const auto revision = dialogue_.ask(kRevision);
    return revision ? Result<void>() : revision.error();
  }
}

Result<void> MiniBird::gather_flock() {
  if (auto sent = dialogue_.send({kBusReset}); !sent) return sent;
  if (auto waited = dialogue_.pause(std::max(settings_.bus_reset_wait, settings_.configure_wait)); !waited)
    return waited;
  if (auto sent = dialogue_.send(auto_configure(static_cast<std::uint8_t>(settings_.birds))); !sent) return sent;
  if (auto waited = dialogue_.pause(settings_.configure_wait); !waited) return waited;
  return check_flock();
}

Result<void> MiniBird::check_flock() {
  const auto flock = dialogue_.ask(kSystemStatus);
  if (!flock) return flock.error();
  for (std::size_t i = 0; i < flock->size(); ++i) {
    const UnitStatus unit = decode_unit_status((*flock)[i]);
    if (i >= static_cast<std::size_t>(settings_.birds)) {
      if (unit.accessible) info_.notes.push_back(fmt::format("bird {} is on the bus, but not asked for", i + 1));
      continue;
    }
    if (unit.accessible && unit.extended_range) {
      return Error{Errc::unsupported, fmt::format("{}: unit {} is an extended-range controller, which this driver does "
                                                  "not know; use a standard transmitter",
                                                  line_->name(), i + 1)};
    }
    if (!unit.accessible || !unit.has_sensor) {
      return Error{
          Errc::not_found,
          fmt::format("{}: bird {} of {} is {}; check its address switches, cable and FLY switch, or [tracker] "
                      "birds",
                      line_->name(), i + 1, settings_.birds, unit.accessible ? "without a sensor" : "not on the bus")};
    }
  }
  return {};
}

Result<void> MiniBird::examine_units() {
  info_.units.clear();
  for (std::size_t i = 0; i < static_cast<std::size_t>(settings_.birds); ++i) {
    auto unit = examine_unit(dialogue_, address_of(i));
    if (!unit) return unit.error();
    info_.units.push_back(*std::move(unit));
  }
  const UnitInfo& master = info_.units.front();
  info_.model = master.model;
  info_.revision_major = master.revision_major;
  info_.revision_minor = master.revision_minor;
  info_.crystal_mhz = master.crystal_mhz;
  return {};
}

/// Reads the latched errors. That an older firmware did not understand a question is none.
Result<void> MiniBird::note_errors() {
  info_.latched_error.clear();
  for (std::size_t i = 0; i < info_.units.size(); ++i) {
    auto errors = read_errors(dialogue_, address_of(i));
    if (!errors) return errors.error();
    std::erase_if(*errors, [](const UnitError& error) { return error.code == 6; });
    for (const UnitError& error : *errors) {
      std::string& noted = info_.units[i].latched_error;
      if (noted.find(words_of(error)) == std::string::npos) append(noted, words_of(error));
    }
    if (info_.units[i].latched_error.empty()) continue;
    append(info_.latched_error, settings_.birds > 1 ? fmt::format("bird {}: {}", i + 1, info_.units[i].latched_error)
                                                    : info_.units[i].latched_error);
  }
  return {};
}

Result<void> MiniBird::configure() {
  // The first thing said to it is a question: what is no miniBIRD shall not be sent commands that it may take for
  // others.
  if (auto known = examine_unit(dialogue_, 0); !known) return known.error();
  if (settings_.birds > 1) {
    if (auto flock = gather_flock(); !flock) return flock;
  }
  if (auto examined = examine_units(); !examined) return examined;
  if (auto noted = note_errors(); !noted) return noted;
  const auto rate = settle_rate(dialogue_, settings_, info_.units.front());
  if (!rate) return rate.error();
  for (std::size_t i = 0; i < info_.units.size(); ++i) {
    UnitInfo& unit = info_.units[i];
    const auto list = settings_of_unit(settings_, unit, i, info_.notes);
    if (auto applied = apply(dialogue_, list, info_.has_reset_line); !applied) return applied;
    const auto scale = mm_per_count_of(dialogue_, address_of(i));
    if (!scale) return scale.error();
    unit.mm_per_count = *scale;
  }
  const auto port = settings_of_port(settings_, info_.units.front());
  if (auto applied = apply(dialogue_, port, info_.has_reset_line); !applied) return applied;
  if (auto noted = note_errors(); !noted) return noted;
  info_.mm_per_count = info_.units.front().mm_per_count;
  info_.rate_hz = *rate;
  layout_ = layout_of(settings_, info_.units, *rate);
  return {};
}

Result<void> MiniBird::run() {
  // To the unit that has the port: in a flock that is the master, which runs them all.
  if (auto sent = dialogue_.send({kXon}); !sent) return sent;
  if (auto sent = dialogue_.send({kRun}); !sent) return sent;
  return dialogue_.pause(settings_.run_wait);
}

Result<void> MiniBird::check_record() {
  const std::size_t wanted = cycle_bytes(layout_);
  const Duration on_the_line{static_cast<std::int64_t>(wanted) * 10 * 1'000'000'000 / settings_.baud};
  Bytes last;
  for (int i = 0; i < kPoints; ++i) {
    line_->discard_input();
    if (auto sent = dialogue_.send({kPoint}); !sent) return sent;
    const auto heard = dialogue_.listen(4 * wanted, settings_.quiet, settings_.reply_timeout + on_the_line);
    if (!heard) return heard.error();
    if (is_one_cycle(*heard, layout_)) return {};
    if (!heard->empty()) last = *heard;
  }
  if (last.empty()) {
    return Error{Errc::timeout,
                 fmt::format("{}: the tracker answers but sends no records; is its transmitter connected{}?",
                             line_->name(), info_.latched_error.empty() ? "" : " (" + info_.latched_error + ")")};
  }
  return Error{Errc::bad_format,
               fmt::format("{}: the tracker's records are not as set: {} bytes instead of {} ({}); switch "
                           "it off and on",
                           line_->name(), last.size(), wanted, shown(last))};
}

Result<void> MiniBird::stream() {
  line_->discard_input();
  line_errors_ = line_->line_errors();
  return dialogue_.send({kStream});
}

Result<std::optional<Chunk>> MiniBird::read(Deadline deadline) {
  std::array<std::uint8_t, 4096> bytes;
  const auto got = line_->read(bytes, deadline);
  if (!got) return got.error();
  const std::uint64_t errors = line_->line_errors();
  if (*got == 0) return std::optional<Chunk>();
  Chunk chunk;
  chunk.arrived = device_now();
  chunk.bytes.assign(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(*got));
  chunk.after_line_error = std::exchange(line_errors_, errors) != errors;
  chunk.after_restart = std::exchange(restarted_, false);
  return std::optional<Chunk>(std::move(chunk));
}

Result<Diagnosis> MiniBird::diagnose(const std::stop_token& stop) {
  dialogue_.obey(stop);
  auto diagnosis = look_for_trouble();
  if (diagnosis && !diagnosis->needs_start) {
    if (auto woken = wake(); !woken) diagnosis = woken.error();
  }
  dialogue_.obey({});
  return diagnosis;
}

Result<Diagnosis> MiniBird::look_for_trouble() {
  if (auto quiet = dialogue_.hush(); !quiet) return quiet.error();
  Diagnosis diagnosis;
  for (std::size_t i = 0; i < info_.units.size(); ++i) {
    const auto reply = dialogue_.ask(kStatus, address_of(i));
    if (!reply) return reply.error();
    const StatusWord status = decode_status_word(static_cast<std::uint16_t>((*reply)[0] + 256U * (*reply)[1]));
    const auto errors = read_errors(dialogue_, address_of(i));
    if (!errors) return errors.error();
    std::string words = words_of(status);
    append(words, words_of(*errors));
    if (status.format_code != static_cast<std::uint8_t>(format_of(settings_, i))) {
      diagnosis.needs_start = true;
      append(words, "it has lost its settings: was it switched off?");
    }
    for (const UnitError& error : *errors) {
      diagnosis.errors.push_back(error);
      if (is_fatal(error.code)) diagnosis.needs_start = true;
    }
    append(diagnosis.words, settings_.birds > 1 ? fmt::format("bird {}: {}", i + 1, words) : words);
  }
  for (const Setting& setting : settings_of_port(settings_, info_.units.front())) {
    if (!setting.parameter) continue;
    const auto reply = dialogue_.ask_if_known(*setting.parameter);
    if (!reply) return reply.error();
    if (!*reply || **reply == setting.value) continue;
    diagnosis.needs_start = true;
    append(diagnosis.words, fmt::format("it has lost its {}", setting.name));
  }
  return diagnosis;
}

Result<void> MiniBird::wake() {
  if (auto done = run(); !done) return done;
  restarted_ = true;
  return stream();
}

}  // namespace birdseye::drivers::minibird
