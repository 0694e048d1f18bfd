#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/faults/fault.hpp"

namespace birdseye::hw_sim {

/// What befalls the operation and no instrument: what moves, and how far, at any world time. Several of a kind add up;
/// of hollows there is one, the first of the script that holds.
class Happenings {
 public:
  Happenings() = default;
  /// faults: those of a script that are the world's.
  explicit Happenings(std::vector<Fault> faults);

  /// What every pose of the tracker is multiplied with from the left: the transmitter was bumped.
  [[nodiscard]] Transform<Tracker, Tracker> transmitter(double world_s) const;
  /// The table's tilt about the patient's long axis, in the patient frame at rest. pivot_mm: a point of the axis.
  [[nodiscard]] Transform<Patient, Patient> table(double world_s, const Eigen::Vector3d& pivot_mm) const;
  /// The patient's way on the table, about a point that he lies on.
  [[nodiscard]] Transform<Patient, Patient> patient(double world_s, const Eigen::Vector3d& pivot_mm) const;
  /// The reference bird's way against what it was fixed on, in its own frame.
  [[nodiscard]] Transform<Sensor, Sensor> reference(double world_s) const;
  /// How far the breath has moved the organ, patient frame.
  [[nodiscard]] Eigen::Vector3d breath_mm(double world_s) const;
  /// What was cut out. face_mm, outward, right: of the place that the scope looks at.
  [[nodiscard]] std::optional<Hollow> hollow(double world_s, const Eigen::Vector3d& face_mm,
                                             const Eigen::Vector3d& outward, const Eigen::Vector3d& right) const;
  /// How often as large as usual the picture is.
  [[nodiscard]] double zoom(double world_s) const;
  /// The camera's turn about the scope's axis against the bird.
  [[nodiscard]] Transform<Camera, Camera> scope(double world_s) const;

 private:
  /// An hour has hundreds, and each place of each bird asks all of them.
  struct Timed {
    Fault fault;
    double over_s = 0;
  };
  [[nodiscard]] static double share(const Timed& timed, double world_s);
  template <typename Visit>
  void each(FaultKind kind, double world_s, const Visit& visit) const;

  std::vector<Timed> faults_;
};

}  // namespace birdseye::hw_sim
