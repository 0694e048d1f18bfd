#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "calibration/time/clock.hpp"

namespace birdseye {

/// Pairs a camera's frames with the edges of its strobe line (start of exposure, stamped by the kernel): an edge knows
/// when, a frame knows what. The delivery delay is unknown but stable, and is learnt from frames that only one delay
/// fits. Where strobe and frames are both regular, delays that differ by whole periods all fit. Then the bounds on the
/// delay must leave one only, or exposures that were left out, or a stream's beginning, must tell which; until then no
/// frame is paired. Once frames and edges have been counted differently, the bounds are no longer believed either.
class StrobeMatcher {
 public:
  struct Settings {
    Duration period;  ///< of frames, nominal
    Duration exposure;
    /// From the start of exposure to the frame's stamp. Negative where stamps may lie before it.
    Duration least_delay{0};
    Duration most_delay = Duration::from_ms(150);
    Duration edge_sigma{20'000};  ///< kernel stamps of edges
    std::size_t learn_from = 12;  ///< pairs that must agree on the delay
  };
  struct Match {
    std::optional<DeviceTime> acquired;  ///< the middle of the exposure; empty where no edge is surely this frame's
    Duration sigma;
    std::string reason;  ///< why there is none, in words
  };

  explicit StrobeMatcher(const Settings& settings) : settings_(settings) {}

  /// In order of time. Edges too close to the last to be a frame's (half a period) are spurious.
  void push_edge(DeviceTime edge);
  /// A frame by its own stamp or arrival. Edges up to then must have been pushed. `number`: the camera's count; gaps in
  /// it are frames lost.
  Match match(DeviceTime stamp, std::int64_t number);

  /// The delay that was learnt; empty while it is ambiguous.
  [[nodiscard]] std::optional<Duration> delay() const;
  [[nodiscard]] std::uint64_t spurious_edges() const { return spurious_; }

 private:
  struct Edge {
    DeviceTime at;
    bool doubtful = false;  ///< another came too close to it
  };
  struct NumberedFrame {
    DeviceTime stamp;
    std::int64_t number = 0;
  };
  struct Pair {
    DeviceTime edge;
    std::int64_t number = 0;
  };
  struct Before {
    Pair last;
    double delay_ns = 0;
  };
  void learn();
  [[nodiscard]] bool is_as_before(double delay_ns) const;
  [[nodiscard]] bool is_clear_beyond_bounds(double delay_ns, int its_contradictions) const;
  [[nodiscard]] std::optional<double> phase_ns() const;
  [[nodiscard]] int contradictions(double delay_ns) const;
  [[nodiscard]] const Edge* nearest(DeviceTime time) const;
  void forget();

  Settings settings_;
  std::deque<Edge> edges_;
  std::deque<NumberedFrame> frames_;
  std::optional<double> delay_ns_;
  std::optional<Pair> last_;
  std::optional<Before> before_;  ///< what was known when the delay was lost
  std::string ambiguity_ = "the delivery delay is not known yet";
  int misses_ = 0;
  std::uint64_t spurious_ = 0;
};

}  // namespace birdseye
