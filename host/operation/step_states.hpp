#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "device/wire/messages.hpp"

/// How single steps stand, for whoever shows them: values alone, which tell nothing of how a step works.
namespace birdseye::host {

/// What is connected.
struct LinkState {
  bool connected = false;
  bool may_retry = false;       ///< it was given up, and can be tried again
  std::string words;            ///< to what, or why not
  std::string appliance_says;   ///< what is amiss, as the appliance has it
  std::string appliance_notes;  ///< what it says where nothing is: a plain wire, a map that nobody known signed
  std::optional<wire::Health> health;
};

/// What a fit's FRE, and a touch's residual, are up to where the touches fit well, and where one is plainly off.
inline constexpr double kGoodFit_mm = 2, kPlainlyOff_mm = 5;

/// A fiducial that was touched.
struct TouchedFiducial {
  Eigen::Vector3d tip_in_tracker_mm;
  double rms_mm = 0;  ///< of the tip while it rested
  std::optional<double> residual_mm;
};

/// What the pointer's tip is near to, in the CT as it is shown.
struct CheckReading {
  Eigen::Vector3d tip_in_patient_mm;
  std::string nearest;                                   ///< landmark or fiducial; empty: there is none
  Eigen::Vector3d nearest_mm = Eigen::Vector3d::Zero();  ///< in the CT, patient frame
  double distance_mm = 0;
  bool fitted = false;  ///< it is a fiducial that the registration was fitted to, which says nothing of it
};

/// A landmark that was not fitted, and how far from it the pointer was when a person said that it fits.
struct CheckedLandmark {
  std::string name;
  double off_mm = 0;
};

}  // namespace birdseye::host
