#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hw-sim/minibird/record_encoder.hpp"

namespace birdseye::hw_sim {

/// What cannot be set over the wire.
struct UnitSettings {
  int birds = 1;
  double rate_hz = 103.3;
  std::string model = "6DFOB     ";  ///< ten characters
  std::uint8_t revision_major = 3, revision_minor = 67;
  std::uint8_t crystal_mhz = 40;
};

/// The electronics of one miniBIRD or of a flock of them behind one serial port: bytes in, bytes out, no clock and no
/// port of its own. Unknown commands latch error 6 and are not answered.
class Unit {
 public:
  explicit Unit(const UnitSettings& settings);

  /// As after power-up or a pulse on RTS: every setting is lost.
  void reset();
  /// One byte from the host; the reply it provokes at once, often none.
  std::vector<std::uint8_t> receive(std::uint8_t byte);
  /// The measurement cycle has ended with these true poses (tracker_from_sensor), one per bird; the records it sends.
  std::vector<std::uint8_t> measure(std::span<const BirdPose> poses);

  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  [[nodiscard]] bool streaming() const { return streaming_; }

 private:
  struct Bird {
    OutputFormat format = OutputFormat::position_angles;
    std::array<std::uint8_t, 2> hemisphere{0, 0};
    bool wide_scale = false;
    bool button_mode = false;
    std::uint8_t error = 0;
  };

  void execute(std::vector<std::uint8_t>& reply);
  void examine(std::uint8_t parameter, std::vector<std::uint8_t>& reply);
  void change(std::uint8_t parameter, std::span<const std::uint8_t> value);
  [[nodiscard]] std::uint16_t status_word() const;
  std::vector<std::uint8_t> record(std::size_t bird, const BirdPose& pose) const;

  UnitSettings settings_;
  std::vector<Bird> birds_;
  double rate_hz_ = 0;
  bool group_mode_ = false, configured_ = false, streaming_ = false, asleep_ = false, suspended_ = false;
  int points_due_ = 0;
  std::size_t addressed_ = 0;  ///< the bird that the command in hand is for
  std::size_t point_bird_ = 0;
  unsigned report_every_ = 1;
  unsigned cycle_ = 0;
  std::array<std::uint8_t, 256> parameters_{};  ///< one-byte parameters that are only stored
  std::array<std::uint8_t, 2> filters_{4, 0};
  std::vector<std::uint8_t> command_;  ///< the command being received
  std::size_t command_length_ = 0;
  bool long_prefix_ = false;
};

}  // namespace birdseye::hw_sim
