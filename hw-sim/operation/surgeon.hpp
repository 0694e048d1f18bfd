#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "host/operation/live_workflow.hpp"
#include "hw-sim/operation/operation_truth.hpp"

namespace birdseye::hw_sim {

enum class SurgeonDoes {
  no_views,   ///< of a video that shows nothing
  views_too,  ///< keeps views of the organ and has the CT matched with them
};

/// Who stands at the window: confirms the patient, calibrates the scope over a board or takes its record, touches the
/// fiducials with the pointer, keeps views and deforms, checks a landmark, and looks; moves the scope about where the
/// window asks for it; and again whatever the window asks for again. Knows of the operation what the window shows, and
/// of the patient where the markers are.
class Surgeon {
 public:
  /// truth: of the patient and of the hand, which the surgeon leads.
  Surgeon(OperationTruth& truth, std::uint64_t seed, SurgeonDoes does);

  /// Comes to a window that was just opened.
  void stand_at(host::LiveWorkflow& workflow, double at_s);

  /// Looks at the window, and does what is to be done. Ten times a second is enough.
  void act(double at_s, HostTime now, const host::ShownPicture& shown);
  /// How often Space was pressed in the landmark check, wherever the pointer was.
  [[nodiscard]] std::size_t presses() const { return presses_; }
  /// How often a landmark was checked, the patient registered, and the CT deformed.
  [[nodiscard]] std::size_t checks() const { return checks_; }
  [[nodiscard]] std::size_t registrations() const { return registrations_; }
  [[nodiscard]] std::size_t deformations() const { return deformations_; }

 private:
  void touch(const host::OperationView& view, double at_s);
  void calibrate(const host::OperationView& view, double at_s, HostTime now);
  void keep_view(const host::OperationView& view, double at_s, HostTime now);
  void deform(const host::OperationView& view, HostTime now);
  void read_rod_off();
  void check(const host::OperationView& view, double at_s, HostTime now);
  void press(HostTime now);
  [[nodiscard]] bool points_at_one(double at_s) const;
  void go_to(const Eigen::Vector3d& place_in_patient_mm, double at_s, double rest_s);
  [[nodiscard]] Eigen::Vector3d drawn(double sigma);

  host::LiveWorkflow* workflow_ = nullptr;
  OperationTruth& truth_;
  SurgeonDoes does_;
  std::uint64_t seed_, key_ = 0;
  std::size_t next_fiducial_ = 0, presses_ = 0, checks_ = 0, registrations_ = 0, deformations_ = 0;
  double busy_until_s_ = 0, bare_since_s_ = 0, hurries_until_s_ = 0;
  double guided_since_s_ = 0, views_since_s_ = 0;
  bool at_landmark_ = false, matching_ = false;
};

}  // namespace birdseye::hw_sim
