#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "host/operation/live_workflow.hpp"
#include "hw-sim/operation/operation_truth.hpp"

namespace birdseye::hw_sim {

/// Who stands at the window: confirms the patient, takes the calibration record, touches the fiducials with the
/// pointer, checks a landmark, and looks; and again whatever the window asks for again. Knows of the operation what the
/// window shows, and of the patient where the markers are.
class Surgeon {
 public:
  /// truth: of the patient and of the hand, which the surgeon leads.
  Surgeon(OperationTruth& truth, std::uint64_t seed);

  /// Comes to a window that was just opened.
  void stand_at(host::LiveWorkflow& workflow, double at_s);

  /// Looks at the window, and does what is to be done. Ten times a second is enough.
  void act(double at_s, HostTime now, bool overlay_is_whole);
  /// How often a landmark was checked, and the patient registered.
  [[nodiscard]] std::size_t checks() const { return checks_; }
  [[nodiscard]] std::size_t registrations() const { return registrations_; }

 private:
  void touch(const host::OperationView& view, double at_s);
  void check(double at_s, HostTime now);
  void go_to(const Eigen::Vector3d& place_in_patient_mm, double at_s, double rest_s);
  [[nodiscard]] Eigen::Vector3d drawn(double sigma);

  host::LiveWorkflow* workflow_ = nullptr;
  OperationTruth& truth_;
  std::uint64_t seed_, key_ = 0;
  std::size_t next_fiducial_ = 0, touches_ = 0, checks_ = 0, registrations_ = 0;
  double busy_until_s_ = 0, bare_since_s_ = 0;
  bool at_landmark_ = false;
};

}  // namespace birdseye::hw_sim
