#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace birdseye::hw_sim {

/// Every fault that a script can name. Some are a tracker's, some a camera's, some either's
/// (docs/manual/simulated-minibird.md); then those that befall the operation itself, and its programs
/// (docs/manual/simulator.md).
enum class FaultKind {
  drop_byte,
  duplicate_byte,
  corrupt_byte,
  wrong_phase_bit,
  line_noise,
  stuck_stream,
  frozen_pose,
  saturated,
  zero_matrix,
  hemisphere_flip,
  metal_distortion,
  power_cycle,
  drift_step,
  lost_record,
  unplug,
  clock_step,
  drop_frames,
  sequence_gap,
  silence,
  late_frames,
  duplicate_frames,
  garbage,
  size_change,
  torn_frame,
  transmitter_bumped,
  bed_tilted,
  patient_moved,
  reference_moved,
  breathing,
  resected,
  lens_zoomed,
  scope_turned,
  link_cut,
  appliance_restart,
  window_restart,
  scope_exchanged,
  link_late,
  window_stalls,
  disk_late,
  disk_full,
  power_cut,
  appliance_power_cut,
  appliance_disk_late,
  appliance_disk_full,
};

std::string_view fault_name(FaultKind kind);

enum class FaultTarget { tracker, camera, world, program };

inline constexpr FaultTarget kFaultTargets[] = {FaultTarget::tracker, FaultTarget::camera, FaultTarget::world,
                                                FaultTarget::program};

/// The name that the enumerator has.
std::string_view target_name(FaultTarget target);

/// One fault of a script. values: all parameters that the kind has, given or by default.
struct Fault {
  FaultKind kind = FaultKind::drop_byte;
  double at_s = 0;              ///< after the start of streaming
  std::optional<double> for_s;  ///< empty: once, or from then on, as the kind says
  std::map<std::string, double, std::less<>> values;
  [[nodiscard]] double value(std::string_view name) const;
};

/// A fault has begun or ended.
struct FaultEvent {
  FaultKind kind;
  FaultTarget target;
  bool begin;
  std::int64_t at_ns;  ///< on the clock of whoever drives the timeline
};

/// Which faults of a script hold at a time. Steps forward only.
class FaultTimeline {
 public:
  FaultTimeline() = default;
  FaultTimeline(std::vector<Fault> faults, FaultTarget target);

  /// Sets the script's second 0. Nothing begins before that; later calls change nothing.
  void begin(std::int64_t zero_ns);
  [[nodiscard]] bool begun() const { return zero_ns_.has_value(); }
  void advance(std::int64_t now_ns);
  /// The fault of this kind that holds now; the first in the script where several hold; null where none does.
  [[nodiscard]] const Fault* active(FaultKind kind) const;
  /// Tells that a fault which happens once has happened.
  void done(FaultKind kind, std::int64_t now_ns);
  /// When a fault begins or ends next.
  [[nodiscard]] std::optional<std::int64_t> next_change_ns() const;
  /// Begins and ends since the last call, in their order.
  std::vector<FaultEvent> take_events();

 private:
  enum class State { waiting, active, over };
  struct Entry {
    Fault fault;
    State state = State::waiting;
  };
  [[nodiscard]] std::int64_t begins_ns(const Fault& fault) const;
  [[nodiscard]] std::optional<std::int64_t> ends_ns(const Fault& fault) const;

  std::vector<Entry> entries_;  ///< as they begin
  // Those before ended_ are over, those from begun_ on wait: an hour has hundreds, and many ask at each measurement.
  std::size_t ended_ = 0, begun_ = 0;
  FaultTarget target_ = FaultTarget::tracker;
  std::optional<std::int64_t> zero_ns_;
  std::vector<FaultEvent> events_;
};

}  // namespace birdseye::hw_sim
