#pragma once

#include <Eigen/Core>
#include <vector>

#include "hw-sim/phantom/mesh.hpp"

namespace birdseye::hw_sim {

/// The way of a pointer's tip that strokes a surface: along lines to and fro over the part that faces the hand, lifted
/// from the end of each line to the beginning of the next. Patient frame, mm.
class StrokePath {
 public:
  /// Goes nowhere.
  StrokePath() = default;
  /// towards_hand: of unit length. park_mm: where the tip is before and after. Of a surface of which no part faces the
  /// hand nothing is stroked.
  static StrokePath over(const Mesh& surface, const Eigen::Vector3d& towards_hand, const Eigen::Vector3d& park_mm);

  /// 0: nothing is stroked.
  [[nodiscard]] double lasts_s() const { return stops_.empty() ? 0 : stops_.back().at_s; }
  [[nodiscard]] Eigen::Vector3d tip_in_patient_mm(double since_s) const;
  [[nodiscard]] bool on_surface(double since_s) const;

 private:
  /// Where the tip is at a time; between two stops it goes straight, at one pace.
  struct Stop {
    double at_s = 0;
    Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();
    bool stroked_to = false;  ///< along the surface
  };
  void go_to(const Eigen::Vector3d& tip_mm, double pace_mm_s, bool along_surface = false);
  [[nodiscard]] std::size_t stop_after(double since_s) const;

  std::vector<Stop> stops_;
};

}  // namespace birdseye::hw_sim
