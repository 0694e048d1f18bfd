#pragma once

#include <deque>

#include "hw-sim/ftdi/instrument.hpp"
#include "hw-sim/minibird/unit.hpp"

namespace birdseye::hw_sim {

/// A miniBIRD whose first bird goes round a circle, once in two seconds.
class TrackerOnLine : public SerialInstrument {
 public:
  struct Settings {
    UnitSettings unit;
    Duration delay = Duration::from_seconds(7.5e-3);  ///< from a measurement to the first byte of its record
    Duration boot = Duration::from_ms(500);           ///< silence after power-up and reset
  };
  TrackerOnLine(const Settings& settings, DeviceTime zero);

  void receive(std::span<const std::uint8_t> bytes, DeviceTime now) override;
  std::vector<std::uint8_t> send(DeviceTime now) override;
  void set_reset(bool held, DeviceTime now) override;
  [[nodiscard]] DeviceTime next_send() const override { return measured_ + settings_.delay; }

 private:
  [[nodiscard]] std::vector<BirdPose> poses(DeviceTime time) const;

  Settings settings_;
  Unit unit_;
  DeviceTime zero_, measured_, ready_;
  bool held_ = false;
  std::vector<std::uint8_t> reply_;
};

}  // namespace birdseye::hw_sim
