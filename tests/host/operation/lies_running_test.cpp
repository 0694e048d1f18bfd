// What the window does where something changes while the overlay runs: docs/manual/lies.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibration/geometry/rotations.hpp"
#include "tests/host/operation/lies.hpp"

namespace birdseye::testing {
namespace {

using Vector = Eigen::Vector3d;

/// Once the overlay runs.
Outcome while_it_runs(const Lie& lie, const Lie& before = {}) {
  Rehearsal operation(1);
  if (before) before(operation);
  if (!operation.begin() || !operation.register_patient() || !operation.check()) {
    ADD_FAILURE() << "the operation before the lie does not run: " << operation.workflow().view().registration_fault;
    return {};
  }
  operation.watch(0.4);
  EXPECT_GT(operation.watch(1).green.size(), 20U) << "there was no overlay before the lie";
  lie(operation);
  return outcome_of(operation.watch(kWatched_s));
}

void with_reference(Rehearsal& o) {
  o.reference_name = "reference";
}

std::vector<Row> while_running() {
  const auto row = [](const char* lie, Must must, const char* say, const Lie& tell, const char* note = "",
                      const Lie& before = {}) {
    return Row{lie, must, say, note, [tell, before] { return while_it_runs(tell, before); }};
  };
  const auto another = [](Rehearsal& o, calibration::Identity& which, const char* key, const char* value) {
    which[key] = value;
    o.tell_instruments();
    o.give_record();
  };
  constexpr const char* kOnlyReference = "a reference sensor, within 0.1 s";
  return {
      row("scope turned in its holder by 30 degrees", Must::end, kVideo, turn_in_holder),
      row("lens zoomed by 1.3", Must::end, "the round field is larger", [](Rehearsal& o) { zoom(o, 1.3); }),
      row(
          "lens refocused, 2 % longer", Must::withhold, "", [](Rehearsal& o) { zoom(o, 1.02); },
          "less than the circle states"),
      row("pictures of another size", Must::refuse, "the video is 160 x 120",
          [](Rehearsal& o) {
            o.width_px = 160;
            o.height_px = 120;
          }),
      row("a picture flipped left to right", Must::end, kVideo, [](Rehearsal& o) { o.picture_flipped_x = true; }),
      row("the record is withdrawn", Must::refuse, "the calibration is not used",
          [](Rehearsal& o) {
            o.camera["serial"] = "B2";
            o.give_record();
          }),
      row("another camera comes", Must::refuse, "the calibration is not used",
          [&](Rehearsal& o) { another(o, o.camera, "serial", "B2"); }),
      row("another tracker comes", Must::refuse, "the calibration is not used",
          [&](Rehearsal& o) { another(o, o.tracker, "unit_serial", "4712"); }),
      row("hemisphere wrong", Must::end, "", [](Rehearsal& o) { o.hemisphere_wrong = true; }),
      row("the tracker repeats its pose", Must::end, "", [](Rehearsal& o) { o.poses_repeat = true; }),
      row("no poses any more", Must::end, "", [](Rehearsal& o) { o.poses_come = false; }),
      row("no frames any more", Must::end, "the picture is", [](Rehearsal& o) { o.frames_come = false; }),
      row("the same frame again and again, by its stamp", Must::end, "the picture is",
          [](Rehearsal& o) { o.frames_repeat = true; }),
      row("the same picture again and again, with fresh stamps", Must::end, kVideo,
          [](Rehearsal& o) { o.picture_frozen = true; }),
      row("stamps 1 s ahead", Must::refuse, "980 ms ahead of the clock",
          [](Rehearsal& o) { o.frame_stamp_off = Duration::from_ms(1000); }),
      row(
          "stamps 10 ms ahead", Must::withhold, "", [](Rehearsal& o) { o.frame_stamp_off = Duration::from_ms(10); },
          "the pose is predicted; the circle counts it"),
      row(
          "stamps 60 ms late", Must::withhold, "", [](Rehearsal& o) { o.frame_stamp_off = Duration::from_ms(-60); },
          "at this scope's speed less than the circle"),
      row("stamps 200 ms late", Must::refuse, "the picture is",
          [](Rehearsal& o) { o.frame_stamp_off = Duration::from_ms(-200); }),
      row("the camera's clock stepped by 5 s", Must::refuse, "4980 ms ahead of the clock",
          [](Rehearsal& o) { o.frame_stamp_off = Duration::from_ms(5000); }),
      row("frames come 200 ms late", Must::refuse, "the picture is",
          [](Rehearsal& o) { o.frame_delay = Duration::from_ms(200); }),
      row(
          "transmitter bumped, no reference", Must::end, kVideo,
          [](Rehearsal& o) { o.truth.told_from_tracker = bump(); }, "while the scope sees the patient"),
      row(
          "transmitter bumped, with a reference", Must::withhold, "",
          [](Rehearsal& o) { o.truth.told_from_tracker = bump(); }, "poses are relative to the reference",
          with_reference),
      row("patient moved or bed tilted, no reference", Must::end, kVideo, move_patient,
          "while the scope sees the patient"),
      row(
          "patient moved, the scope looks elsewhere, no reference", Must::unseen, "",
          [](Rehearsal& o) {
            move_patient(o);
            o.forget_video();
            o.look_about();
          },
          kOnlyReference),
      row("patient moved, the reference not", Must::end, "reference", move_patient, "", with_reference),
      row(
          "the reference came off", Must::end, "",
          [](Rehearsal& o) {
            o.patient_from_reference =
                Transform<Patient, Sensor>(rotation_exp(Vector(0.5, 0.2, 0)), Vector(60, 120, -60));
          },
          "", with_reference),
      row(
          "the reference is lost", Must::end, "", [](Rehearsal& o) { o.reference_name = "elsewhere"; }, "",
          with_reference),
      row(
          "breathing of 8 mm, within the picture's own motion", Must::unseen, "",
          [](Rehearsal& o) {
            o.organ_motion = [](double at_s) {
              return Vector(0, 0, 4 - 4 * std::cos(2 * std::numbers::pi * at_s / 4));
            };
          },
          "the check of the deformed surface, once views are kept; a breath hold"),
      row(
          "half of the organ is resected", Must::withhold, "",
          [](Rehearsal& o) {
            o.resect();
            o.look_about();  // what the video shows is another scene, and has to move as the poses say anew
          },
          "the person who cuts; the check of the deformed surface, where it holds views against the video"),
      row("the organ is shifted by 25 mm, as by a retractor", Must::end, kVideo,
          [](Rehearsal& o) { o.organ_motion = [](double at_s) { return Vector(25 * std::min(1.0, at_s), 0, 0); }; }),
  };
}

TEST(Lies, WhileTheOverlayRuns) {
  settle("running", while_running());
}

}  // namespace
}  // namespace birdseye::testing
