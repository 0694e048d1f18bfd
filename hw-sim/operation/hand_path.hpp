#pragma once

#include <Eigen/Core>
#include <deque>

namespace birdseye::hw_sim {

/// The way of a pointer in a hand: from place to place, at rest at each, no faster than a hand. Asked for at any time,
/// and led on as somebody decides. Patient frame, times in s.
class HandPath {
 public:
  struct Place {
    Eigen::Vector3d tip_in_patient_mm = Eigen::Vector3d::Zero();
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  ///< patient from pointer
  };

  /// From where the pointer is at that time it goes there, held as it is.
  void go_to(const Eigen::Vector3d& tip_in_patient_mm, double from_s);
  /// The same, turned by a rotation vector (rad) from how it is held then.
  void go_to(const Eigen::Vector3d& tip_in_patient_mm, double from_s, const Eigen::Vector3d& turned_rad);
  /// It is there at once.
  void rest_at(const Eigen::Vector3d& tip_in_patient_mm, double from_s);
  /// From when on it rests.
  [[nodiscard]] double rests_from_s() const { return moves_.empty() ? 0 : moves_.back().until_s; }
  [[nodiscard]] Place at(double at_s) const;

 private:
  struct Move {
    double from_s = 0, until_s = 0;
    Place from, to;
    Eigen::Vector3d turned_rad = Eigen::Vector3d::Zero();  ///< from one to the other
  };
  std::deque<Move> moves_;  ///< the latest few: nobody asks for what was a minute ago
};

}  // namespace birdseye::hw_sim
