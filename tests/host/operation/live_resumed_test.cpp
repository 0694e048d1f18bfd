// The workflow of the live window without a window: fed with events as an appliance sends them. An operation that is
// taken up from an earlier window's folder.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "drivers/system/wait.hpp"
#include "host/operation/operation.hpp"
#include "tests/host/operation/doubted_fixture.hpp"
#include "tests/host/operation/live_workflow_fixture.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::connect;
using birdseye::testing::connect_and_calibrate;
using birdseye::testing::ct_with_markers;
using birdseye::testing::give_record;
using birdseye::testing::Hand;
using birdseye::testing::kFiducials;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::load;
using birdseye::testing::operation_settings;
using birdseye::testing::register_into;
using birdseye::testing::registered_operation;
using birdseye::testing::resumed;
using birdseye::testing::Scratch;

calibration::CalibrationRecord unsigned_scope() {
  return testing::straight_scope_record();
}

void give_text(LiveWorkflow& workflow, const std::string& text) {
  wire::Calibration calibration;
  calibration.in_force = true;
  calibration.record = text;
  workflow.take(calibration, HostTime{0}, std::nullopt);
}

TEST(LiveWorkflow, ARecordOfNobodyKnownIsUsedOnlyWhenAskedToAndTheViewSaysSo) {
  const Scratch scratch;
  const ThisMachine other = ThisMachine::for_once();
  for (const std::string& text : {record_text(unsigned_scope()), record_text(unsigned_scope(), other)}) {
    LiveSettings settings = operation_settings(scratch);
    LiveWorkflow careful(settings);
    connect(careful);
    give_text(careful, text);
    EXPECT_FALSE(careful.view().note(LiveStep::calibrate).done);
    EXPECT_NE(careful.view().note(LiveStep::calibrate).line.find("--accept-unsigned"), std::string::npos)
        << careful.view().note(LiveStep::calibrate).line;
    EXPECT_EQ(careful.view().not_signed, "");
    settings.authors.accept_unsigned = true;
    LiveWorkflow asked(settings);
    connect(asked);
    give_text(asked, text);
    EXPECT_TRUE(asked.view().note(LiveStep::calibrate).done);
    EXPECT_EQ(asked.view().not_signed, "calibration record");
    EXPECT_NE(asked.view().note(LiveStep::calibrate).line.find("UNSIGNED: "), std::string::npos)
        << asked.view().note(LiveStep::calibrate).line;
    give_record(asked);
    EXPECT_EQ(asked.view().not_signed, "") << "a known machine's record has come in its place";
  }
}

TEST(LiveWorkflow, WhatRestsOnAnUnsignedRecordIsNoBetterForBeingSignedAfterwards) {
  const Scratch scratch;
  Operation kept = registered_operation(resumed(scratch, scratch.path()));
  kept.doubt = "not signed";
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  const auto refused = read_operation(scratch.path(), testing::authors());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("rests on what no known machine signed"), std::string::npos)
      << refused.error().what;
  LiveSettings settings = resumed(scratch, scratch.path());
  settings.authors.accept_unsigned = true;
  LiveWorkflow workflow(settings);
  connect(workflow);
  load(workflow);
  EXPECT_EQ(workflow.view().not_signed, "operation");
}

TEST(LiveWorkflow, AMapOfTheFieldThatNobodyKnownSignedIsSaidAndRestedOn) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  connect(workflow);
  give_record(workflow);
  EXPECT_EQ(workflow.view().not_signed, "");
  wire::Health health;
  health.state = "ready";
  health.field_unsigned = "not signed: nobody says who wrote it";
  workflow.take(health, HostTime{0}, std::nullopt);
  EXPECT_EQ(workflow.view().not_signed, "map of the field");
  EXPECT_NE(workflow.view().note(LiveStep::connect).line.find("UNSIGNED: not signed"), std::string::npos)
      << workflow.view().note(LiveStep::connect).line;
  health.field_unsigned.clear();
  workflow.take(health, HostTime{0}, std::nullopt);
  EXPECT_EQ(workflow.view().not_signed, "map of the field") << "what was found by its poses rests on it";
}

TEST(LiveWorkflow, AnOperationOfAnUnknownMachineIsNotTakenUp) {
  const Scratch scratch;
  const ThisMachine other = ThisMachine::for_once();
  LiveSettings settings = resumed(scratch, scratch.path());
  ASSERT_TRUE(write_operation(scratch.path(), registered_operation(settings), other));
  LiveWorkflow careful(settings);
  connect(careful);
  load(careful);
  EXPECT_NE(careful.view().fault.find("not known here"), std::string::npos) << careful.view().fault;
  EXPECT_FALSE(careful.view().fre_mm);
  settings.authors.accept_unsigned = true;
  LiveWorkflow asked(settings);
  connect(asked);
  load(asked);
  EXPECT_EQ(asked.view().fault, "");
  EXPECT_EQ(asked.view().not_signed, "operation");
}

TEST(LiveWorkflow, WhatIsKeptDoesNotNameThePatient) {
  const Scratch scratch;
  const LiveSettings settings = operation_settings(scratch);
  const std::string id = read_patient(settings.patient)->identity.id;
  ASSERT_EQ(id, "SIM1");
  std::filesystem::create_directory(scratch / "kept");
  register_into(scratch / "kept", settings);
  ASSERT_TRUE(read_operation(scratch / "kept")->registered);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(scratch / "kept")) {
    if (entry.is_regular_file()) {
      EXPECT_EQ(birdseye::testing::contents_of(entry.path()).find(id), std::string::npos) << entry.path();
    }
  }
}

TEST(LiveWorkflow, ACtWhoseGeometryIsStatedOtherwiseIsNotTakenUp) {
  const Scratch scratch;
  LiveSettings settings = operation_settings(scratch);
  settings.patient.ct = scratch.file(
      "ct.nrrd", "NRRD0004\ntype: short\ndimension: 3\nsizes: 60 60 60\nendian: little\nencoding: raw\n\n" +
                     std::string("A") + std::string(std::size_t{2} * 60 * 60 * 60 - 1, '\0'));
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
  birdseye::testing::confirm(workflow);
  ASSERT_TRUE(workflow.picture().setup().has_value());
  const auto& found = workflow.picture().setup()->tracker_from_patient();
  EXPECT_LT((found.translation() - kTrackerFromPatient.translation()).norm(), 0.1);
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

/// A look at a landmark before the window was closed counts after it.
TEST(LiveWorkflow, HowFarALandmarkWasOffIsTakenUp) {
  const Scratch scratch;
  Operation kept = registered_operation(resumed(scratch, scratch.path()));
  kept.registered->off = {{birdseye::testing::kTumour, "tumour", 7.5, false, false}};
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  LiveWorkflow workflow(resumed(scratch, scratch.path()));
  connect(workflow);
  load(workflow);
  give_record(workflow);
  birdseye::testing::check_at(workflow, kFiducials[0]);
  birdseye::testing::check_at(workflow, kFiducials[1]);
  ASSERT_TRUE(workflow.picture().setup().has_value()) << workflow.view().note(LiveStep::check).line;
  EXPECT_NEAR(workflow.picture().figures().target_mm.value_or(0), 7.5, 0.1);
}

TEST(LiveWorkflow, ALandmarkThatRefusedARegistrationRefusesItAfterARestart) {
  const Scratch scratch;
  Operation kept = registered_operation(resumed(scratch, scratch.path()));
  kept.registered->off = {{birdseye::testing::kTumour, "tumour", 12, false, true}};
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  LiveWorkflow workflow(resumed(scratch, scratch.path()));
  connect(workflow);
  load(workflow);
  give_record(workflow);
  birdseye::testing::check_at(workflow, kFiducials[0]);
  birdseye::testing::check_at(workflow, kFiducials[1]);
  EXPECT_FALSE(workflow.picture().setup().has_value());
  birdseye::testing::check_at(workflow, birdseye::testing::kTumour);
  EXPECT_TRUE(workflow.picture().setup().has_value()) << workflow.view().note(LiveStep::check).line;
}

/// Registered, with a landmark that was picked in the slices, which is what is then done.
void pick_in(const Scratch& scratch, const std::function<void(LiveWorkflow&)>& then) {
  LiveSettings settings = operation_settings(scratch);
  settings.out = scratch.path();
  LiveWorkflow workflow(settings);
  load(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  workflow.go_to(LiveStep::check);
  then(workflow);
  workflow.finish();
}

TEST(LiveWorkflow, NothingIsKeptAnewWhereNothingWasUndone) {
  const Scratch scratch;
  pick_in(scratch, [&](LiveWorkflow& workflow) {
    workflow.finish();
    ASSERT_TRUE(std::filesystem::remove(scratch / "operation.json"));
    workflow.undo();
  });
  EXPECT_FALSE(std::filesystem::exists(scratch / "operation.json"));
}

/// Without it only touching anew would be left.
TEST(LiveWorkflow, APickedLandmarkThatRefusedARegistrationIsThereAfterARestart) {
  const Scratch scratch;
  const Eigen::Vector3d picked_mm(20, 20, 10);
  pick_in(scratch, [&](LiveWorkflow& workflow) {
    birdseye::testing::pick_landmark(workflow, picked_mm);
    birdseye::testing::check_at(workflow, picked_mm + Eigen::Vector3d(0, 0, -12));
    EXPECT_FALSE(workflow.picture().setup().has_value());
  });
  LiveWorkflow workflow(resumed(scratch, scratch.path()));
  connect(workflow);
  load(workflow);
  ASSERT_EQ(workflow.view().fault, "");
  give_record(workflow);
  ASSERT_EQ(workflow.view().landmarks.size(), 2U);
  EXPECT_EQ(workflow.view().landmarks.back().name, "landmark 1");
  birdseye::testing::check_at(workflow, kFiducials[1]);
  birdseye::testing::check_at(workflow, kFiducials[0]);
  EXPECT_FALSE(workflow.picture().setup().has_value());
  birdseye::testing::check_at(workflow, picked_mm);
  EXPECT_TRUE(workflow.picture().setup().has_value()) << workflow.view().note(LiveStep::check).line;
}

/// The next window would take them for known before it.
TEST(LiveWorkflow, LandmarksThatWerePickedInDoubtOrTakenBackAreNotKept) {
  const Scratch scratch;
  pick_in(scratch, [](LiveWorkflow& workflow) {
    birdseye::testing::check_at(workflow, birdseye::testing::kTumour + Eigen::Vector3d(0, 0, 12));
    ASSERT_FALSE(workflow.picture().setup().has_value());
    birdseye::testing::pick_landmark(workflow, {-20, 20, 75});
  });
  EXPECT_TRUE(read_operation(scratch.path())->landmarks.empty());
  const Scratch other;
  pick_in(other, [](LiveWorkflow& workflow) {
    birdseye::testing::pick_landmark(workflow, {20, 20, 10});
    workflow.undo();
  });
  EXPECT_TRUE(read_operation(other.path())->landmarks.empty());
}

/// Touched before the CT was there, and held back as it came: what was kept is taken up in their place, and stays.
TEST(LiveWorkflow, WhatIsTakenUpIsNotLostByTouchesThatWereHeldBack) {
  const Scratch scratch;
  const LiveSettings again = resumed(scratch, scratch.path());
  ASSERT_TRUE(write_operation(scratch.path(), registered_operation(again), *testing::authors().machine));
  LiveWorkflow workflow(again);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  hand.rest_at(kFiducials[0], 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_EQ(workflow.view().touches.size(), 1U);
  workflow.set_link(false, "gone");
  load(workflow);
  connect(workflow);
  give_record(workflow);
  ASSERT_TRUE(workflow.view().note(LiveStep::fiducials).done) << workflow.view().note(LiveStep::fiducials).line;
  workflow.finish();
  EXPECT_TRUE(read_operation(scratch.path())->registered);
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

/// Touched before the CT had been read, which kept the operation from being taken up with it.
TEST(LiveWorkflow, AnOperationIsTakenUpOnceAnEarlyTouchIsTakenBack) {
  const Scratch scratch;
  register_into(scratch.path(), scratch);
  LiveWorkflow workflow(resumed(scratch, scratch.path()));
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  hand.rest_at(kFiducials[0], 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_EQ(workflow.view().touches.size(), 1U);
  while (!workflow.view().patient && workflow.view().fault.empty()) {
    workflow.tick();
    sleep_for(Duration::from_ms(5));
  }
  EXPECT_FALSE(workflow.view().fre_mm.has_value());
  workflow.undo();
  workflow.confirm_patient();
  EXPECT_TRUE(workflow.view().fre_mm.has_value());
  EXPECT_TRUE(workflow.view().note(LiveStep::fiducials).done);
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

TEST(LiveWorkflow, AnOperationOfOtherLabelsIsNotTakenUp) {
  const Scratch scratch;
  Operation kept = registered_operation(operation_settings(scratch));
  kept.labels_sha256 = "of labels that were shown";
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  LiveSettings settings = resumed(scratch, scratch.path());
  settings.patient.labels = settings.patient.ct.path;  // on its grid
  settings.patient.organ = {"200"};
  LiveWorkflow workflow(settings);
  load(workflow);
  EXPECT_NE(workflow.view().fault.find("is of other labels"), std::string::npos) << workflow.view().fault;
  EXPECT_FALSE(workflow.view().fre_mm.has_value());
}

}  // namespace
}  // namespace birdseye::host
