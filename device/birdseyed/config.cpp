#include "device/birdseyed/config.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <optional>
#include <set>
#include <toml.hpp>

#include "drivers/io/serial_port.hpp"

namespace birdseye::device {

namespace {

/// One section of the file. Every key that is read is noted, so that what is left over can be named.
class Section {
 public:
  Section(const std::filesystem::path& file, std::string name, const toml::table& table)
      : file_(file), name_(std::move(name)), table_(table) {}

  void text(const char* key, std::string& value, bool required = false) {
    if (const toml::value* found = find(key, required)) {
      if (found->is_string()) {
        value = found->as_string().str;
      } else {
        fail(key, "needs text in quotes");
      }
    }
  }
  void number(const char* key, double& value, double low, double high) {
    if (const toml::value* found = find(key, false)) {
      if (found->is_floating() || found->is_integer()) {
        value = found->is_floating() ? found->as_floating() : static_cast<double>(found->as_integer());
        if (!(value >= low && value <= high))
          fail(key, fmt::format("{:g} is not within {:g} and {:g}", value, low, high));
      } else {
        fail(key, "needs a number");
      }
    }
  }
  void integer(const char* key, int& value, int low, int high) {
    if (const toml::value* found = find(key, false)) {
      if (!found->is_integer()) {
        fail(key, "needs a whole number");
      } else if (found->as_integer() < low || found->as_integer() > high) {
        fail(key, fmt::format("{} is not within {} and {}", found->as_integer(), low, high));
      } else {
        value = static_cast<int>(found->as_integer());
      }
    }
  }
  void milliseconds(const char* key, Duration& value, double high_ms) {
    double ms = value.seconds() * 1e3;
    number(key, ms, 0, high_ms);
    value = Duration::from_seconds(ms * 1e-3);
  }
  void texts(const char* key, std::vector<std::string>& values) {
    if (const toml::value* found = find(key, false)) {
      if (!found->is_array()) return fail(key, "needs a list of names");
      values.clear();
      for (const toml::value& item : found->as_array()) {
        if (!item.is_string()) return fail(key, "needs a list of names");
        values.push_back(item.as_string().str);
      }
    }
  }
  void fail(const char* key, const std::string& why) {
    if (!error_) error_ = Error{Errc::bad_value, fmt::format("{}: [{}] {}: {}", file_.string(), name_, key, why)};
  }
  /// The first thing that was wrong, or a key that nobody asked for.
  std::optional<Error> finish() {
    for (const auto& [key, value] : table_) {
      if (!error_ && known_.count(key) == 0) {
        error_ = Error{Errc::bad_value, fmt::format("{}: [{}] {}: unknown key; known are {}", file_.string(), name_,
                                                    key, fmt::join(known_, ", "))};
      }
    }
    return error_;
  }

 private:
  const toml::value* find(const char* key, bool required) {
    known_.insert(key);
    const auto found = table_.find(key);
    if (found != table_.end()) return &found->second;
    if (required) fail(key, "is missing");
    return nullptr;
  }

  const std::filesystem::path& file_;
  std::string name_;
  const toml::table& table_;
  std::set<std::string> known_;
  std::optional<Error> error_;
};

void read_tracker(Section& section, Config& config) {
  std::string device, record = "position_matrix", hemisphere = "forward";
  section.text("device", device, true);
  section.integer("baud", config.tracker.baud, 2400, 115200);
  if (!drivers::is_serial_speed(config.tracker.baud)) {
    section.fail("baud", fmt::format("{} is none of {}", config.tracker.baud, drivers::kSerialSpeeds));
  }
  section.integer("birds", config.tracker.birds, 1, 14);
  section.texts("names", config.bird_names);
  section.number("rate_hz", config.tracker.rate_hz, 14, 144);
  section.text("hemisphere", hemisphere);
  section.text("record", record);
  section.milliseconds("delay_ms", config.tracker.delay, 1000);
  config.tracker_device = device;
  if (const auto format = drivers::minibird::record_format_of(record);
      format && drivers::minibird::has_position(*format) && drivers::minibird::has_orientation(*format)) {
    config.tracker.format = *format;
  } else {
    section.fail("record",
                 fmt::format("\"{}\" is none of position_angles, position_matrix, position_quaternion", record));
  }
  if (const auto side = drivers::minibird::hemisphere_of(hemisphere)) {
    config.tracker.hemisphere = *side;
  } else {
    section.fail("hemisphere", fmt::format("\"{}\" is none of forward, aft, right, left, lower, upper", hemisphere));
  }
  if (config.bird_names.empty()) {
    config.bird_names = {"scope"};
    for (int i = 2; i <= config.tracker.birds; ++i) config.bird_names.push_back(fmt::format("bird{}", i));
  }
  if (static_cast<int>(config.bird_names.size()) != config.tracker.birds) {
    section.fail("names", fmt::format("{} names for {} birds", config.bird_names.size(), config.tracker.birds));
  }
  // What the line can carry: ten bits a byte, and a byte for the address in a flock.
  const auto bytes = static_cast<double>(2 * drivers::minibird::word_count(config.tracker.format) +
                                         (config.tracker.birds > 1 ? 1 : 0)) *
                     config.tracker.birds;
  if (bytes * 10 * config.tracker.rate_hz > config.tracker.baud) {
    section.fail("rate_hz", fmt::format("{:g} Hz of {} birds does not fit into {} baud", config.tracker.rate_hz,
                                        config.tracker.birds, config.tracker.baud));
  }
}

void read_camera(Section& section, Config& config) {
  section.text("source", config.camera.source, true);
  config.camera.width_px = 768;
  config.camera.height_px = 576;
  config.camera.rate_hz = 25;
  section.integer("width", config.camera.width_px, 16, 8192);
  section.integer("height", config.camera.height_px, 16, 8192);
  section.number("rate_hz", config.camera.rate_hz, 1, 1000);
  if (std::int64_t{config.camera.width_px} * config.camera.height_px > drivers::kMostPixels) {
    section.fail("width", "over 16 megapixels a frame, more than the wire carries");
  }
}

void read_wire(Section& section, Config& config) {
  section.text("bind", config.bind);
  section.integer("port", config.port, 0, 65535);
}

void read_pose(Section& section, Config& config) {
  section.milliseconds("max_age_ms", config.pose.max_prediction, 1000);
  section.milliseconds("max_gap_ms", config.pose.max_gap, 1000);
  section.milliseconds("smoothing_ms", config.pose.smoothing, 1000);
}

}  // namespace

Result<Config> read_config(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    return Error{Errc::not_found, fmt::format("{}: no such configuration file", path.string())};
  }
  try {
    const toml::value root = toml::parse(path.string());
    Config config;
    constexpr std::pair<const char*, void (*)(Section&, Config&)> kSections[] = {
        {"tracker", read_tracker}, {"camera", read_camera}, {"wire", read_wire}, {"pose", read_pose}};
    for (const auto& [name, value] : root.as_table()) {
      const bool known = std::any_of(std::begin(kSections), std::end(kSections),
                                     [&key = name](const auto& section) { return key == section.first; });
      if (!known || !value.is_table()) {
        return Error{
            Errc::bad_value,
            fmt::format("{}: {}: unknown section; known are [tracker], [camera], [wire], [pose]", path.string(), name)};
      }
    }
    const toml::table none;
    for (const auto& [name, read] : kSections) {
      const auto found = root.as_table().find(name);
      Section section(path, name, found == root.as_table().end() ? none : found->second.as_table());
      read(section, config);
      if (auto error = section.finish()) return *std::move(error);
    }
    return config;
  } catch (const std::exception& problem) {
    // The first line of toml11's message says what; the rest draws the place.
    const std::string what = problem.what();
    return Error{Errc::bad_format, fmt::format("{}: is not TOML: {}", path.string(), what.substr(0, what.find('\n')))};
  }
}

}  // namespace birdseye::device
