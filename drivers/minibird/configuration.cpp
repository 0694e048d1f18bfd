#include "drivers/minibird/configuration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/base/units.hpp"

namespace birdseye::drivers::minibird {

namespace {

std::uint16_t word_of(const Bytes& bytes) {
  return static_cast<std::uint16_t>(bytes[0] + 256U * bytes[1]);
}

Bytes value_of(const Bytes& change_command) {
  return {change_command.begin() + 2, change_command.end()};
}

/// The bytes of a q or r command, for the parameter that does the same and can be read back.
Bytes angles_as_parameter(std::uint8_t parameter, const AnglesDeg& angles) {
  const Bytes command = angle_align_deg(angles.azimuth, angles.elevation, angles.roll);
  return change(parameter, std::span(command).subspan(1));
}

template <typename Scaled, typename Table>
Bytes table_command(std::uint8_t parameter, const Table& table, Scaled scaled) {
  Bytes value;
  for (const auto entry : table) {
    const auto word = static_cast<std::uint16_t>(scaled(entry));
    value.push_back(static_cast<std::uint8_t>(word & 0xFFU));
    value.push_back(static_cast<std::uint8_t>(word >> 8U));
  }
  return change(parameter, value);
}

/// Collects the settings of one unit; knows what its firmware can be asked.
class List {
 public:
  List(const UnitInfo& info, const MiniBirdSettings& settings, std::size_t index, std::vector<std::string>& notes)
      : info_(info),
        unit_(settings.birds > 1 ? static_cast<std::uint8_t>(index + 1) : std::uint8_t{0}),
        of_(settings.birds > 1 ? fmt::format(" of bird {}", index + 1) : ""),
        notes_(notes) {}

  /// A CHANGE VALUE whose parameter can be read.
  void change_of(const char* name, const Bytes& command, bool as_after_reset) {
    list.push_back({name + of_, unit_, command, command[1], value_of(command), as_after_reset});
  }
  void command(const char* name, const Bytes& bytes, std::optional<std::uint8_t> parameter, Bytes value) {
    list.push_back({name + of_, unit_, bytes, parameter, std::move(value), false});
  }
  void angles(const char* name, std::uint8_t parameter, const std::optional<AnglesDeg>& wanted, Bytes old_command) {
    if (info_.since(3, 67)) {
      change_of(name, angles_as_parameter(parameter, wanted.value_or(AnglesDeg{})), !wanted);
    } else {
      list.push_back({name + of_, unit_, std::move(old_command), std::nullopt, {}, !wanted});
    }
  }
  bool knows(const char* name, int major, int minor, bool wanted) {
    const bool known = info_.since(major, minor);
    if (!known && wanted) {
      notes_.push_back(fmt::format("{}{}: not in firmware {}.{}, left as it is", name, of_, info_.revision_major,
                                   info_.revision_minor));
    }
    return known;
  }

  std::vector<Setting> list;

 private:
  const UnitInfo& info_;
  std::uint8_t unit_;
  std::string of_;
  std::vector<std::string>& notes_;
};

void add_filters(List& to, const MiniBirdSettings& settings) {
  const FilterSettings filters = settings.filters.value_or(FilterSettings{});
  // One is off.
  const unsigned off =
      (filters.dc_adaptive ? 0U : 1U) | (filters.ac_wide_notch ? 0U : 2U) | (filters.ac_narrow_notch ? 0U : 4U);
  to.change_of("filters", change_word(kFilters, static_cast<std::uint16_t>(off)), !settings.filters);
  if (!settings.filters) to.list.back().command.clear();  // left as the unit has them, but not as another set them
  const auto as_fraction = [](double value) { return std::clamp(std::trunc(value * 32768), 0.0, 32767.0); };
  // The least gain first where it falls, else the most: min must stay below max all the while. From the defaults of
  // 0.02 and 0.9, raising the most first does that for every pair.
  if (filters.dc_alpha_max) {
    to.change_of("most gain of the DC filter", table_command(kAlphaMax, *filters.dc_alpha_max, as_fraction), false);
  }
  if (filters.dc_alpha_min) {
    to.change_of("least gain of the DC filter", table_command(kAlphaMin, *filters.dc_alpha_min, as_fraction), false);
  }
  if (filters.dc_vm) {
    to.change_of("Vm table of the DC filter", table_command(kVmTable, *filters.dc_vm, [](int v) { return v; }), false);
  }
}

}  // namespace

std::vector<Setting> settings_of_unit(const MiniBirdSettings& settings, const UnitInfo& info, std::size_t index,
                                      std::vector<std::string>& notes) {
  List to(info, settings, index, notes);
  const BirdSettings own = index < settings.per_bird.size() ? settings.per_bird[index] : BirdSettings{};
  to.command("record format", select_format(format_of(settings, index)), std::nullopt, {});
  const Bytes side = select_hemisphere(hemisphere_of(settings, index));
  to.command("hemisphere", side, info.since(3, 67) ? std::optional<std::uint8_t>(kHemisphere) : std::nullopt,
             {side[1], side[2]});
  to.change_of("position scale", change_word(kScale, settings.wide_scale ? 1 : 0), !settings.wide_scale);
  add_filters(to, settings);
  if (settings.sudden_change_lock) {
    to.change_of("sudden-change lock",
                 change(kSuddenChangeLock, Bytes{static_cast<std::uint8_t>(*settings.sudden_change_lock ? 1 : 0)}),
                 !*settings.sudden_change_lock);
  }
  if (to.knows("line frequency", 3, 67, settings.line_frequency_hz.has_value())) {
    const int hertz = settings.line_frequency_hz.value_or(60);
    to.change_of("line frequency", change(kLineFrequency, Bytes{static_cast<std::uint8_t>(hertz)}), hertz == 60);
  }
  const AnglesDeg align = own.angle_align.value_or(AnglesDeg{});
  to.angles("angle align", kAngleAlign, own.angle_align, angle_align_deg(align.azimuth, align.elevation, align.roll));
  const AnglesDeg frame = settings.reference_frame.value_or(AnglesDeg{});
  to.angles("reference frame", kReferenceFrame, settings.reference_frame,
            reference_frame_deg(frame.azimuth, frame.elevation, frame.roll));
  const bool turns = settings.reference_frame && settings.reference_frame_turns_position;
  if (to.knows("reference frame for positions", 3, 45, turns)) {
    to.change_of("reference frame for positions",
                 change(kFrameTurnsPosition, Bytes{static_cast<std::uint8_t>(turns ? 1 : 0)}), !turns);
  }
  if (settings.button_byte) to.command("button mode", {'M', 1}, std::nullopt, {});
  return std::move(to.list);
}

std::vector<Setting> settings_of_port(const MiniBirdSettings& settings, const UnitInfo& master) {
  std::vector<Setting> list;
  list.push_back({"data-ready character", 0, change(kDataReady, Bytes{0}), kDataReady, {0}, true});
  list.push_back({"report rate", 0, report_rate_command(settings.report_every), std::nullopt, {}, false});
  if (settings.birds > 1 || master.since(3, 33)) {
    const Bytes command = set_group_mode(settings.birds > 1);
    list.push_back({"group mode", 0, command,
                    master.since(3, 33) ? std::optional<std::uint8_t>(kGroupMode) : std::nullopt, value_of(command),
                    settings.birds == 1});
  }
  return list;
}

Result<void> apply(Dialogue& dialogue, const std::vector<Setting>& list, bool was_reset) {
  for (const Setting& setting : list) {
    if (setting.command.empty() || (was_reset && setting.as_after_reset)) continue;
    for (int tries = 0;; ++tries) {
      if (auto sent = dialogue.send(setting.command, setting.unit); !sent) return sent;
      if (!setting.parameter) break;
      const auto reply = dialogue.ask_if_known(*setting.parameter, setting.unit);
      if (!reply) return reply.error();
      if (!*reply || **reply == setting.value) break;  // what it does not tell it may have taken all the same
      if (tries > 0) {
        return Error{Errc::bad_value, fmt::format("{}: the tracker does not take the {}: it says {} to {}",
                                                  dialogue.name(), setting.name, shown(**reply), shown(setting.value))};
      }
    }
  }
  return {};
}

Result<std::string> first_difference(Dialogue& dialogue, const std::vector<Setting>& list) {
  for (const Setting& setting : list) {
    if (!setting.parameter) {
      // Said again, for it cannot be asked; of a thing left alone nobody knows.
      if (setting.as_after_reset) return setting.name;
      if (auto sent = dialogue.send(setting.command, setting.unit); !sent) return sent.error();
      continue;
    }
    const auto reply = dialogue.ask_if_known(*setting.parameter, setting.unit);
    if (!reply) return reply.error();
    if (!*reply || **reply != setting.value) return setting.name;
  }
  return std::string();
}

Result<double> settle_rate(Dialogue& dialogue, const MiniBirdSettings& settings, const UnitInfo& master,
                           bool only_look) {
  // Firmware after 3.63 takes the rate itself; older firmware a count of its crystal.
  const auto by = [&](bool rate) -> Result<std::optional<double>> {
    const Bytes command = rate ? set_rate_hz(settings.rate_hz) : set_rate_count(settings.rate_hz, master.crystal_mhz);
    if (!only_look) {
      if (auto sent = dialogue.send(command); !sent) return sent.error();
    }
    const auto reply = dialogue.ask_if_known(command[1]);
    if (!reply) return reply.error();
    if (!*reply) return std::optional<double>();
    const std::uint16_t word = word_of(**reply);
    return std::optional<double>(rate ? word / 256.0 : rate_of_count(word, master.crystal_mhz));
  };
  Result<std::optional<double>> rate = std::optional<double>();
  if (master.since(3, 64)) rate = by(true);
  if (!rate) return rate.error();
  if (!*rate) rate = by(false);
  if (!rate) return rate.error();
  if (!*rate) {
    return Error{Errc::timeout, fmt::format("{}: the tracker does not tell its measurement rate", dialogue.name())};
  }
  if (!only_look && !(std::abs(**rate - settings.rate_hz) <= 0.05 * settings.rate_hz)) {
    return Error{Errc::bad_value, fmt::format("{}: the tracker measures at {:.1f} Hz and will not at {:.1f}; set "
                                              "[tracker] rate_hz to what it does",
                                              dialogue.name(), **rate, settings.rate_hz)};
  }
  return **rate;
}

Result<double> mm_per_count_of(Dialogue& dialogue, std::uint8_t unit) {
  const auto scale = dialogue.ask(kScale, unit);
  if (!scale) return scale.error();
  return word_of(*scale) == 0 ? kMmPerCount36Inch : kMmPerCount72Inch;
}

StreamLayout layout_of(const MiniBirdSettings& settings, const std::vector<UnitInfo>& units, double rate_hz) {
  StreamLayout layout;
  layout.birds.clear();
  const AnglesDeg frame = settings.reference_frame.value_or(AnglesDeg{});
  const Eigen::Matrix3d transmitter_from_frame =
      rotation_from_angles(frame.azimuth * kRadPerDeg, frame.elevation * kRadPerDeg, frame.roll * kRadPerDeg);
  for (std::size_t i = 0; i < units.size(); ++i) {
    BirdLayout bird{format_of(settings, i), units[i].mm_per_count, into(hemisphere_of(settings, i))};
    // The half-space is the transmitter's own; positions are told along other axes where the unit turns them.
    if (settings.reference_frame_turns_position && units[i].since(3, 45)) {
      bird.into_hemisphere = transmitter_from_frame.transpose() * bird.into_hemisphere;
    }
    layout.birds.push_back(bird);
  }
  layout.group_mode = settings.birds > 1;
  layout.button_byte = settings.button_byte;
  layout.rate_hz = rate_hz / settings.report_every;
  layout.baud = settings.baud;
  layout.delay = settings.delay;
  layout.plausibility = settings.plausibility;
  return layout;
}

}  // namespace birdseye::drivers::minibird
