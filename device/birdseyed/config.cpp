#include "device/birdseyed/config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "calibration/record/calibration_record.hpp"
#include "calibration/record/field_map_file.hpp"
#include "calibration/record/record_words.hpp"
#include "device/birdseyed/config_checks.hpp"
#include "device/birdseyed/config_section.hpp"
#include "device/birdseyed/wire_admission.hpp"
#include "device/wire/igtl_bytes.hpp"
#include "device/wire/tcp_link.hpp"
#include "drivers/identity/identity_folder.hpp"
#include "drivers/identity/this_machine.hpp"
#include "drivers/io/serial_port.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye::device {

namespace {

using drivers::minibird::AnglesDeg;
using drivers::minibird::Hemisphere;
using drivers::minibird::RecordFormat;

std::optional<RecordFormat> read_record(ConfigSection& section) {
  std::string record;
  section.text("record", record);
  if (record.empty()) return std::nullopt;
  const auto format = drivers::minibird::record_format_of(record);
  if (format && drivers::minibird::has_position(*format) && drivers::minibird::has_orientation(*format)) return format;
  section.fail("record",
               fmt::format("\"{}\" is none of position_angles, position_matrix, position_quaternion", record));
  return std::nullopt;
}

std::optional<Hemisphere> read_hemisphere(ConfigSection& section) {
  std::string hemisphere;
  section.text("hemisphere", hemisphere);
  if (hemisphere.empty()) return std::nullopt;
  const auto side = drivers::minibird::hemisphere_of(hemisphere);
  if (!side)
    section.fail("hemisphere", fmt::format("\"{}\" is none of forward, aft, right, left, lower, upper", hemisphere));
  return side;
}

std::optional<AnglesDeg> read_angles(ConfigSection& section, const char* key) {
  const auto values = section.numbers(key, 3, -180, 180);
  if (values.empty()) return std::nullopt;
  return AnglesDeg{values[0], values[1], values[2]};
}

void read_filters(ConfigSection& section, drivers::minibird::MiniBirdSettings& unit) {
  drivers::minibird::FilterSettings filters;
  const bool any = section.has("filter_dc") || section.has("filter_ac_wide") || section.has("filter_ac_narrow");
  section.flag("filter_dc", filters.dc_adaptive);
  section.flag("filter_ac_wide", filters.ac_wide_notch);
  section.flag("filter_ac_narrow", filters.ac_narrow_notch);
  if (any) unit.filters = filters;
  section.integer("line_frequency_hz", unit.line_frequency_hz, 50, 60);
}

void read_plausibility(ConfigSection& section, drivers::minibird::Plausibility& limits) {
  section.number("most_speed_mm_s", limits.most_speed_mm_s, 10, 100'000);
  section.number("most_turn_deg_s", limits.most_turn_deg_s, 10, 100'000);
  section.integer("frozen_after", limits.frozen_after, 0, 100'000);
  section.number("hemisphere_border_mm", limits.hemisphere_border_mm, 0, 500);
}

void read_birds(ConfigSection& section, Config& config) {
  auto& unit = config.tracker.minibird;
  for (ConfigSection& bird : section.tables("bird")) {
    drivers::minibird::BirdSettings settings;
    settings.format = read_record(bird);
    settings.hemisphere = read_hemisphere(bird);
    settings.angle_align = read_angles(bird, "angle_align_deg");
    bird.finish();
    unit.per_bird.push_back(settings);
  }
  std::vector<std::string>& names = config.core.bird_names;
  names.clear();
  section.texts("names", names);
  if (names.empty()) {
    names = {"scope"};
    for (int i = 2; i <= unit.birds; ++i) names.push_back(fmt::format("bird{}", i));
  }
  if (!section.failed("birds") && static_cast<int>(names.size()) != unit.birds)
    section.fail("names", fmt::format("{} names for {} birds", names.size(), unit.birds));
  std::string& reference = config.tracker.reference;
  section.text("reference", reference);
  if (!reference.empty() &&
      (names.empty() || reference == names.front() || std::find(names.begin(), names.end(), reference) == names.end()))
    section.fail("reference", fmt::format("\"{}\" is none of the names of birds after the scope's", reference));
  if (const std::string fault = fault_of_bird_names(names); !fault.empty()) section.fail("names", fault);
}

void read_tracker(ConfigSection& section, Config& config) {
  auto& unit = config.tracker.minibird;
  section.text("device", config.tracker.line.device, true);
  section.integer("baud", unit.baud, 2400, 115200);
  config.tracker.line.baud = unit.baud;
  section.integer("usb_latency_ms", config.tracker.line.usb_latency_ms, 1, 255);
  if (const std::string fault = fault_of_socket(config.tracker.line.device, "unix:"); !fault.empty())
    section.fail("device", fault);
  if (section.has("device") && config.tracker.line.device.empty())
    section.fail("device", "is empty; give the tracker's line, as /dev/ttyUSB0");
  if (!config.tracker.line.device.empty()) {
    if (const auto sound = drivers::check_line(config.tracker.line); !sound)
      section.fail(drivers::is_serial_speed(unit.baud) ? "device" : "baud", sound.error().what);
  }
  section.integer("birds", unit.birds, 1, 14);
  section.number("rate_hz", unit.rate_hz, 14, 144);
  section.integer("report_every", unit.report_every, 1, 32);
  section.flag("wide_scale", unit.wide_scale);
  unit.format = read_record(section).value_or(unit.format);
  unit.hemisphere = read_hemisphere(section).value_or(unit.hemisphere);
  section.milliseconds("delay_ms", unit.delay, 1000);
  unit.reference_frame = read_angles(section, "reference_frame_deg");
  section.flag("reference_frame_turns_position", unit.reference_frame_turns_position);
  section.flag("warm_restart", unit.warm_restart);
  read_filters(section, unit);
  read_plausibility(section, unit.plausibility);
  read_birds(section, config);
  for (const std::string& fault : drivers::minibird::faults_of(unit)) section.fail("", fault);
}

void read_camera(ConfigSection& section, Config& config) {
  drivers::CameraSettings& camera = config.camera;
  camera.width_px = 768;
  camera.height_px = 576;
  camera.rate_hz = 25;
  section.text("source", camera.source, true);
  section.integer("width", camera.width_px, 16, 8192);
  section.integer("height", camera.height_px, 16, 8192);
  section.number("rate_hz", camera.rate_hz, 1, 1000);
  section.text("format", camera.format);
  section.number("exposure_us", camera.exposure_us, 1, 1e6);
  section.integer("gain", camera.gain, -100'000, 100'000);
  section.integer("white_balance_k", camera.white_balance_k, 1000, 20'000);
  section.milliseconds("readout_ms", camera.readout, 1000);
  section.milliseconds("delay_ms", config.core.frame_clock.delay, 1000);
  section.milliseconds("exposure_ms", config.core.frame_clock.exposure, 1000);
  config.core.frame_clock.rate_hz = camera.rate_hz;
  if (const std::string fault = fault_of_socket(camera.source, "socket:"); !fault.empty())
    section.fail("source", fault);
  for (const std::string& fault : drivers::faults_of(camera)) {
    if (!section.has("source") && fault.starts_with("source: ")) continue;  // that it is missing was said above
    section.fail("", fault);
  }
  if (std::int64_t{camera.width_px} * camera.height_px > drivers::kMostPixels)
    section.fail("width", "over 16 megapixels a frame, more than the wire carries");
}

void read_bias(ConfigSection& section, const char* key, drivers::GpioBias& bias) {
  std::string text;
  section.text(key, text);
  if (text.empty()) return;
  const std::pair<const char*, drivers::GpioBias> kinds[] = {{"as_is", drivers::GpioBias::as_is},
                                                             {"pull_up", drivers::GpioBias::pull_up},
                                                             {"pull_down", drivers::GpioBias::pull_down}};
  for (const auto& [name, kind] : kinds) {
    if (text == name) {
      bias = kind;
      return;
    }
  }
  section.fail(key, fmt::format("\"{}\" is none of as_is, pull_up, pull_down", text));
}

void read_gpio(ConfigSection& section, Config& config) {
  drivers::GpioSettings& lines = config.gpio.lines;
  section.text("chip", lines.chip, section.present());
  section.text("strobe", lines.strobe);
  config.core.frame_clock.strobe = !lines.strobe.empty();
  section.text("pedal", lines.pedal);
  section.text("led", lines.led);
  section.text("trigger", lines.trigger);
  std::map<std::string, const char*> users;
  for (const auto& [key, line] : {std::pair("strobe", lines.strobe), std::pair("pedal", lines.pedal),
                                  std::pair("led", lines.led), std::pair("trigger", lines.trigger)}) {
    if (line.empty()) continue;
    const auto [first, is_new] = users.try_emplace(line, key);
    if (!is_new) section.fail(key, fmt::format("\"{}\" is the line of {} too; give another", line, first->second));
  }
  read_bias(section, "strobe_bias", lines.strobe_bias);
  read_bias(section, "pedal_bias", lines.pedal_bias);
  section.milliseconds("pedal_debounce_ms", lines.pedal_debounce, 1000);
  section.flag("strobe_active_low", lines.strobe_active_low);
  section.flag("pedal_active_low", lines.pedal_active_low);
  section.flag("led_active_low", lines.led_active_low);
  section.flag("trigger_active_low", lines.trigger_active_low);
  section.number("trigger_rate_hz", config.gpio.trigger_rate_hz, 0, 240);
  if (config.gpio.trigger_rate_hz > 0 && lines.trigger.empty())
    section.fail("trigger_rate_hz", "needs the line that is pulsed: trigger");
}

void read_wire(ConfigSection& section, Config& config) {
  section.text("bind", config.wire.bind);
  section.integer("port", config.wire.port, 0, 65535);
  if (const std::string fault = wire::fault_of_bind(config.wire.bind); !fault.empty()) section.fail("bind", fault);
  section.flag("allow_plain", config.wire.allow_plain);
  config.core.notice = plain_notice(config.wire);
  section.flag("transforms", config.core.transforms);
  std::set<std::string> devices;
  for (const std::string& bird : std::set(config.core.bird_names.begin(), config.core.bird_names.end())) {
    if (!config.core.transforms || devices.insert(wire::transform_device(bird)).second) continue;
    section.fail("transforms", fmt::format("two birds' TRANSFORMs would both be called {}: give the birds names that "
                                           "differ in their first {} bytes, or set transforms = false",
                                           wire::transform_device(bird), wire::kMostTransformNameBytes));
  }
}

void read_pose(ConfigSection& section, Config& config) {
  PoseHistory::Settings& pose = config.core.pose;
  section.milliseconds("max_age_ms", pose.max_prediction, 1000);
  section.milliseconds("max_gap_ms", pose.max_gap, 1000);
  section.milliseconds("smoothing_ms", pose.smoothing, 1000);
  section.milliseconds("wait_ms", config.core.pose_wait, 1000);
  section.milliseconds("max_time_sigma_ms", pose.max_time_sigma, 1000);
}

void read_recording(ConfigSection& section, Config& config) {
  std::string folder;
  section.text("folder", folder, section.present());
  config.record.folder = folder;
  if (const std::string fault = fault_of_folder(folder); !fault.empty()) section.fail("folder", fault);
  section.flag("frames", config.record.frames);
  section.number("most_gb", config.record.most_gb, 0.001, 100'000);
}

constexpr std::size_t kMostFieldBytes = 4U << 20U;
constexpr std::size_t kMostRecordBytes = 60'000;  // one message of the wire carries it

std::string why_unread(const std::string& path, const Error& error) {
  if (error.code != Errc::not_found && error.code != Errc::unreadable) return error.what;
  return path + ": cannot be read; see whether it is there, its owner and mode";
}

/// A file of [calibration] that a machine signs.
struct SignedFile {
  const std::string& path;
  const char* what;   ///< "record"
  const char* again;  ///< how to get one that is signed
  const char* kind;
  const std::string& sha256;
  const std::optional<calibration::FileSignature>& signature;
};

/// That nobody known has signed a file.
struct Unsigned {
  std::string who;      ///< "not signed: nobody says who wrote it"; empty: somebody known has
  std::string refusal;  ///< with the file's name and the remedy
};

/// An error: the file is not as it was signed. Whoever is not known stops no appliance: video needs no such file.
Result<Unsigned> unsigned_by(const SignedFile& file) {
  const std::string& path = file.path;
  const auto folder = identity_folder();
  auto opened = folder ? ThisMachine::open(*folder) : Result<ThisMachine>(folder.error());
  const std::string why_closed = opened ? "" : opened.error().what;
  // Whether a file is as it was signed can be told without knowing anybody.
  const ThisMachine machine = opened ? *std::move(opened) : ThisMachine::for_once();
  const auto author = machine.author_of(file.kind, file.sha256, file.signature);
  if (!author) return author.error();
  if (why_closed.empty() && author->standing == Author::Standing::known) return Unsigned();
  Unsigned out{why_closed.empty() ? author->words() : "of an author who cannot be told: " + why_closed, {}};
  out.refusal = fmt::format("{}: the {} is {}; {}, or use it all the same by [calibration] accept_unsigned = true",
                            path, file.what, out.who, file.again);
  if (why_closed.empty() && author->standing == Author::Standing::unknown) {
    out.refusal += fmt::format("; to know that machine, add the line \"NAME {}\" to {} and reload birdseyed",
                               author->key.hex(), (*folder / "known").string());
  }
  return out;
}

void read_field_map(const std::string& path, bool accept_unsigned, ConfigSection& section, Config& config) {
  const auto text = read_whole_file(path, kMostFieldBytes);
  if (!text) return section.fail("field", why_unread(path, text.error()));
  auto read = calibration::parse_field_map(*text);
  if (!read) return section.fail("field", read.error().with_context(path).what);
  auto unknown = unsigned_by({path, "map of the field", "make one that is signed by birdseye calibrate field",
                              calibration::kFieldMapFormat, read->sha256, read->signature});
  if (!unknown) return section.fail("field", unknown.error().with_context(path).what);
  CoreSettings& core = config.core;
  core.field = std::move(read->map);
  core.field_of = std::move(read->notes.tracker);
  if (unknown->who.empty()) return;
  if (!accept_unsigned) {
    core.field_refused = std::move(unknown->refusal);
    return;
  }
  core.notice += fmt::format("{}UNSIGNED: the map of the field is {}", core.notice.empty() ? "" : "; ", unknown->who);
  core.field_unsigned = std::move(unknown->who);
}

/// A latency was measured with the delay of its day, and by another it would be taken off twice, or not whole.
std::string delay_refusal(const std::string& path, const calibration::LatencyEntry& latency,
                          const std::optional<Duration>& delay) {
  constexpr double kSame_ms = 0.05;  // people write one decimal
  if (!latency.camera_delay_ms) return {};
  // Where it is not set half a period is taken off, which is another time than 0.
  if (delay && std::abs(*latency.camera_delay_ms - delay->seconds() * 1e3) <= kSame_ms) return {};
  return fmt::format(
      "{}: {} [camera] delay_ms = {:g}, which is {} now; set it back, or measure again by birdseye calibrate latency "
      "--record",
      path, calibration::kOfAnotherDelay, *latency.camera_delay_ms,
      delay ? fmt::format("{:g}", delay->seconds() * 1e3) : "not set");
}

/// What the appliance will say once the instruments run.
std::string unbound_words(const std::string& path, const calibration::CalibrationRecord& record) {
  const char* const unknown = record.tracker.empty() ? "tracker" : record.camera.empty() ? "camera" : nullptr;
  return unknown == nullptr ? "" : fmt::format("{}: {}", path, calibration::misfit(unknown, {}, {}));
}

void read_calibration_record(const std::string& path, bool accept_unsigned, ConfigSection& section, Config& config) {
  const auto text = read_whole_file(path, kMostRecordBytes);
  if (!text && text.error().code == Errc::unsupported)
    return section.fail("record", path + ": is no calibration record");
  if (!text) return section.fail("record", why_unread(path, text.error()));
  const auto record = calibration::parse_signed_record(*text);
  if (!record) return section.fail("record", record.error().with_context(path).what);
  auto unknown = unsigned_by({path, "record", "make one that is signed by birdseye calibrate",
                              calibration::kRecordFormat, record->sha256, record->signature});
  if (!unknown) return section.fail("record", unknown.error().with_context(path).what);
  config.core.calibration = *text;
  config.calibration_unbound = unbound_words(path, record->record);
  std::string& refused = config.core.calibration_refused;
  if (!accept_unsigned) refused = std::move(unknown->refusal);
  if (const std::string doubt = calibration::doubt_of(record->record);
      !accept_unsigned && refused.empty() && !doubt.empty()) {
    refused = fmt::format(
        "{}: the record rests on what no known machine signed ({}); calibrate again by what is signed, or use it all "
        "the same by [calibration] accept_unsigned = true",
        path, doubt);
  }
  if (refused.empty() && record->record.latency)
    refused = delay_refusal(path, *record->record.latency, config.core.frame_clock.delay);
}

void read_calibration(ConfigSection& section, Config& config) {
  std::string field, record;
  section.text("field", field);
  section.text("record", record);
  bool accept_unsigned = false;
  section.flag("accept_unsigned", accept_unsigned);
  if (!field.empty()) read_field_map(field, accept_unsigned, section, config);
  if (!record.empty()) read_calibration_record(record, accept_unsigned, section, config);
}

constexpr std::pair<const char*, void (*)(ConfigSection&, Config&)> kSections[] = {{"tracker", read_tracker},
                                                                                   {"camera", read_camera},
                                                                                   {"gpio", read_gpio},
                                                                                   {"wire", read_wire},
                                                                                   {"pose", read_pose},
                                                                                   {"record", read_recording},
                                                                                   {"calibration", read_calibration}};

constexpr std::size_t kMostBytes = 256U << 10U;

Result<std::string> read_text(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: is a folder, not a configuration file", path.string())};
  if (!std::filesystem::exists(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such configuration file", path.string())};
  auto text = read_whole_file(path, kMostBytes);
  if (!text && text.error().code != Errc::unsupported) return text.error();
  if (!text) return Error{Errc::bad_format, fmt::format("{}: is no configuration file of birdseyed", path.string())};
  return *std::move(text);
}

}  // namespace

Result<Config> read_config(const std::filesystem::path& path) {
  auto text = read_text(path);
  if (!text) return text.error();
  const auto file = ConfigFile::parse(*text, path);
  if (!file) return file.error();
  ConfigFaults faults(path);
  FirstFew unknown;
  for (const ConfigFile::Entry& entry : file->entries()) {
    const bool known = std::any_of(std::begin(kSections), std::end(kSections),
                                   [&](const auto& section) { return entry.name == section.first; });
    if ((!known || !entry.is_table) && unknown.takes(entry.line)) {
      faults.add(entry.line,
                 fmt::format("{}: unknown section; known are [tracker], [camera], [gpio], [wire], [pose], [record], "
                             "[calibration]",
                             entry.name));
    }
  }
  if (unknown.others() > 0) faults.add(unknown.line(), fmt::format("and {} more unknown sections", unknown.others()));
  Config config;
  for (const auto& [name, read] : kSections) {
    ConfigSection section = file->section(faults, name);
    read(section, config);
    section.finish();
  }
  if (faults.count() > 0) return Error{Errc::bad_value, faults.text()};
  config.text = *std::move(text);
  return config;
}

}  // namespace birdseye::device
