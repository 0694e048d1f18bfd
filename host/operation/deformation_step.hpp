#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/verdict.hpp"
#include "drivers/system/background.hpp"
#include "host/operation/findings.hpp"
#include "host/operation/live_step.hpp"
#include "host/operation/patient.hpp"
#include "host/operation/view_step.hpp"
#include "host/registration/geometry/organ_at_rest.hpp"
#include "host/registration/geometry/seen_point.hpp"
#include "host/registration/views/view_registration.hpp"
#include "host/render/scene/transfer_function.hpp"

namespace birdseye::host {

/// Matches the CT with views. The thread that does it has copies of all it is given, and shares what is never changed.
class DeformationStep {
 public:
  /// Why begin() would refuse so many views, in words; empty: it would not.
  static std::string why_too_few(std::size_t views, bool touched);
  /// touches: places of the organ's surface as it lies now, patient mm, whose neighbours err alike. camera_covariance:
  /// empty, how well the lens is known does not count in what is to be expected.
  void begin(std::span<const KeptView> views, const CameraModel& camera, std::shared_ptr<const PatientPlan> patient,
             std::shared_ptr<const TransferFunction> transfer, std::vector<SeenPoint> touches = {},
             const std::optional<CameraMatrix>& camera_covariance = std::nullopt);
  void cancel() { matching_.cancel(); }
  /// True: another deformation was found.
  bool tick();
  void undo();
  /// What is being found, if anything is, is of an organ that lies otherwise by now.
  void drop(const std::string& why);
  /// What was found, or is being found, is by a setup that is no more. True: there was a deformation.
  bool forget();
  /// An earlier window's.
  void take_up(std::shared_ptr<const DeformedOrgan> kept, const std::string& line);

  /// Null: the CT is shown as it was taken.
  [[nodiscard]] const std::shared_ptr<const DeformedOrgan>& found() const { return found_; }
  /// The corrected poses of the views by which found() was found, in the order in which they were kept; empty: the
  /// tracker's poses were not corrected.
  [[nodiscard]] const std::vector<Transform<Camera, Patient>>& adjusted() const { return adjusted_; }
  /// Of the CT that was matched last; null: none was.
  [[nodiscard]] const std::shared_ptr<const OrganAtRest>& organ() const { return made_.organ; }
  [[nodiscard]] bool running() const { return matching_.running(); }
  /// How far it is, in words; empty before it has found anything.
  [[nodiscard]] std::string progress() const { return matching_.line(); }
  [[nodiscard]] const StepNote& note() const { return note_; }
  /// What was found is to be used with care: the note says why.
  [[nodiscard]] bool with_care() const { return found_ && !found_->care.empty(); }

 private:
  /// What the thread found, and whether it may be believed.
  struct Matched {
    ViewRegistration found;
    Verdict verdict;
    std::shared_ptr<const OrganAtRest> organ;
  };

  /// The organ, and what it was made of.
  struct Made {
    std::weak_ptr<const PatientPlan> patient;
    std::weak_ptr<const TransferFunction> transfer;
    std::shared_ptr<const OrganAtRest> organ;  ///< null: it is not made yet
  };

  Made made_;
  std::shared_ptr<const DeformedOrgan> found_;
  std::vector<Transform<Camera, Patient>> adjusted_;
  std::optional<Eigen::Vector3d> target_at_rest_mm_;  ///< that the matching is judged by
  StepNote note_, former_note_;                       ///< former_note_: before the matching began
  bool dropped_ = false;                              ///< what is being found is by a setup that is no more
  Background<Result<Matched>> matching_;
};

}  // namespace birdseye::host
