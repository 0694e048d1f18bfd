#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "host/deform/transform_file.hpp"
#include "host/volume/import.hpp"
#include "tests/support/command.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using host::DisplacementField;
using testing::expect_refused;
using testing::read_json;
using testing::run;
using testing::Scratch;
using testing::small_ct;

/// As register views writes it: a push over small_ct's ball to the patient's right.
fs::path views(const Scratch& scratch) {
  DisplacementField field;
  field.size = {5, 5, 5};
  field.patient_from_lattice.linear() = 10 * Eigen::Matrix3d::Identity();
  field.patient_from_lattice.translation() = Eigen::Vector3d(-20, -20, -20);
  field.displacement_mm.assign(125, Eigen::Vector3f::Zero());
  field.displacement_mm[62].x() = 4;
  fs::create_directories(scratch / "views");
  EXPECT_TRUE(host::write_field(scratch / "views/field.mha", field));
  std::ofstream(scratch / "views/pose.txt") << "# patient_from_model\n1 0 0 2\n0 1 0 3\n0 0 1 4\n0 0 0 1\n";
  return scratch / "views";
}

constexpr const char* kPatientFromTracker = "0 -1 0 100\n1 0 0 20\n0 0 1 30\n0 0 0 1\n";

TEST(ExportCommand, ALandmarkLandsWhereTheRegistrationHasIt) {
  const Scratch scratch;
  const fs::path folder = views(scratch);
  const std::string ct = small_ct(scratch);
  const auto result = run("birdseye", "export --views " + folder.string() + " --registration " +
                                          scratch.file("fiducials.txt", kPatientFromTracker) + " --volume " + ct +
                                          " --out " + (scratch / "out").string());
  ASSERT_EQ(result.code, 0) << result.output;
  const auto json = read_json(scratch / "out/export.json");
  EXPECT_EQ(json["verdict"], "pass");
  EXPECT_LT(json["difference_mm_max"], 1e-3);
  // A landmark of the model at the field's middle: it was 4 mm to the left at rest, the organ is then moved by
  // pose.txt, and the tracker sees it turned. Each by hand.
  const Eigen::Vector3d rest_mm(4, 0, 0), patient_mm(2, 3, 4), tracker_mm(3 - 20, 100 - 2, 4 - 30);
  const auto mapped = host::transform_by_file(scratch / "out/registration.h5", {tracker_mm});
  ASSERT_TRUE(mapped) << mapped.error().what;
  EXPECT_LT(((*mapped)[0] - rest_mm).norm(), 1e-3) << (*mapped)[0].transpose();
  const auto rigid = host::transform_by_file(scratch / "out/rigid.tfm", {tracker_mm});
  ASSERT_TRUE(rigid) << rigid.error().what;
  EXPECT_LT((*rigid)[0].norm(), 1e-3) << (*rigid)[0].transpose();
  EXPECT_TRUE(host::read_field(scratch / "out/deformation.nrrd"));

  // The CT that was exported lies there without any transform, and holds what came from there.
  const auto rest = host::import_volume(ct), seen = host::import_volume(scratch / "out/ct.nrrd");
  ASSERT_TRUE(rest && seen) << (seen ? "" : seen.error().what);
  for (const Eigen::Vector3i& voxel :
       {Eigen::Vector3i(10, 10, 10), Eigen::Vector3i(4, 10, 10), Eigen::Vector3i(1, 2, 3)}) {
    const Eigen::Vector3d at = seen->patient_from_voxel * voxel.cast<double>();
    const auto from = host::transform_by_file(scratch / "out/registration.h5", {at});
    ASSERT_TRUE(from);
    const Eigen::Vector3d v = rest->patient_from_voxel.inverse() * (*from)[0];
    const Eigen::Vector3i near(static_cast<int>(std::lround(v.x())), static_cast<int>(std::lround(v.y())),
                               static_cast<int>(std::lround(v.z())));
    // Of the ball's two values, away from its border.
    EXPECT_EQ(seen->at(voxel.x(), voxel.y(), voxel.z()) > 0, rest->at(near.x(), near.y(), near.z()) > 0);
  }

  const auto still =
      run("birdseye", "export --frame patient --views " + folder.string() + " --out " + (scratch / "patient").string());
  ASSERT_EQ(still.code, 0) << still.output;
  const auto in_patient = host::transform_by_file(scratch / "patient/registration.h5", {patient_mm});
  ASSERT_TRUE(in_patient) << in_patient.error().what;
  EXPECT_LT(((*in_patient)[0] - rest_mm).norm(), 1e-3);
}

TEST(ExportCommand, NamesThePatientOnlyWhereThatIsAskedFor) {
  const Scratch scratch;
  const std::string id = "SIM1";  // as small_ct's files have it
  const std::string command = "export --registration " + scratch.file("fiducials.txt", kPatientFromTracker) +
                              " --volume " + small_ct(scratch) + " --out ";
  const auto result = run("birdseye", command + (scratch / "out").string());
  ASSERT_EQ(result.code, 0) << result.output;
  EXPECT_EQ(result.output.find(id), std::string::npos) << result.output;
  ASSERT_TRUE(fs::exists(scratch / "out/ct.nrrd"));
  for (const auto& entry : fs::recursive_directory_iterator(scratch / "out"))
    EXPECT_EQ(testing::contents_of(entry.path()).find(id), std::string::npos) << entry.path();
  ASSERT_EQ(run("birdseye", command + (scratch / "named").string() + " --identify").code, 0);
  EXPECT_NE(testing::contents_of(scratch / "named/export.json").find(id), std::string::npos);
}

TEST(ExportCommand, WhatCannotBeExportedIsRefused) {
  const Scratch scratch;
  const std::string out = " --out " + (scratch / "out").string();
  const std::string fiducials = scratch.file("f.txt", kPatientFromTracker);
  const auto refused = [&](const std::string& arguments, const std::vector<std::string>& words) {
    expect_refused("birdseye", "export " + arguments + out, words, scratch / "out");
  };
  refused("", {"--registration", "--views"});
  refused("--views " + scratch.path().string(), {"holds no field.mha"});
  refused("--registration " + (scratch / "none.txt").string(), {"none.txt"});
  refused("--registration " + scratch.file("bad.txt", "2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"), {"bad.txt"});
  refused("--views " + views(scratch).string(), {"--frame tracker needs --registration"});
  refused("--registration " + fiducials + " --volume " + (scratch / "none").string(), {"none"});
  expect_refused("birdseye", "export --registration " + fiducials + " --out " + scratch.file("file", ""), {"file"});
}

TEST(ExportCommand, ReplacesAnEarlierExportAndNothingElse) {
  const Scratch scratch;
  const std::string fiducials = scratch.file("f.txt", kPatientFromTracker), ct = small_ct(scratch);
  const fs::path out = scratch / "out";
  const std::string command = "export --registration " + fiducials + " --out " + out.string();
  ASSERT_EQ(run("birdseye", command + " --volume " + ct).code, 0);
  const std::string mine = (out / "deformation.nrrd").string();
  std::ofstream(mine) << "the user's own";
  expect_refused("birdseye", command, {mine, "not of an earlier export", "give another --out"});
  EXPECT_EQ(testing::contents_of(mine), "the user's own");
  EXPECT_TRUE(fs::exists(out / "ct.nrrd"));
  fs::remove(mine);
  const auto again = run("birdseye", command);
  EXPECT_EQ(again.code, 0) << again.output;
  EXPECT_NE(again.output.find("replaced an earlier export"), std::string::npos) << again.output;
  EXPECT_FALSE(fs::exists(out / "ct.nrrd")) << "this export writes none";
}

TEST(ExportCommand, FiguresAreNotWrittenOverWhatTheFolderHolds) {
  const Scratch scratch;
  const std::string fiducials = scratch.file("f.txt", kPatientFromTracker);
  const fs::path out = scratch / "out";
  for (const char* name : {"ct.nrrd", "export.json"}) {
    expect_refused("birdseye",
                   "export --registration " + fiducials + " --out " + out.string() + " --json " + (out / name).string(),
                   {name, "holds this file by itself", "give --json another name"});
  }
  EXPECT_FALSE(fs::exists(out));
}

TEST(ExportCommand, TheCtThatIsReadIsNotReplaced) {
  const Scratch scratch;
  const std::string fiducials = scratch.file("f.txt", kPatientFromTracker);
  const fs::path out = scratch / "out";
  const std::string command = "export --registration " + fiducials + " --out " + out.string() + " --volume ";
  ASSERT_EQ(run("birdseye", command + small_ct(scratch)).code, 0);
  const std::string before = testing::contents_of(out / "ct.nrrd");
  expect_refused("birdseye", command + (out / "ct.nrrd").string(), {"ct.nrrd", "is read", "give another --out"});
  EXPECT_EQ(testing::contents_of(out / "ct.nrrd"), before);
}

}  // namespace
}  // namespace birdseye
