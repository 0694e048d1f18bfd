#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "host/operation/findings.hpp"
#include "host/operation/live_step.hpp"
#include "host/operation/step_states.hpp"
#include "host/registration/rigid/touch_detector.hpp"

namespace birdseye::host {

/// The registration of the patient by fiducials that the pointer touches.
class FiducialStep {
 public:
  /// One more; false: all that are wanted are touched (wanted 0: as many as come). fit() is due then.
  bool add(const Touch& touch, std::size_t wanted);
  /// The last is taken back; false: there is none.
  bool undo();
  /// By the markers of the CT, empty as long as they are looked for. Three give a fit, one more, and as many as are
  /// wanted, make it done.
  void fit(const std::optional<std::vector<Eigen::Vector3d>>& markers_in_patient_mm, std::size_t wanted);
  /// An earlier window's registration, which counts for nothing before confirm(): patient or transmitter may have been
  /// moved meanwhile. Not where fiducials were touched anew; false then. Touches too few for a fit are dropped.
  bool take_up(const std::optional<RegisteredPatient>& kept, const std::string& when);
  /// Somebody has looked, and the registration holds.
  void confirm() { confirmed_ = true; }

  [[nodiscard]] const std::vector<TouchedFiducial>& touches() const { return touches_; }
  [[nodiscard]] const std::optional<RegisteredPatient>& registered() const { return registered_; }
  [[nodiscard]] bool confirmed() const { return confirmed_; }
  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] const StepNote& note() const { return note_; }

 private:
  std::vector<TouchedFiducial> touches_;
  std::optional<RegisteredPatient> registered_;
  bool confirmed_ = true;
  std::string fault_;
  StepNote note_;
};

}  // namespace birdseye::host
