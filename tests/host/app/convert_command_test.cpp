// What version 0.1.0's window kept, made into an operation of this version.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "host/deform/displacement_field.hpp"
#include "host/operation/operation.hpp"
#include "tests/support/command.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::expect_refused;
using testing::run;
using testing::Scratch;

constexpr const char* kChecksum = "dac423000fa96a6c";  // of ct_of_tissue, as 0.1.0 wrote it

/// As the window of 0.1.0 left it: names and figures as its files had them.
fs::path folder_of_010(const Scratch& scratch) {
  const fs::path folder = scratch / "old";
  fs::create_directories(folder);
  std::ofstream(folder / "operation.json") << R"({
  "calibrated": {"camera_rms_px": 0.3, "hand_eye_mm": 0.6, "made_utc": "2026-11-22T09:35:00Z", "tracked_rms_px": 1.2},
  "ct_checksum": ")" << kChecksum << R"(",
  "deformed": true,
  "deformed_seen_rms_mm": 0.7,
  "made_utc": "2026-11-22T10:00:00Z",
  "registered": {"fiducials_in_patient_mm": [[0, 0, 0], [60, 5, 0], [10, 70, 20], [30, 20, 50]], "fre_mm": 0.4}
})";
  std::ofstream(folder / "camera.yaml") << R"(%YAML:1.0
---
image_width: 768
image_height: 576
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500., 0., 384., 0., 501., 288., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.1, 0.2, 0.001, -0.001, 0. ]
)";
  std::ofstream(folder / "camera_from_sensor.txt") << "1 0 0 5\n0 1 0 -3\n0 0 1 -300\n0 0 0 1\n";
  std::ofstream(folder / "patient_from_tracker.txt") << "0 -1 0 100\n1 0 0 20\n0 0 1 30\n0 0 0 1\n";
  host::DisplacementField field;
  field.size = {3, 3, 3};
  field.displacement_mm.assign(27, Eigen::Vector3f(0, 0, 2));
  field.patient_from_lattice = Eigen::Translation3d(-50, -50, -50) * Eigen::Scaling(100.0);
  EXPECT_TRUE(host::write_field(folder / "field.mha", field));
  return folder;
}

std::string convert(const fs::path& folder, const std::string& ct, const fs::path& out) {
  return "convert " + folder.string() + " --ct " + ct + " --out " + out.string();
}

TEST(ConvertCommand, WhatTheWindowOf010KeptIsTakenUp) {
  const Scratch scratch;
  const std::string ct = testing::ct_of_tissue(scratch);
  const auto result = run("birdseye", convert(folder_of_010(scratch), ct, scratch / "new"));
  ASSERT_EQ(result.code, 0) << result.output;
  for (const char* unknown : {"by which tracker", "how far hand-eye is off is not known", "you answer for"})
    EXPECT_NE(result.output.find(unknown), std::string::npos) << result.output;
  const auto read = host::read_operation(scratch / "new");
  EXPECT_NE(result.output.find("--accept-unsigned"), std::string::npos) << result.output;
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->made_utc, "2026-11-22T10:00:00Z");
  ASSERT_TRUE(read->calibrated && read->registered && read->deformed);
  EXPECT_EQ(read->calibrated->scope.camera().fy_px, 501);
  EXPECT_EQ(read->calibrated->scope.camera_from_sensor().translation(), Eigen::Vector3d(5, -3, -300));
  EXPECT_FALSE(read->calibrated->scope.figures().held_out_px) << "what the fit leaves is no error held out";
  // patient_from_tracker takes the tracker's (x, y, z) to (100 - y, 20 + x, 30 + z).
  EXPECT_LT((read->registered->tracker_from_patient * Eigen::Vector3d(100, 20, 30)).norm(), 1e-12);
  EXPECT_EQ(read->registered->fiducials_in_patient_mm.size(), 4U);
  EXPECT_EQ(read->registered->fre_mm, 0.4);
  EXPECT_EQ(read->deformed->seen_rms_mm, 0.7);
  EXPECT_EQ(read->deformed->field.displacement_mm.front(), Eigen::Vector3f(0, 0, 2));
}

TEST(ConvertCommand, RefusesAnotherCtWhatIsMissingAndWhatIsNotOf010) {
  const Scratch scratch, other;
  const std::string ct = testing::ct_of_tissue(scratch);
  const fs::path folder = folder_of_010(scratch), out = scratch / "new";
  expect_refused("birdseye", convert(folder, testing::ct_of_tissue(other, 25), out), {"is of another CT"});
  expect_refused("birdseye", convert(folder, ct, folder), {"would be written over"});
  expect_refused("birdseye", convert(scratch.path(), ct, out), {"is not there"});
  fs::remove(folder / "camera_from_sensor.txt");
  expect_refused("birdseye", convert(folder, ct, out), {"camera_from_sensor.txt"});
  ASSERT_FALSE(fs::exists(out));
  ASSERT_EQ(run("birdseye", convert(folder_of_010(scratch), ct, out)).code, 0);
  expect_refused("birdseye", convert(out, ct, scratch / "newer"), {"is not of 0.1.0"});
  expect_refused("birdseye", convert(folder, ct, out), {"holds an operation"});
}

}  // namespace
}  // namespace birdseye
