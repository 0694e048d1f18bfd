#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <vector>

#include "drivers/system/wait.hpp"
#include "host/operation/live_workflow.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"
#include "tests/support/this_machine.hpp"

/// An operation as the live window meets it, without appliance and window: a small patient, and a hand with the
/// pointer.
namespace birdseye::testing {

using host::LiveSettings;
using host::LiveStep;
using host::LiveWorkflow;

inline constexpr std::int64_t kMs = 1'000'000;

inline const std::vector<Eigen::Vector3d> kFiducials{{0, 0, 0}, {60, 5, 0}, {10, 70, 20}, {30, 20, 50}};
inline const Transform<Tracker, Patient> kTrackerFromPatient(
    Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix(), {300, 20, -40});

inline LiveSettings operation_settings(const Scratch& scratch) {
  LiveSettings out;
  out.authors = authors();
  out.patient.ct = ct_of_tissue(scratch);
  std::ofstream fiducials(scratch / "fiducials.txt");
  for (const Eigen::Vector3d& f : kFiducials) fiducials << f.transpose() << '\n';
  out.patient.fiducials = scratch / "fiducials.txt";
  out.patient.landmarks = scratch.file("landmarks.csv", "name,x,y,z\ntumour,30,30,20\n");
  out.tip_in_pointer_mm = Eigen::Vector3d(0, 0, 150);
  out.fiducials = kFiducials.size();
  out.video_must_agree = false;  // its video shows nothing
  return out;
}

/// Waits for the CT, which another thread reads.
inline void read_ct(LiveWorkflow& workflow) {
  for (int i = 0; i < 1000 && workflow.view().patient == nullptr && workflow.view().fault.empty(); ++i) {
    sleep_for(Duration::from_ms(10));
    workflow.tick();
  }
  ASSERT_NE(workflow.view().patient, nullptr) << workflow.view().fault;
}

/// And it is the patient's on the table.
inline void load(LiveWorkflow& workflow) {
  read_ct(workflow);
  workflow.confirm_patient();
}

/// The pointer's tip at places of the patient, one after the other.
class Hand {
 public:
  explicit Hand(LiveWorkflow& workflow) : workflow_(workflow) {}
  void rest_at(const Eigen::Vector3d& in_patient_mm, int samples) {
    const Eigen::Vector3d to_mm = kTrackerFromPatient * in_patient_mm;
    for (int i = 0; i < 30; ++i) push(at_mm_ + (to_mm - at_mm_) * (i / 29.0));
    for (int i = 0; i < samples; ++i) push(to_mm);
    at_mm_ = to_mm;
  }

 private:
  void push(const Eigen::Vector3d& tip_mm) {
    wire::Birds birds;
    birds.acquired = DeviceTime{time_ms_ * kMs};
    time_ms_ += 10;
    birds.birds.push_back(
        {"pointer", Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), tip_mm - Eigen::Vector3d(0, 0, 150))});
    workflow_.take(birds, HostTime{birds.acquired.ns}, host::ClockGap{});
  }
  LiveWorkflow& workflow_;
  Eigen::Vector3d at_mm_ = Eigen::Vector3d(0, 0, 900);
  std::int64_t time_ms_ = 1000;
};

inline const Eigen::Vector3d kTumour(30, 30, 20);

/// Somebody points at a place of the patient, and presses Space.
inline void check_at(LiveWorkflow& workflow, const Eigen::Vector3d& in_patient_mm) {
  Hand(workflow).rest_at(in_patient_mm, 5);
  workflow.primary(HostTime{0});
}

/// At a fiducial and at the tumour, as one does where the registration is in doubt; both have moved by so much.
inline void confirm(LiveWorkflow& workflow, const Eigen::Vector3d& moved_mm = {0, 0, 0}) {
  check_at(workflow, kFiducials[0] + moved_mm);
  check_at(workflow, kTumour + moved_mm);
}

/// The appliance sends the scope's calibration record.
inline void give_record(LiveWorkflow& workflow,
                        const calibration::CalibrationRecord& record = straight_scope_record()) {
  wire::Calibration calibration;
  calibration.in_force = true;
  calibration.record = signed_record_text(record);
  workflow.take(calibration, HostTime{0}, std::nullopt);
}

/// As a window keeps it that had this record from the appliance.
inline host::CalibratedScope calibrated_by(const calibration::CalibrationRecord& record) {
  return {*host::ScopeSetup::of_record(record), record.hand_eye->provenance.made_utc, false};
}

/// All of the small CT by 4 mm: what is seen at p was at p + u(p).
inline std::shared_ptr<const host::DeformedOrgan> moved_to_the_left() {
  host::DisplacementField field;
  field.size = {2, 2, 2};
  field.displacement_mm.assign(8, Eigen::Vector3f(-4, 0, 0));
  field.patient_from_lattice = Eigen::Translation3d(-500, -500, -500) * Eigen::Scaling(1000.0);
  return std::make_shared<const host::DeformedOrgan>(host::DeformedOrgan{field, 0.7, host::MotionError{0.7, 1.2}});
}

inline const calibration::Identity kTracker{{"model", "miniBIRD 800"}, {"unit_serial", "4711"}};
inline const calibration::Identity kCamera{{"card", "Storz"}, {"serial", "A1"}};

/// The appliance tells how it is, and what it has.
inline void tell_health(LiveWorkflow& workflow, const calibration::Identity& tracker = kTracker,
                        const calibration::Identity& camera = kCamera) {
  wire::Health health;
  health.state = "ready";
  health.instruments = {{"tracker", "running", "", 0, tracker}, {"camera", "running", "", 0, camera}};
  workflow.take(health, HostTime{0}, std::nullopt);
}

inline void connect(LiveWorkflow& workflow) {
  workflow.set_link(true, "connecting");
  tell_health(workflow);
  workflow.set_link(true, "connected");
}

inline void connect_and_calibrate(LiveWorkflow& workflow) {
  connect(workflow);
  EXPECT_EQ(workflow.view().step, LiveStep::calibrate);
  give_record(workflow);
  EXPECT_TRUE(workflow.view().note(LiveStep::calibrate).done);
  workflow.primary(HostTime{0});
  EXPECT_EQ(workflow.view().step, LiveStep::fiducials);
}

/// The scope at its place, looking at the patient's point from so far.
inline wire::VideoFrame looking_at(const LiveWorkflow& workflow, const Eigen::Vector3d& point_in_patient_mm,
                                   double from_mm, double sigma_mm) {
  const host::Setup& setup = *workflow.picture().setup();
  const Transform<Camera, Patient> camera_from_patient(Eigen::Matrix3d::Identity(),
                                                       Eigen::Vector3d(0, 0, from_mm) - point_in_patient_mm);
  wire::VideoFrame frame;
  frame.width_px = setup.camera().width_px;
  frame.height_px = setup.camera().height_px;
  frame.rgb = std::make_shared<std::vector<std::uint8_t>>(std::size_t{3} * 768 * 576, 90);
  frame.info.acquired = DeviceTime{40 * kMs};
  frame.info.pose.kind = PoseKind::exact;
  frame.info.pose.position_sigma_mm = sigma_mm;
  frame.info.pose.tracker_from_sensor =
      setup.tracker_from_patient() * camera_from_patient.inverse() * setup.camera_from_sensor();
  return frame;
}

}  // namespace birdseye::testing
