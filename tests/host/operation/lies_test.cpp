// What the window does where something is not as it is told: docs/manual/lies.md. BIRDSEYE_LIES_PAGE=FILE writes the
// table there, else the file is held against it.
#include <gtest/gtest.h>

#include <utility>

#include "calibration/geometry/rotations.hpp"
#include "tests/host/operation/lies.hpp"

namespace birdseye::testing {
namespace {

using Vector = Eigen::Vector3d;

std::vector<Row> of_registration() {
  const auto row = [](const char* lie, Must must, const char* say, const Lie& tell, const char* note = "") {
    return Row{lie, must, say, note, [tell] { return from_the_start(tell); }};
  };
  return {
      row("fiducials mirrored, as RAS for LPS with one sign forgotten", Must::refuse, "mirror image",
          [](Rehearsal& o) {
            for (Vector& m : o.markers_mm) m.x() = 60 - m.x();
          }),
      row("fiducials in RAS, the CT in LPS", Must::refuse, "the CT",
          [](Rehearsal& o) {
            for (const Vector& m : o.markers_mm) o.told_markers_mm.emplace_back(-m.x(), -m.y(), m.z());
          }),
      row("CT scaled by 5 %", Must::refuse, "times those that were touched",
          [](Rehearsal& o) {
            for (Vector& m : o.markers_mm) m *= 1.05;
            o.landmark_mm *= 1.05;
          }),
      row("slices of the CT 5 % further apart than they were", Must::refuse, "lengths from head to foot",
          [](Rehearsal& o) {
            for (Vector& m : o.markers_mm) m.z() *= 1.05;
            o.landmark_mm.z() *= 1.05;
          }),
      row(
          "CT scaled by 1 %", Must::withhold, "",
          [](Rehearsal& o) {
            for (Vector& m : o.markers_mm) m *= 1.01;
            o.landmark_mm *= 1.01;
          },
          "less than the touches can tell, and than the circle states"),
      row(
          "fiducials touched in another order than listed", Must::withhold, "",
          [](Rehearsal& o) { o.touched = {3, 1, 5, 0, 4, 2}; }, "markers are told apart by their distances"),
      row("one fiducial touched twice, another not", Must::refuse, "touched",
          [](Rehearsal& o) { o.touched = {0, 1, 2, 3, 4, 4}; }),
      row(
          "one fiducial touched 8 mm beside", Must::withhold, "",
          [](Rehearsal& o) {
            o.beside_mm = {{0, 0, 0}, {8, 0, 0}};
          },
          "the residuals widen the circle"),
      row("one fiducial touched 25 mm beside", Must::refuse, "",
          [](Rehearsal& o) {
            o.beside_mm = {{0, 0, 0}, {25, 0, 0}};
          }),
      row(
          "all fiducials shifted with the skin by 10 mm", Must::refuse, "the pointer is 10 mm from tumour",
          [](Rehearsal& o) { o.beside_mm.assign(6, Vector(10, 0, 0)); }, "by the landmark that was not fitted"),
      row(
          "the tip of another pointer, 15 mm longer", Must::refuse, "FRE",
          [](Rehearsal& o) { o.truth.tip_in_pointer_mm.z() += 15; }, "a hand tilts the pointer from touch to touch"),
      row("sensors of scope and pointer exchanged", Must::refuse, "0 touched",
          [](Rehearsal& o) { std::swap(o.scope_name, o.pointer_name); }),
      row(
          "hemisphere wrong from the start", Must::refuse, "0 touched", [](Rehearsal& o) { o.hemisphere_wrong = true; },
          "birdseyed gives no pose of the other side"),
      row(
          "another patient's CT", Must::refuse, "X-17",
          [](Rehearsal& o) { o.settings = [](host::LiveSettings& live) { live.patient_id = "X-17"; }; },
          "where another system gives the ID on the table; else name, ID and date are asked for"),
  };
}

std::vector<Row> of_hardware() {
  static constexpr const char* kLonger =
      "the video moves too much or too little for the poses: often seen, not surely; check a landmark";
  const auto row = [](const char* lie, Must must, const char* say, const Lie& tell, const char* note = "") {
    return Row{lie, must, say, note, [tell] { return from_the_start(tell); }};
  };
  return {
      row("the record of another tracker", Must::refuse, "tracker unit_serial",
          [](Rehearsal& o) { o.tracker["unit_serial"] = "4712"; }),
      row("the record of another camera", Must::refuse, "camera serial",
          [](Rehearsal& o) { o.camera["serial"] = "B2"; }),
      row("the record of another scope on the same cart", Must::refuse, kVideo,
          [](Rehearsal& o) {
            o.record.hand_eye->camera_from_sensor =
                Transform<Camera, Sensor>(rotation_exp(Vector(0.1, -1.3, 0.3)), Vector(9, -5, -310));
          }),
      row("a record that states no error of hand-eye", Must::refuse, "how far hand-eye is off is not known",
          [](Rehearsal& o) { o.record.hand_eye->held_out_px = 0; }),
      row("scope turned in its holder by 30 degrees, before", Must::refuse, kVideo, turn_in_holder),
      row("a scope with a rod, its angle not said", Must::refuse, "the rod's angle is not known",
          [](Rehearsal& o) {
            o.record.hand_eye->rod = calibration::RodEntry{0, {0, 0, 1}, {0, 0, 0}, 1};
          }),
      row("lens zoomed by 1.3, before", Must::refuse, "the round field is larger", [](Rehearsal& o) { zoom(o, 1.3); }),
      row("lens zoomed out by 0.8, before", Must::refuse, "the round field is smaller",
          [](Rehearsal& o) { zoom(o, 0.8); }),
      row(
          "lens zoomed by 1.3, before, and the sensor holds no edge of the field", Must::withhold, "",
          [](Rehearsal& o) {
            o.record.lens->round_field.reset();
            zoom(o, 1.3);
          },
          kLonger),
      row(
          "lens zoomed out by 0.8, before, and the sensor holds no edge of the field", Must::withhold, "",
          [](Rehearsal& o) {
            o.record.lens->round_field.reset();
            zoom(o, 0.8);
          },
          kLonger),
      row(
          "lens refocused, 2 % longer, before", Must::withhold, "", [](Rehearsal& o) { zoom(o, 1.02); },
          "less than the circle states"),
      row("a picture flipped left to right by its cable", Must::refuse, kVideo,
          [](Rehearsal& o) { o.picture_flipped_x = true; }),
      row("a picture upside down", Must::refuse, kVideo,
          [](Rehearsal& o) { o.picture_flipped_x = o.picture_flipped_y = true; }),
  };
}

TEST(Lies, WithoutOneTheCheckedLandmarkStandsOnTheScreen) {
  Rehearsal operation(1);
  ASSERT_TRUE(operation.begin() && operation.register_patient());
  EXPECT_FALSE(operation.workflow().view().checked) << "nobody has checked yet";
  ASSERT_TRUE(operation.check());
  const auto checked = operation.workflow().view().checked;
  ASSERT_TRUE(checked);
  EXPECT_EQ(checked->name, "tumour");
  EXPECT_LT(checked->off_mm, 4);
  operation.watch(0.4);
  const Watched seen = operation.watch(8);
  EXPECT_GT(seen.green.size(), 0.95 * static_cast<double>(seen.frames));
  move_patient(operation);
  operation.watch(1);
  EXPECT_FALSE(operation.workflow().view().checked) << "what has moved is to be checked anew";
}

/// The patient is registered anew while video and poses do not agree, and is moved again before they do.
TEST(Lies, WhatMovesAgainBeforeTheVideoAgreesIsAskedForOnceItDoes) {
  Rehearsal operation(1);
  ASSERT_TRUE(operation.begin() && operation.register_patient() && operation.check());
  operation.watch(8);
  move_patient(operation);
  operation.watch(0.5);
  ASSERT_TRUE(operation.workflow().view().unconfirmed);
  operation.workflow().go_to(host::LiveStep::fiducials);
  ASSERT_TRUE(operation.register_patient());
  EXPECT_FALSE(operation.workflow().view().unconfirmed);
  operation.watch(0.2);
  move_patient(operation);
  for (int i = 0; i < 4; ++i) operation.look_about();
  EXPECT_TRUE(operation.workflow().view().unconfirmed);
  EXPECT_TRUE(operation.watch(2).green.empty());
  EXPECT_FALSE(operation.check()) << "the landmark lies elsewhere now";
  operation.workflow().go_to(host::LiveStep::fiducials);
  ASSERT_TRUE(operation.register_patient() && operation.check());
  const Watched seen = operation.watch(2);
  EXPECT_FALSE(seen.green.empty()) << ::testing::PrintToString(seen.reasons);
}

TEST(Lies, OfTheRegistration) {
  settle("registration", of_registration());
}
TEST(Lies, OfTheHardware) {
  settle("hardware", of_hardware());
}

}  // namespace
}  // namespace birdseye::testing
