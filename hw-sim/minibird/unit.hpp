#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hw-sim/minibird/parameter_table.hpp"
#include "hw-sim/minibird/record_encoder.hpp"

namespace birdseye::hw_sim {

/// Settings that cannot be changed over the wire.
struct UnitSettings {
  int birds = 1;  ///< for more than 14 the constructor takes another addressing mode
  double rate_hz = 103.3;
  std::string model = "6DFOB     ";  ///< ten characters
  std::uint8_t revision_major = 3, revision_minor = 67;
  std::uint8_t crystal_mhz = 40;
};

/// What can be wrong with a measurement without the unit noticing.
struct Disturbance {
  bool mirrored = false;        ///< the solution on the other side of the transmitter
  bool no_orientation = false;  ///< all words of the orientation are zero
};

/// The electronics of one miniBIRD or of a flock of them behind one serial port: bytes in, bytes out, no clock and no
/// port of its own. Unknown commands, and parameters that the firmware's revision does not know, latch error 6 and are
/// not answered; a command to a unit that is not on the bus latches error 13.
class Unit {
 public:
  explicit Unit(const UnitSettings& settings);

  /// As after power-up or a pulse on RTS: every setting is lost.
  void reset();
  /// Takes one byte from the host; returns the reply that it provokes at once, often none.
  std::vector<std::uint8_t> receive(std::uint8_t byte);
  /// Ends a measurement cycle with these poses (tracker_from_sensor), one per bird. Returns the records that the unit
  /// sends, and the data-ready character.
  std::vector<std::uint8_t> measure(std::span<const BirdPose> poses);

  /// Sets an error of the first bird as its own checks would.
  void latch_error(std::uint8_t code, std::uint8_t detail = 0) { latch(birds_.front(), code, detail); }
  /// Sets what is wrong with the next records.
  void disturb(const Disturbance& disturbance) { disturbance_ = disturbance; }
  /// Sets the level code of a bird's mouse buttons: 0x00, 0x10, 0x30 or 0x70.
  void press(std::size_t bird, std::uint8_t button) { birds_.at(bird).button = button; }

  [[nodiscard]] int birds() const { return static_cast<int>(birds_.size()); }
  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  [[nodiscard]] bool streaming() const { return streaming_; }
  [[nodiscard]] bool asleep() const { return asleep_; }
  /// How often the host examined a parameter while records were streaming, which the manual forbids.
  [[nodiscard]] int violations() const { return violations_; }

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct LatchedError {
    std::uint8_t code, detail;
  };
  struct FlockBird {
    OutputFormat format = OutputFormat::position_angles;
    bool button_mode = false;
    std::uint8_t button = 0;
    Eigen::Matrix3d align = Eigen::Matrix3d::Identity(), reference = Eigen::Matrix3d::Identity();
    std::deque<LatchedError> errors;
    std::map<std::uint8_t, Bytes> values;  ///< parameters that can be set, by number
  };

  // unit.cpp: commands and records
  bool take_prefix(std::uint8_t byte);
  void address(std::size_t number);
  void execute(Bytes& reply);
  void execute_with_data(Bytes& reply);
  void next_master(std::size_t number);
  void next_transmitter(std::uint8_t data);
  [[nodiscard]] bool running(std::size_t bird) const { return bird == 0 || bird < configured_; }
  [[nodiscard]] Bytes record(std::size_t bird, const BirdPose& pose) const;
  // unit_parameters.cpp: EXAMINE and CHANGE
  void latch(FlockBird& bird, std::uint8_t code, std::uint8_t detail = 0);
  [[nodiscard]] unsigned revision() const { return 256U * settings_.revision_major + settings_.revision_minor; }
  [[nodiscard]] Addressing addressing() const;
  [[nodiscard]] std::size_t most_units() const;
  [[nodiscard]] std::uint16_t status_word() const;
  [[nodiscard]] Bytes system_status(std::size_t length) const;
  [[nodiscard]] Bytes auto_configuration(std::size_t length) const;
  [[nodiscard]] Bytes take_error(std::size_t length);
  void examine(std::uint8_t parameter, Bytes& reply);
  void change(std::uint8_t parameter, std::span<const std::uint8_t> value);
  void auto_configure(std::size_t units);

  UnitSettings settings_;
  std::vector<FlockBird> birds_;
  Disturbance disturbance_;
  double rate_hz_ = 0;
  bool group_mode_ = false, streaming_ = false, asleep_ = false, suspended_ = false;
  std::size_t configured_ = 0;  ///< how many units AUTO-CONFIG found
  std::size_t master_ = 0;
  std::uint8_t sync_mode_ = 0;
  int points_due_ = 0;
  std::size_t addressed_ = 0;           ///< the bird that the command in hand is for
  std::optional<std::uint8_t> absent_;  ///< or the address at which there is none
  std::size_t point_bird_ = 0;
  unsigned report_every_ = 1;
  unsigned cycle_ = 0;
  int violations_ = 0;
  Bytes command_;  ///< the command being received
  std::size_t command_length_ = 0;
  bool long_prefix_ = false;
  Bytes held_;  ///< replies that XOFF holds back
};

}  // namespace birdseye::hw_sim
