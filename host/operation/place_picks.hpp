#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "calibration/base/result.hpp"
#include "drivers/system/background.hpp"
#include "host/operation/patient.hpp"
#include "host/volume/marker_fit.hpp"

namespace birdseye::host {

/// Places of the CT that a person points at, to be a fiducial or a landmark: the marker there is looked for on a thread
/// of its own, so that a rough pick is refined.
class PlacePicks {
 public:
  enum class Kind { fiducial, landmark };
  struct Picked {
    Kind kind = Kind::fiducial;
    std::shared_ptr<const PatientPlan> patient;
    Eigen::Vector3d pointed_mm;          ///< patient frame
    Result<MarkerFit> marker = Error{};  ///< why there is none
  };

  /// One at a time; the one before is dropped.
  void pick(Kind kind, std::shared_ptr<const PatientPlan> patient, const Eigen::Vector3d& place_in_patient_mm);
  [[nodiscard]] bool looking() const { return looking_.running(); }
  /// What came of it, once.
  std::optional<Picked> tick() { return looking_.take(); }

 private:
  Background<Picked> looking_;
};

}  // namespace birdseye::host
