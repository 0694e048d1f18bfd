#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/time/clock.hpp"
#include "drivers/minibird/protocol.hpp"
#include "drivers/minibird/stream_layout.hpp"

namespace birdseye::drivers::minibird {

struct AnglesDeg {
  double azimuth = 0, elevation = 0, roll = 0;
};

/// Parameter 4 and the tables of the DC filter, one value per band of the distance from the transmitter.
struct FilterSettings {
  bool dc_adaptive = true, ac_wide_notch = true, ac_narrow_notch = false;  ///< narrow: needs line_frequency_hz right
  std::optional<std::array<int, 7>> dc_vm;                                 ///< parameter 12, 0 to 32767
  /// Parameters 5 and 13: the gain at rest and in motion, over 0 and up to 1; min below max in every band.
  std::optional<std::array<double, 7>> dc_alpha_min, dc_alpha_max;
};

/// Settings of one bird that differ from those of all; what is absent is as for all.
struct BirdSettings {
  std::optional<RecordFormat> format;
  std::optional<Hemisphere> hemisphere;
  std::optional<AnglesDeg> angle_align;  ///< what the resting, mis-mounted sensor reads; it will read zero
};

/// All that the driver sets at a unit; the unit forgets everything when it is reset.
struct MiniBirdSettings {
  int birds = 1;  ///< 1: standalone; more: a flock in group mode, addresses from 1 without a hole
  RecordFormat format = RecordFormat::position_matrix;
  Hemisphere hemisphere = Hemisphere::forward;
  std::vector<BirdSettings> per_bird;           ///< by address, the first bird first; may be shorter than birds
  bool wide_scale = false;                      ///< positions up to 72 in instead of 36, in steps twice as coarse
  double rate_hz = 103.3;                       ///< of measurements, 14 to 144
  int report_every = 1;                         ///< 1, 2, 8 or 32: of so many measurements one is sent
  bool button_byte = false;                     ///< a miniBIRD has no buttons, and may take the mode amiss
  std::optional<FilterSettings> filters;        ///< absent: as the unit has them
  std::optional<int> line_frequency_hz;         ///< 50 or 60, for the AC filters; firmware 3.67 and later
  std::optional<AnglesDeg> reference_frame;     ///< turns the axes that orientations are told in
  bool reference_frame_turns_position = false;  ///< and positions too; firmware 3.45 and later
  std::optional<bool> sudden_change_lock;       ///< parameter 14
  int baud = 115200;                            ///< from it follows when a byte began, given when the byte had come
  /// From the middle of a measurement to its first byte on the line, filters off.
  Duration delay = Duration::from_ms(7) + Duration{500'000};
  /// A unit that answers at once and has all settings is not reset, which saves seconds.
  bool warm_restart = true;
  Plausibility plausibility;

  // The waits that field drivers use; tests shorten them.
  Duration reset_hold = Duration::from_ms(1000);
  Duration reset_settle = Duration::from_ms(2000);
  Duration configure_wait = Duration::from_ms(600);
  Duration bus_reset_wait = Duration::from_ms(600);
  Duration run_wait = Duration::from_ms(200);
  Duration reply_timeout = Duration::from_ms(500);
  Duration quiet = Duration::from_ms(90);  ///< without a byte, after which no more is to come; over a cycle at 14 Hz
  Duration answer_within = Duration::from_ms(5000);  ///< for the first answer after a reset
};

/// What is wrong with the settings themselves, in words that name the setting; empty for nothing.
std::vector<std::string> faults_of(const MiniBirdSettings& settings);

/// The format and half-space of the bird at address - 1 = index.
RecordFormat format_of(const MiniBirdSettings& settings, std::size_t index);
Hemisphere hemisphere_of(const MiniBirdSettings& settings, std::size_t index);

}  // namespace birdseye::drivers::minibird
