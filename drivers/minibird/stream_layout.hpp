#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/time/clock.hpp"
#include "drivers/minibird/protocol.hpp"

namespace birdseye::drivers::minibird {

/// Limits of what a sensor in somebody's hand can do. A reading beyond them has no pose, only words.
struct Plausibility {
  double most_speed_mm_s = 2000;
  double most_turn_deg_s = 1000;
  double most_acceleration_mm_s2 = 20'000;  ///< against the line through the last readings
  double slack_mm = 4, slack_deg = 5;       ///< on top of these, for noise
  int step_confirms = 5;                    ///< so many agreeing readings in a row after a step confirm it
  int start_confirms = 1;                   ///< the same at the start and after a gap
  Duration gap = Duration::from_ms(150);    ///< after so long without a good reading the sensor may be anywhere
  /// Noise keeps records from repeating exactly. Where there was noise, a reading is frozen after so many equal
  /// records. 0: never.
  int frozen_after = 100;
  /// The same where the noise was plain, of frozen_noise_counts and more from one record to the next: then a record
  /// hardly ever repeats.
  int frozen_after_plain_noise = 8;
  double frozen_noise_counts = 4;
  double frozen_moved_mm = 2;        ///< frozen at once, where the speed until then would have moved the sensor so far
  double hemisphere_border_mm = 15;  ///< so near the plane through the transmitter, p and -p are not told apart
  /// After a flip and a gap of at most this, the sensor is still taken to be where it was.
  Duration flip_memory = Duration::from_ms(2000);
};

/// One bird's records.
struct BirdLayout {
  RecordFormat format = RecordFormat::position_matrix;
  double mm_per_count = kMmPerCount36Inch;
  /// Unit vector from the transmitter into the half-space that positions are told in, along the axes of the positions.
  Eigen::Vector3d into_hemisphere = Eigen::Vector3d::UnitX();
};

/// How the bytes of a stream are to be read: plain data, all that MeasurementAssembler needs, recorded together with
/// the bytes.
struct StreamLayout {
  std::vector<BirdLayout> birds = {BirdLayout{}};  ///< by address, 1 first
  bool group_mode = false;                         ///< each record ends with its bird's address
  bool button_byte = false;                        ///< and before that, with its buttons
  double rate_hz = 103.3;                          ///< of what is sent
  int baud = 115200;
  Duration delay;  ///< from the middle of a measurement to its first byte on the line
  Plausibility plausibility;
};

/// Bytes on the line for one measurement of all birds.
std::size_t record_bytes(const StreamLayout& layout, std::size_t bird);
std::size_t cycle_bytes(const StreamLayout& layout);

/// Bytes as they came off the line at one time.
struct Chunk {
  std::vector<std::uint8_t> bytes;
  DeviceTime arrived;             ///< of its last byte
  bool after_line_error = false;  ///< bytes before these came damaged and were dropped
  bool after_restart = false;     ///< the stream was stopped before these, and begun again
};

}  // namespace birdseye::drivers::minibird
