// The workflow of the live window without a window: fed with events as an appliance sends them.
#include <gtest/gtest.h>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/points/point_error.hpp"
#include "drivers/system/wait.hpp"
#include "host/operation/operation.hpp"
#include "host/window/live_script.hpp"
#include "tests/support/live_operation.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::connect;
using birdseye::testing::connect_and_calibrate;
using birdseye::testing::give_record;
using birdseye::testing::Hand;
using birdseye::testing::kFiducials;
using birdseye::testing::kMs;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::load;
using birdseye::testing::looking_at;
using birdseye::testing::operation_settings;
using birdseye::testing::Scratch;

TEST(LiveWorkflow, GoesFromTheLinkToARegisteredPatient) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  load(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_FALSE(workflow.picture().setup().has_value());
    hand.rest_at(kFiducials[i], 80);
    hand.rest_at(kFiducials[i] + Eigen::Vector3d(0, 0, 40), 1);
    EXPECT_EQ(workflow.view().touches.size(), i + 1);
  }
  // With three there is a fit, and it is shown; which is which is not yet sure enough to go on.
  ASSERT_TRUE(workflow.view().fre_mm.has_value()) << workflow.view().registration_fault;
  EXPECT_FALSE(workflow.view().note(LiveStep::fiducials).done);
  hand.rest_at(kFiducials[3], 80);
  hand.rest_at({0, 0, 200}, 1);
  EXPECT_EQ(workflow.view().step, LiveStep::views);
  workflow.go_on();
  workflow.go_on();
  EXPECT_EQ(workflow.view().step, LiveStep::check);
  EXPECT_LT(*workflow.view().fre_mm, 0.05);
  ASSERT_TRUE(workflow.picture().setup().has_value());
  const auto& found = workflow.picture().setup()->tracker_from_patient();
  EXPECT_LT((found.translation() - kTrackerFromPatient.translation()).norm(), 0.1);
  hand.rest_at(Eigen::Vector3d(30, 30, 22), 30);
  const auto reading = workflow.view().check;
  ASSERT_TRUE(reading.has_value());
  EXPECT_EQ(reading->nearest, "tumour");
  EXPECT_NEAR(reading->distance_mm, 2, 0.1);
  workflow.go_on();
  EXPECT_EQ(workflow.view().step, LiveStep::run);
}

/// With markers where kFiducials are.
std::string ct_with_markers(const Scratch& scratch) {
  birdseye::testing::write_ct_with_markers(scratch / "ct", kFiducials);
  return (scratch / "ct").string();
}

TEST(LiveWorkflow, WhatIsTouchedBeforeTheMarkersAreFoundCounts) {
  const Scratch scratch;
  LiveSettings settings = operation_settings(scratch);
  settings.patient.fiducials.clear();
  settings.patient.ct = ct_with_markers(scratch);
  LiveWorkflow workflow(settings);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_EQ(workflow.view().touches.size(), kFiducials.size());
  EXPECT_FALSE(workflow.view().fre_mm.has_value());
  load(workflow);
  for (int i = 0; i < 1000 && !workflow.view().markers_seen; ++i) {
    sleep_for(Duration::from_ms(10));
    workflow.tick();
  }
  ASSERT_TRUE(workflow.view().markers_seen.has_value());
  EXPECT_EQ(*workflow.view().markers_seen, kFiducials.size());
  ASSERT_TRUE(workflow.view().fre_mm.has_value()) << workflow.view().registration_fault;
  EXPECT_LT(*workflow.view().fre_mm, 0.3);
  EXPECT_EQ(workflow.view().step, LiveStep::views);
}

TEST(LiveWorkflow, TheCtIsSeenFromElsewhereOnceItCanBeDrawn) {
  const Scratch scratch;
  CameraModel camera;
  camera.width_px = 40;
  camera.height_px = 30;
  camera.fx_px = camera.fy_px = 40;
  camera.cx_px = 20;
  camera.cy_px = 15;
  // The ball about the patient's origin, from 80 mm.
  const Transform<Camera, Patient> camera_from_patient(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, 80));
  EXPECT_FALSE(LiveWorkflow(LiveSettings{}).ct_seen_from(camera, camera_from_patient, {}).has_value());
  LiveWorkflow workflow(operation_settings(scratch));
  load(workflow);
  EXPECT_EQ(workflow.view().engine_name.substr(0, 3), "cpu") << workflow.view().fault;
  const auto ct = workflow.ct_seen_from(camera, camera_from_patient, {});
  ASSERT_TRUE(ct.has_value());
  ASSERT_EQ(ct->rgba.size(), std::size_t{4} * 40 * 30);
  const std::size_t middle = 4 * (std::size_t{15} * 40 + 20);
  EXPECT_GT(ct->rgba[middle + 3], 0) << "the ball";
  EXPECT_EQ(ct->rgba[3], 0) << "the air beside it";
}

double square(double x) {
  return x * x;
}

TEST(LiveWorkflow, SaysHowFarTheTargetMayBeFromWhereItIsDrawn) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  load(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (std::size_t i = 0; i < 4; ++i) hand.rest_at(kFiducials[i] + Eigen::Vector3d(0, 0, i % 2 == 0 ? 1 : -1), 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_TRUE(workflow.picture().setup().has_value());
  EXPECT_FALSE(workflow.view().target.has_value()) << "of no frame";
  const Eigen::Vector3d tumour_mm(30, 30, 20);
  workflow.take(looking_at(workflow, tumour_mm, 100, 0.2), HostTime{0}, ClockGap{});
  workflow.draw();
  const auto mark = workflow.view().target;
  ASSERT_TRUE(mark.has_value());
  const CameraModel& camera = workflow.picture().setup()->camera();
  EXPECT_LT((mark->at_px - Eigen::Vector2d(camera.cx_px, camera.cy_px)).norm(), 0.1);
  EXPECT_FALSE(mark->error.motion.has_value());
  // By hand: the fiducials, hand-eye's 0.5 mm of the record, 1.23 times that, for it is estimated, across the line of
  // sight, the pose's 0.2 mm an axis.
  const auto localisation = calibration::localisation_error_of(*workflow.view().fre_mm, 4);
  const double fiducials_mm = calibration::TargetError(kFiducials, localisation.upper95_mm).rms_mm(tumour_mm);
  const double rms_mm = std::sqrt(fiducials_mm * fiducials_mm + 1.5 * square(1.23 * 0.5) + 3 * 0.04);
  EXPECT_NEAR(mark->error.radius95_mm(), rms_mm * std::sqrt(5.99 / 3), 1e-3);
  EXPECT_NEAR(mark->radius_px, mark->error.radius95_mm() * camera.fx_px / 100, 0.1);
}

/// By all fiducials, of this CT.
Operation registered_operation(const LiveSettings& settings) {
  Operation kept;
  kept.ct_sha256 = read_patient(settings.patient)->ct_sha256;
  kept.made_utc = "2026-11-22T10:00:00Z";
  kept.registered = {kTrackerFromPatient, 0.3, kFiducials, {birdseye::testing::kTracker, {}, 0}};
  return kept;
}

LiveSettings resumed(const Scratch& scratch, const std::filesystem::path& from) {
  LiveSettings out = operation_settings(scratch);
  out.resume = from;
  return out;
}

TEST(LiveWorkflow, TargetAndLandmarksAreWhereTheDeformedCtHasThem) {
  const Scratch scratch;
  const LiveSettings again = resumed(scratch, scratch.path());
  Operation kept = registered_operation(again);
  // All of the small CT has moved by 4 mm towards the left: what is seen at p was at p + u(p).
  DisplacementField field;
  field.size = {2, 2, 2};
  field.displacement_mm.assign(8, Eigen::Vector3f(-4, 0, 0));
  field.patient_from_lattice = Eigen::Translation3d(-500, -500, -500) * Eigen::Scaling(1000.0);
  kept.deformed = std::make_shared<const DeformedOrgan>(DeformedOrgan{field, 0.7, MotionError{0.7, 1.2}});
  ASSERT_TRUE(write_operation(scratch.path(), kept));
  LiveWorkflow workflow(again);
  connect(workflow);
  load(workflow);
  ASSERT_EQ(workflow.view().fault, "");
  give_record(workflow);
  workflow.primary(HostTime{0});
  ASSERT_TRUE(workflow.picture().setup().has_value());
  workflow.take(looking_at(workflow, {34, 30, 20}, 100, 0), HostTime{0}, ClockGap{});
  workflow.draw();
  const auto mark = workflow.view().target;
  ASSERT_TRUE(mark.has_value());
  const CameraModel& camera = workflow.picture().setup()->camera();
  EXPECT_LT((mark->at_px - Eigen::Vector2d(camera.cx_px, camera.cy_px)).norm(), 0.1);
  EXPECT_TRUE(mark->error.motion.has_value());
  EXPECT_NEAR(workflow.view().target_moved_mm.value_or(-1), 4, 1e-3);
  ASSERT_TRUE(workflow.view().expected.has_value());
  EXPECT_EQ(workflow.view().expected->motion->rms_mm, 0.7);
  const double fiducials_mm =
      calibration::TargetError(kFiducials, calibration::localisation_error_of(0.3, 4).upper95_mm).rms_mm({30, 30, 20});
  const double rigid_mm = std::sqrt((fiducials_mm * fiducials_mm + 1.5 * square(1.23 * 0.5)) * 5.99 / 3);
  EXPECT_NEAR(mark->error.radius95_mm(), std::hypot(rigid_mm, 1.2), 1e-3);
  Hand hand(workflow);
  hand.rest_at({34, 30, 21}, 30);
  const auto reading = workflow.view().check;
  ASSERT_TRUE(reading.has_value());
  EXPECT_EQ(reading->nearest, "tumour");
  EXPECT_NEAR(reading->distance_mm, 1, 0.1);
  // By another registration the deformation means nothing.
  workflow.go_to(LiveStep::fiducials);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_TRUE(workflow.picture().setup().has_value()) << workflow.view().registration_fault;
  EXPECT_FALSE(workflow.view().deformed != nullptr);
  EXPECT_FALSE(workflow.view().note(LiveStep::deform).done);
}

/// Four fiducials, and what was found of them is in out.
void register_into(const std::filesystem::path& out, LiveSettings kept) {
  kept.out = out;
  LiveWorkflow workflow(kept);
  load(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_TRUE(workflow.view().note(LiveStep::fiducials).done);
}

void register_into(const std::filesystem::path& out, const Scratch& scratch, bool with_markers = false) {
  LiveSettings kept = operation_settings(scratch);
  if (with_markers) kept.patient.ct = ct_with_markers(scratch);
  register_into(out, kept);
}

TEST(LiveWorkflow, ACtWhoseGeometryIsStatedOtherwiseIsNotTakenUp) {
  const Scratch scratch;
  LiveSettings settings = operation_settings(scratch);
  settings.patient.ct = scratch.file(
      "ct.nrrd", "NRRD0004\ntype: short\ndimension: 3\nsizes: 60 60 60\nendian: little\nencoding: raw\n\n" +
                     std::string(std::size_t{2} * 60 * 60 * 60, '\0'));
  settings.patient.ct.stated = {Eigen::Vector3d(2, 2, 2.5), "LPS"};
  register_into(scratch.path(), settings);
  const auto kept = read_operation(scratch.path());
  ASSERT_TRUE(kept) << kept.error().what;
  EXPECT_EQ(kept->ct_stated.spacing_mm, Eigen::Vector3d(2, 2, 2.5));
  EXPECT_EQ(kept->ct_stated.orientation, "LPS");
  settings.resume = scratch.path();
  for (const StatedGeometry& other :
       {StatedGeometry{Eigen::Vector3d(2, 2, 2), "LPS"}, StatedGeometry{Eigen::Vector3d(2, 2, 2.5), "PLS"}}) {
    settings.patient.ct.stated = other;
    LiveWorkflow workflow(settings);
    load(workflow);
    for (const char* said : {"is of another CT, or of this one with its voxels elsewhere", "give that CT",
                             "stated then: --spacing 2,2,2.5 --orientation LPS"})
      EXPECT_NE(workflow.view().fault.find(said), std::string::npos) << workflow.view().fault;
    EXPECT_FALSE(workflow.view().note(LiveStep::fiducials).done);
  }
  settings.patient.ct.stated = kept->ct_stated;
  LiveWorkflow workflow(settings);
  connect(workflow);
  load(workflow);
  EXPECT_EQ(workflow.view().fault, "");
  EXPECT_TRUE(workflow.view().note(LiveStep::fiducials).done);
  EXPECT_EQ(workflow.view().patient->notes.size(), 2U) << "that a person stated both is said again";
}

TEST(LiveWorkflow, IsTakenUpWhereAnotherWindowWasClosed) {
  const Scratch scratch;
  register_into(scratch.path(), scratch);
  LiveWorkflow workflow(resumed(scratch, scratch.path()));
  connect(workflow);
  load(workflow);
  EXPECT_EQ(workflow.view().fault, "");
  EXPECT_TRUE(workflow.view().note(LiveStep::fiducials).done);
  EXPECT_EQ(workflow.view().step, LiveStep::check);  // not the run: the patient may have been moved
  EXPECT_FALSE(workflow.view().note(LiveStep::fiducials).holds()) << "nobody has looked yet";
  EXPECT_FALSE(workflow.picture().setup().has_value()) << "without the scope's record there is no overlay";
  give_record(workflow);
  EXPECT_FALSE(workflow.picture().setup().has_value()) << "nor before somebody has looked whether it still holds";
  workflow.go_on();
  EXPECT_FALSE(workflow.picture().setup().has_value()) << "to skip the look is not to have looked";
  workflow.go_to(LiveStep::check);
  workflow.primary(HostTime{0});
  ASSERT_TRUE(workflow.picture().setup().has_value());
  const auto& found = workflow.picture().setup()->tracker_from_patient();
  EXPECT_LT((found.translation() - kTrackerFromPatient.translation()).norm(), 0.1);
}

TEST(OperationView, SlicesOpenAtTheTargetButAtAFiducialWhileTheseAreTouched) {
  OperationView operation;
  operation.step = LiveStep::run;
  EXPECT_FALSE(first_place_mm(operation).has_value());
  operation.markers_in_patient_mm = {{1, 2, 3}};
  EXPECT_EQ(*first_place_mm(operation), Eigen::Vector3d(1, 2, 3)) << "where there is no target";
  operation.landmarks = {{"tumour", {30, 30, 20}}};
  EXPECT_EQ(*first_place_mm(operation), Eigen::Vector3d(30, 30, 20));
  operation.step = LiveStep::fiducials;
  EXPECT_EQ(*first_place_mm(operation), Eigen::Vector3d(1, 2, 3));
}

TEST(OperationView, TheButtonSaysWaitWhereAPressWouldDoNothing) {
  OperationView operation;
  operation.step = LiveStep::fiducials;
  EXPECT_EQ(primary_words(operation), "take this point");
  operation.simulated = true;
  EXPECT_EQ(primary_words(operation), "wait for the touches");
  operation.step = LiveStep::deform;
  operation.deforming = true;
  EXPECT_EQ(primary_words(operation), "matching: wait") << "a foot that presses twice must not cancel it";
}

TEST(LiveWorkflow, WhatIsToBeTakenUpIsNotWrittenOverBefore) {
  const Scratch scratch;
  register_into(scratch.path(), scratch, true);
  const std::string kept = birdseye::testing::contents_of(scratch / "operation.json");
  LiveSettings settings = resumed(scratch, scratch.path());
  settings.out = scratch.path();
  settings.patient.ct = ct_with_markers(scratch);
  settings.patient.fiducials.clear();  // looked for, which takes its time
  LiveWorkflow workflow(settings);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  hand.rest_at({0, 0, 40}, 80);  // by mistake
  hand.rest_at({0, 0, 200}, 1);
  load(workflow);
  hand.rest_at({0, 0, 80}, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_EQ(workflow.view().touches.size(), 2U);
  EXPECT_EQ(birdseye::testing::contents_of(scratch / "operation.json"), kept);
  for (int i = 0; i < 1000 && !workflow.view().markers_seen; ++i) {
    sleep_for(Duration::from_ms(10));
    workflow.tick();
  }
  EXPECT_EQ(workflow.view().fault, "");
  EXPECT_TRUE(workflow.view().note(LiveStep::fiducials).done) << workflow.view().note(LiveStep::fiducials).line;
  EXPECT_EQ(workflow.view().step, LiveStep::check);
  EXPECT_TRUE(workflow.view().touches.empty());
}

TEST(LiveWorkflow, AnotherPatientsRegistrationIsNotTakenUp) {
  const Scratch scratch;
  register_into(scratch.path(), scratch);
  LiveSettings wrong = resumed(scratch, scratch.path());
  wrong.out = scratch.path();
  birdseye::testing::ct_of_tissue(scratch, 25);  // in the first one's place
  LiveWorkflow workflow(wrong);
  load(workflow);
  EXPECT_NE(workflow.view().fault.find("is of another CT"), std::string::npos) << workflow.view().fault;
  EXPECT_FALSE(workflow.view().note(LiveStep::fiducials).done);
  // Nor is it lost by what is touched then.
  const std::string kept = birdseye::testing::contents_of(scratch / "patient_from_tracker.txt");
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  EXPECT_TRUE(workflow.view().note(LiveStep::fiducials).done);
  EXPECT_EQ(birdseye::testing::contents_of(scratch / "patient_from_tracker.txt"), kept);
}

/// The scope's calibration in an operation that was kept, and the appliance's record, made before or after it.
TEST(LiveWorkflow, OfTwoCalibrationsTheNewerCounts) {
  const Scratch scratch;
  for (const bool record_is_newer : {false, true}) {
    const LiveSettings again = resumed(scratch, scratch.path());
    Operation kept = registered_operation(again);
    calibration::HandEyeResult found;
    found.held_out_px = 1;
    // The record's is 09:30.
    kept.calibrated = {ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, 0.3, found),
                       record_is_newer ? "2026-11-22T09:00:00Z" : "2026-11-22T10:00:00Z",
                       true,
                       {birdseye::testing::kTracker, birdseye::testing::kCamera, 0}};
    ASSERT_TRUE(write_operation(scratch.path(), kept));
    LiveWorkflow workflow(again);
    connect(workflow);
    load(workflow);
    ASSERT_EQ(workflow.view().fault, "");
    give_record(workflow);
    workflow.primary(HostTime{0});
    ASSERT_TRUE(workflow.picture().setup().has_value());
    EXPECT_EQ(workflow.picture().setup()->camera().fx_px == 500, !record_is_newer);
  }
}

TEST(LiveWorkflow, ATouchThatWasTakenBackIsNotTakenUp) {
  const Scratch scratch;
  {
    LiveSettings kept = operation_settings(scratch);
    kept.out = scratch.path();
    LiveWorkflow workflow(kept);
    load(workflow);
    connect_and_calibrate(workflow);
    Hand hand(workflow);
    for (std::size_t i = 0; i < 3; ++i) hand.rest_at(kFiducials[i], 80);
    hand.rest_at({0, 0, 200}, 1);
    ASSERT_TRUE(workflow.view().fre_mm.has_value());
    workflow.undo();
  }
  LiveWorkflow workflow(resumed(scratch, scratch.path()));
  load(workflow);
  EXPECT_EQ(workflow.view().fault, "");
  EXPECT_FALSE(workflow.view().fre_mm.has_value());
}

TEST(LiveWorkflow, ADamagedOperationIsNamed) {
  const Scratch scratch;
  register_into(scratch.path(), scratch);
  const std::string whole = birdseye::testing::contents_of(scratch / "operation.json");
  (void)scratch.file("operation.json", whole.substr(0, whole.size() / 3));
  LiveWorkflow workflow(resumed(scratch, scratch.path()));
  load(workflow);
  EXPECT_NE(workflow.view().fault.find("operation.json"), std::string::npos) << workflow.view().fault;
  EXPECT_FALSE(workflow.view().fre_mm.has_value());
}

/// Found by a record that the appliance sent: whether it sends the same again decides.
TEST(LiveWorkflow, ADeformationIsTakenUpWithTheCalibrationItWasFoundByAlone) {
  const Scratch scratch;
  const auto record = birdseye::testing::example_record(768, 576, {}, {});
  auto other = record;
  other.hand_eye->camera_from_sensor = Transform<Camera, Sensor>(Eigen::Matrix3d::Identity(), {0, 0, 250});
  Operation kept = registered_operation(operation_settings(scratch));
  kept.calibrated = {*ScopeSetup::of_record(record), record.hand_eye->provenance.made_utc, false};
  DisplacementField field;
  field.size = {2, 2, 2};
  field.displacement_mm.assign(8, Eigen::Vector3f(-4, 0, 0));
  field.patient_from_lattice = Eigen::Translation3d(-500, -500, -500) * Eigen::Scaling(1000.0);
  kept.deformed = std::make_shared<const DeformedOrgan>(DeformedOrgan{field, 0.7, MotionError{0.7, 1.2}});
  for (const bool same : {true, false}) {
    for (const bool record_comes_first : {true, false}) {
      ASSERT_TRUE(write_operation(scratch.path(), kept));
      LiveWorkflow workflow(resumed(scratch, scratch.path()));
      connect(workflow);
      if (record_comes_first) give_record(workflow, same ? record : other);
      load(workflow);
      ASSERT_EQ(workflow.view().fault, "");
      if (!record_comes_first) give_record(workflow, same ? record : other);
      EXPECT_TRUE(workflow.view().note(LiveStep::fiducials).done);
      EXPECT_EQ(workflow.view().deformed != nullptr, same) << record_comes_first;
    }
  }
}

TEST(LiveWorkflow, AnOperationOfOtherLabelsIsNotTakenUp) {
  const Scratch scratch;
  Operation kept = registered_operation(operation_settings(scratch));
  kept.labels_sha256 = "of labels that were shown";
  ASSERT_TRUE(write_operation(scratch.path(), kept));
  LiveSettings settings = resumed(scratch, scratch.path());
  settings.patient.labels = settings.patient.ct.path;  // on its grid
  settings.patient.organ = {"200"};
  LiveWorkflow workflow(settings);
  load(workflow);
  EXPECT_NE(workflow.view().fault.find("is of other labels"), std::string::npos) << workflow.view().fault;
  EXPECT_FALSE(workflow.view().fre_mm.has_value());
}

TEST(LiveWorkflow, AServerThatIsNoApplianceIsReadyWhenItSendsVideoAndPoses) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  workflow.set_link(true, "connected");
  EXPECT_FALSE(workflow.view().note(LiveStep::connect).done);
  wire::VideoFrame frame;
  frame.width_px = frame.height_px = 1;
  frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(3);
  workflow.take(wire::Status{false, "several devices send poses"}, HostTime{0}, std::nullopt);
  workflow.take(frame, HostTime{0}, std::nullopt);
  workflow.set_link(true, "connected");
  EXPECT_FALSE(workflow.view().note(LiveStep::connect).done);
  EXPECT_EQ(workflow.view().note(LiveStep::connect).line, "several devices send poses");
  EXPECT_EQ(workflow.view().step, LiveStep::connect);
  workflow.take(wire::Status{true, ""}, HostTime{0}, std::nullopt);
  workflow.set_link(true, "connected");
  EXPECT_TRUE(workflow.view().note(LiveStep::connect).done);
  EXPECT_EQ(workflow.view().step, LiveStep::calibrate);
  // What one server said is not held against the next.
  workflow.take(wire::Status{false, "poses and no video"}, HostTime{0}, std::nullopt);
  workflow.set_link(false, "gone");
  workflow.set_link(true, "connected");
  EXPECT_TRUE(workflow.view().note(LiveStep::connect).done);
}

TEST(LiveWorkflow, AWrongTouchShowsAndIsTakenBack) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  load(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (const Eigen::Vector3d& place : {kFiducials[0], kFiducials[1], Eigen::Vector3d(35, 60, 90)}) {
    hand.rest_at(place, 30);
    workflow.primary(HostTime{0});  // the pedal's way: at once
  }
  EXPECT_EQ(workflow.view().touches.size(), 3U);
  EXPECT_TRUE(!workflow.view().registration_fault.empty() || *workflow.view().fre_mm > 2);
  workflow.undo();
  EXPECT_EQ(workflow.view().touches.size(), 2U);
  EXPECT_FALSE(workflow.view().fre_mm.has_value());
  EXPECT_FALSE(workflow.picture().setup().has_value());
}

TEST(LiveWorkflow, StaysWithTheFiducialsWhereOneIsOffAndTakesThatOneBack) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  load(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (std::size_t i = 0; i < kFiducials.size(); ++i) {
    hand.rest_at(kFiducials[i] + (i == 1 ? Eigen::Vector3d(9, 3, 0) : Eigen::Vector3d::Zero()), 80);
  }
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_EQ(workflow.view().touches.size(), kFiducials.size());
  EXPECT_TRUE(workflow.view().fits_poorly);
  EXPECT_EQ(workflow.view().step, LiveStep::fiducials);
  EXPECT_EQ(workflow.view().odd_touch, 1U) << workflow.view().registration_fault;
  EXPECT_TRUE(workflow.view().touch_loses.empty());
  workflow.take_back(1);
  EXPECT_EQ(workflow.view().touches.size(), kFiducials.size() - 1);
  hand.rest_at(kFiducials[1], 80);
  hand.rest_at({0, 0, 200}, 1);
  EXPECT_FALSE(workflow.view().fits_poorly);
  EXPECT_EQ(workflow.view().step, LiveStep::views);
}

TEST(LiveWorkflow, ATouchIsTakenBackTwiceWhereViewsAreLostWithIt) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  load(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_EQ(workflow.view().step, LiveStep::views);
  // The scope has a pose, and the frame an overlay: a view may be kept.
  workflow.take(looking_at(workflow, {30, 30, 20}, 100, 0.2), HostTime{0}, ClockGap{});
  workflow.draw();
  workflow.primary(HostTime{0});
  ASSERT_EQ(workflow.view().note(LiveStep::views).line, "1 views kept");
  workflow.go_to(LiveStep::fiducials);
  EXPECT_EQ(workflow.view().touch_loses, "1 views");
  workflow.undo();
  EXPECT_EQ(workflow.view().touches.size(), kFiducials.size()) << "asked for once";
  EXPECT_EQ(workflow.view().asked_to_take_back, kFiducials.size() - 1);
  workflow.take_back(0);
  EXPECT_EQ(workflow.view().touches.size(), kFiducials.size()) << "another one, and once too";
  workflow.go_to(LiveStep::run);
  workflow.go_to(LiveStep::fiducials);
  EXPECT_FALSE(workflow.view().asked_to_take_back.has_value());
  workflow.undo();
  workflow.undo();
  EXPECT_EQ(workflow.view().touches.size(), kFiducials.size() - 1);
  EXPECT_TRUE(workflow.view().touch_loses.empty());
  workflow.undo();
  EXPECT_EQ(workflow.view().touches.size(), kFiducials.size() - 2) << "nothing is lost with it any more";
}

TEST(LiveWorkflow, SaysWhatIsWrongWithThePatientsFiles) {
  const Scratch scratch;
  LiveSettings wrong = operation_settings(scratch);
  wrong.patient.ct = scratch / "nothere";
  LiveWorkflow workflow(wrong);
  for (int i = 0; i < 1000 && workflow.view().fault.empty(); ++i) {
    sleep_for(Duration::from_ms(10));
    workflow.tick();
  }
  EXPECT_NE(workflow.view().fault.find("nothere"), std::string::npos);
  LiveSettings unknown = operation_settings(scratch);
  unknown.transfer = "no such preset";
  EXPECT_NE(LiveWorkflow(unknown).view().fault.find("no such preset"), std::string::npos);
}

TEST(LiveWorkflow, ALostLinkIsSaidAndNothingOfItStays) {
  LiveWorkflow workflow{LiveSettings{}};
  wire::Health health;
  health.state = "ready";
  workflow.take(health, HostTime{0}, std::nullopt);
  workflow.set_link(true, "connected");
  EXPECT_TRUE(workflow.view().note(LiveStep::connect).done);
  workflow.set_link(false, "127.0.0.1:18944: the appliance has gone");
  EXPECT_FALSE(workflow.view().note(LiveStep::connect).done);
  EXPECT_FALSE(workflow.view().link.health.has_value());
  EXPECT_EQ(workflow.view().link.words, "127.0.0.1:18944: the appliance has gone");
}

TEST(LiveScript, IsFollowedLineByLine) {
  const Scratch scratch;
  auto script =
      LiveScript::read(scratch.file("s.txt", "# first\nsleep 0.5\nkey space\n\nwait connect 2 # or not\nend\n"));
  ASSERT_TRUE(script) << script.error().what;
  LiveWorkflow workflow{LiveSettings{}};
  EXPECT_TRUE(script->next(workflow.view(), HostTime{0})->key.empty());
  EXPECT_TRUE(script->next(workflow.view(), HostTime{400 * kMs})->key.empty());
  EXPECT_TRUE(script->next(workflow.view(), HostTime{600 * kMs})->key.empty());  // the pause is over
  EXPECT_EQ(script->next(workflow.view(), HostTime{600 * kMs})->key, "space");
  EXPECT_FALSE(script->next(workflow.view(), HostTime{700 * kMs})->end);
  const auto late = script->next(workflow.view(), HostTime{2800 * kMs});
  ASSERT_FALSE(late);
  EXPECT_NE(late.error().what.find("s.txt:5: connect was not done within 2 s"), std::string::npos) << late.error().what;
}

TEST(LiveScript, PressesAKeyUntilAStepIsDone) {
  const Scratch scratch;
  auto script = LiveScript::read(scratch.file("s.txt", "press space 0.5 connect 2\nend\n"));
  ASSERT_TRUE(script) << script.error().what;
  LiveWorkflow workflow{LiveSettings{}};
  const auto key_at = [&](std::int64_t ms) { return script->next(workflow.view(), HostTime{ms * kMs})->key; };
  EXPECT_EQ(key_at(0), "space");
  EXPECT_EQ(key_at(400), "");
  EXPECT_EQ(key_at(500), "space");
  EXPECT_EQ(key_at(1000), "space");
  auto late = *script;
  EXPECT_FALSE(late.next(workflow.view(), HostTime{2000 * kMs}));
  wire::Health health;
  health.state = "ready";
  workflow.take(health, HostTime{0}, std::nullopt);
  workflow.set_link(true, "connected");
  EXPECT_EQ(key_at(1600), "");
  EXPECT_TRUE(script->next(workflow.view(), HostTime{1601 * kMs})->end);
}

TEST(LiveScript, NamesALineThatIsNone) {
  const Scratch scratch;
  for (const char* text :
       {"wait connect\n", "wait nothing 3\n", "jump 3\n", "key\n", "sleep -1\n", "press space 1 views\n"}) {
    const auto script = LiveScript::read(scratch.file("s.txt", std::string("end\n") + text));
    ASSERT_FALSE(script) << text;
    EXPECT_NE(script.error().what.find("s.txt:2: "), std::string::npos) << script.error().what;
  }
  EXPECT_FALSE(LiveScript::read(scratch / "none.txt"));
}

}  // namespace
}  // namespace birdseye::host
