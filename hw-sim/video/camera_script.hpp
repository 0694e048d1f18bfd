#pragma once

#include <cstdint>
#include <vector>

#include "hw-sim/faults/fault.hpp"

namespace birdseye::hw_sim {

struct CameraTiming {
  double rate_hz = 60;
  double drift_ppm = 0;     ///< by which the camera's clock runs fast
  double delivery_ms = 12;  ///< from mid-exposure to the first byte
  double exposure_ms = 0;   ///< of a row; nothing leaves before it has ended
  double jitter_ms = 0;     ///< mean of the further lateness: exponential, cut at 4 times the mean
  bool stamps = true;       ///< otherwise frames come without a time of acquisition
  std::uint64_t seed = 1;
  std::vector<Fault> faults;
};

/// One frame on its way.
struct FramePlan {
  std::uint64_t number = 0;     ///< of the exposure, from 0
  std::uint64_t sequence = 0;   ///< as the camera counts
  std::int64_t exposed_ns = 0;  ///< true middle of the exposure
  std::int64_t stamp_ns = 0;    ///< the stamp that the camera gives; 0 where it gives none
  std::int64_t sigma_ns = 0;
  std::int64_t due_ns = 0;  ///< when its first byte leaves
  bool lost = false;        ///< it never leaves
  bool half_size = false;   ///< it has half its width and height
  int copies = 1;
  double part = 1;                  ///< of its bytes that leave
  std::uint64_t garbage_bytes = 0;  ///< that leave before it
};

/// A camera that keeps time but has no pixels and reads no clock: frame n is exposed at zero + n / rate of the camera's
/// own clock. Everything random follows from the seed.
class CameraScript {
 public:
  CameraScript(const CameraTiming& timing, std::int64_t zero_ns);

  /// The next exposure. Frames leave in their order.
  FramePlan next();
  /// Tells that somebody is watching. The first call sets the faults' second 0; faults touch frames exposed from then
  /// on.
  void watched(std::int64_t now_ns);
  /// Follows the plug up to this time. Faults of frames go by the time of their exposure instead.
  void advance(std::int64_t now_ns) { plug_.advance(now_ns); }
  /// Frames a second as they truly come, drift included.
  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  /// False while a fault keeps the camera unplugged.
  [[nodiscard]] bool plugged() const { return plug_.active(FaultKind::unplug) == nullptr; }
  std::vector<FaultEvent> take_events();

 private:
  [[nodiscard]] bool hits(FaultKind kind, std::int64_t now_ns);
  void apply_faults(FramePlan& plan);

  CameraTiming timing_;
  std::int64_t zero_ns_;
  double rate_hz_;
  std::uint64_t number_ = 0, skipped_in_count_ = 0;
  std::int64_t latest_due_ns_ = 0;
  FaultTimeline faults_, plug_;
};

}  // namespace birdseye::hw_sim
