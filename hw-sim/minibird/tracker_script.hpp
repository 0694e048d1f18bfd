#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "hw-sim/faults/fault.hpp"
#include "hw-sim/minibird/field_distortion.hpp"
#include "hw-sim/minibird/unit.hpp"

namespace birdseye::hw_sim {

struct BirdNoise {
  double position_mm = 0;  ///< standard deviation per axis and record
  double angle_deg = 0;    ///< likewise, about each axis
};

/// The true pose of a bird (0 is the first) at an instant of the caller's clock.
using BirdMotion = std::function<BirdPose(std::size_t bird, std::int64_t at_ns)>;

struct TrackerSettings {
  UnitSettings unit;
  BirdNoise noise;
  double distortion_mm = 0;  ///< the largest displacement by the room's metal
  double delay_ms = 7.5;     ///< from measurement to the first byte
  double jitter_ms = 0;      ///< mean of the lateness of delivery: exponential, cut at 4 times the mean
  double drift_ppm = 0;      ///< by which the unit's clock runs fast
  double boot_ms = 0;        ///< of silence after power-up and reset
  int baud = 115200;
  std::uint64_t seed = 1;
  std::vector<Fault> faults;
  bool faults_from_streaming = true;  ///< otherwise from align()
};

/// Bytes for the host, and when the last of them arrives.
struct Delivery {
  std::int64_t due_ns = 0;
  std::vector<std::uint8_t> bytes;
  bool line_error = false;  ///< among them are some that a UART would have marked as damaged
};

/// A miniBIRD, or a flock of them, at the end of a serial line. It keeps time but reads no clock: the caller tells the
/// time at every call, in ns of any clock, never going back. Everything random follows from the seed.
///
///   TrackerScript tracker(settings, motion, now);
///   loop: tracker.receive(bytes from the host, now);
///         for (const Delivery& d : tracker.advance(now)) hand over d.bytes;
///         wait for bytes from the host, at most until tracker.next_ns();
///
/// The unit measures once per cycle, at absolute times of its own clock. The records take the line's time at the baud
/// rate and are late by the jitter. Bytes never overtake each other.
class TrackerScript {
 public:
  TrackerScript(const TrackerSettings& settings, BirdMotion motion, std::int64_t start_ns);

  void receive(std::span<const std::uint8_t> bytes, std::int64_t now_ns);
  /// Sets RTS, where the transport carries it. Asserted, it holds the unit in reset; when it is released, the unit
  /// boots, and every setting is lost.
  void set_reset(bool asserted, std::int64_t now_ns);
  /// Deliveries due by now, in order.
  std::vector<Delivery> advance(std::int64_t now_ns);
  /// When advance() has something to do next, unless the host sends.
  [[nodiscard]] std::int64_t next_ns() const;

  /// Shifts the cycle so that a measurement falls on zero_ns, which becomes number 0, and faults count from it.
  void align(std::int64_t zero_ns) { align_ns_ = zero_ns; }
  [[nodiscard]] bool streaming() const { return unit_.streaming(); }
  /// Measurements a second as they truly come, drift included.
  [[nodiscard]] double rate_hz() const;
  /// False while a fault keeps the line unplugged: the transport must vanish meanwhile.
  [[nodiscard]] bool plugged() const { return faults_.active(FaultKind::unplug) == nullptr; }
  std::vector<FaultEvent> take_events() { return faults_.take_events(); }
  [[nodiscard]] const Unit& unit() const { return unit_; }

 private:
  [[nodiscard]] std::int64_t next_measurement_ns() const;
  void rebase(std::int64_t measured_ns);
  void measure(std::int64_t measured_ns);
  void apply_power(std::int64_t now_ns);
  [[nodiscard]] bool silent(std::int64_t now_ns) const;
  [[nodiscard]] std::vector<BirdPose> measured_poses(std::int64_t measured_ns);
  void disturb_bytes(Delivery& delivery, std::int64_t now_ns);
  void enqueue(Delivery delivery);

  TrackerSettings settings_;
  BirdMotion motion_;
  Unit unit_;
  std::optional<FieldDistortion> room_;
  FaultTimeline faults_;
  std::optional<FieldDistortion> metal_;  ///< that a fault has brought near
  std::vector<BirdPose> frozen_;

  std::int64_t base_ns_ = 0;     ///< the instant of a measurement,
  std::int64_t since_base_ = 0;  ///< and how many there were since
  double period_ns_ = 0;
  std::int64_t cycle_ = -1'000'000;  ///< number of the latest measurement, which noise and jitter follow from
  std::optional<std::int64_t> align_ns_;
  std::int64_t boots_until_ns_ = 0;
  std::int64_t wire_free_ns_ = 0;
  bool held_in_reset_ = false, powered_ = true, was_saturated_ = false;
  std::deque<Delivery> pending_;
};

}  // namespace birdseye::hw_sim
