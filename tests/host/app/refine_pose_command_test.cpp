#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <regex>
#include <sstream>

#include "calibration/geometry/transform.hpp"
#include "tests/support/command.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/matrix_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::contents_of;
using testing::read_json;
using testing::run;
using testing::Scratch;
using testing::write_matrix;

Eigen::Matrix4d matrix_of(const fs::path& path) {
  std::istringstream in(std::regex_replace(contents_of(path), std::regex("#.*"), ""));
  Eigen::Matrix4d m;
  for (int i = 0; i < 16; ++i) in >> m(i / 4, i % 4);
  EXPECT_TRUE(in) << path;
  return m;
}

Eigen::Vector3d of_length(double length, std::mt19937& rng) {
  std::normal_distribution<double> normal;
  return length * Eigen::Vector3d(normal(rng), normal(rng), normal(rng)).normalized();
}

/// Moves the poses of three small views of a liver alike by a motion about its landmarks' centre, and asks for it back.
nlohmann::json registered(const Scratch& scratch, const std::string& deformation, double shift_mm, double turn_deg) {
  const fs::path folder = scratch / "c";
  const auto made =
      run("birdseye-sim", "case --out " + folder.string() + " --seed 5 --views 3 --size 384x288 " + deformation);
  EXPECT_EQ(made.code, 0) << made.output;
  std::ifstream landmarks(folder / "truth/landmarks.csv");
  std::string line;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (std::getline(landmarks, line); std::getline(landmarks, line); ++count) {
    std::istringstream fields(line.substr(line.find(',') + 1));
    char comma = 0;
    Eigen::Vector3d p;
    fields >> p.x() >> comma >> p.y() >> comma >> p.z();
    sum += p;
  }
  std::mt19937 rng(17);
  const Eigen::Vector3d centre = sum / count, shift = of_length(shift_mm, rng);
  const Eigen::Matrix3d turn = rotation_exp(of_length(turn_deg * std::numbers::pi / 180, rng));
  const Transform<Patient, Patient> disturbance(turn, centre - turn * centre + shift);
  for (int n = 0; n < 3; ++n) {
    const fs::path path = folder / ("view" + std::to_string(n) + ".txt");
    write_matrix(path, matrix_of(path) * disturbance.matrix());
  }
  write_matrix(folder / "truth/pose.txt", disturbance.inverse().matrix());
  const std::string text = std::regex_replace(contents_of(folder / "case.toml"), std::regex("\"geometry\""),
                                              "\"gradient\"\nrefine_pose = true");
  std::ofstream(folder / "case.toml") << std::regex_replace(text, std::regex("\\[truth\\]"),
                                                            "[truth]\npose = \"truth/pose.txt\"");
  const auto result = run("birdseye", "register views --case " + (folder / "case.toml").string() + " --out " +
                                          (scratch / "out").string() + " --json " + (scratch / "r.json").string());
  EXPECT_EQ(result.code, 0) << result.output;
  nlohmann::json json = read_json(scratch / "r.json");
  // The file says the same as the report, and the field remains one of the deformation alone.
  const Eigen::Matrix4d written = matrix_of(scratch / "out/pose.txt");
  for (std::size_t i = 0; i < 16; ++i)
    EXPECT_EQ(json["pose_correction"]["patient_from_model"][i / 4][i % 4],
              written(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)));
  return json;
}

/// Reaches a target error of 0.6 to 0.8 mm, as without a disturbance. The pose itself only comes back to 1 or 2 mm and
/// 0.5 degrees: a deformation that bulges the whole liver one way looks much like a shift of it, and stands in for
/// some.
TEST(RefinePose, FindsADisturbanceTogetherWithADeformation) {
  const Scratch scratch;
  const auto json = registered(scratch, "--dof 3 --amplitude-mm 8", 5, 5);
  EXPECT_GT(json["tre_before_mm_mean"], 6);
  EXPECT_LT(json["tre_after_mm_mean"], 1.2);
  EXPECT_NEAR(json["pose_error_before"]["deg"], 5, 1e-3);
  EXPECT_LT(json["pose_error_after"]["deg"], 1);
  EXPECT_LT(json["pose_error_after"]["mm"], 3);
  EXPECT_EQ(json["verdict"], "pass") << json["reasons"];
}

/// Nothing moved and the poses are right: it stays within what the lamp and the texture feign (0.8 mm, 0.4 degrees,
/// 0.4 mm at the landmarks).
TEST(RefinePose, StaysWhereThePosesAreRight) {
  const Scratch scratch;
  const auto json = registered(scratch, "--no-deformation", 0, 0);
  EXPECT_LT(json["pose_correction"]["mm"], 1.8);
  EXPECT_LT(json["pose_correction"]["deg"], 0.9);
  EXPECT_LT(json["tre_after_mm_mean"], 1);
}

}  // namespace
}  // namespace birdseye
