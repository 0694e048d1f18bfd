#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "calibration/geometry/camera_model.hpp"
#include "host/case/registration_case.hpp"
#include "host/files/text_files.hpp"
#include "tests/support/command.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::contents_of;
using testing::expect_refused;
using testing::read_json;
using testing::run;
using testing::Scratch;

/// Three small views of a liver that moved by 8 mm, to be registered by similarity.
fs::path make_case(const Scratch& scratch) {
  const auto result = run("birdseye-sim", "case --out " + (scratch / "c").string() +
                                              " --seed 5 --views 3 --size 384x288 --dof 3 --amplitude-mm 8");
  EXPECT_EQ(result.code, 0) << result.output;
  const fs::path file = scratch / "c/case.toml";
  const std::string text = std::regex_replace(contents_of(file), std::regex("\"geometry\""), "\"gradient\"");
  std::ofstream(file) << text;
  return scratch / "c";
}

/// That case with one thing changed in its file.
fs::path changed(const Scratch& scratch, const std::string& from, const std::string& to) {
  if (!fs::exists(scratch / "c")) make_case(scratch);
  if (!fs::exists(scratch / "whole.toml")) fs::copy(scratch / "c/case.toml", scratch / "whole.toml");
  const std::string text = std::regex_replace(contents_of(scratch / "whole.toml"), std::regex(from), to,
                                              std::regex_constants::format_first_only);
  std::ofstream(scratch / "c/case.toml") << text;
  return scratch / "c/case.toml";
}

std::string arguments(const fs::path& file, const Scratch& scratch) {
  return "register views --case " + file.string() + " --out " + (scratch / "out").string();
}

TEST(RegisterViewsCommand, FindsADeformationFromSimulatedVideo) {
  const Scratch scratch;
  const fs::path folder = make_case(scratch);
  const auto result =
      run("birdseye", arguments(folder / "case.toml", scratch) + " --json " + (scratch / "r.json").string());
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = read_json(scratch / "r.json");
  EXPECT_GT(json["tre_before_mm_mean"], 3);
  EXPECT_LT(json["tre_after_mm_mean"], 1);
  EXPECT_LT(json["tre_after_mm_max"], 2);
  EXPECT_GT(json["similarity_after"], json["similarity_before"]);
  EXPECT_EQ(json["dof"], 3);
  EXPECT_EQ(json["views"], 3);
  EXPECT_GT(json["min_jacobian"], 0.3);
  EXPECT_LT(json["uncertainty_mm"], 3);
  EXPECT_EQ(json["verdict"], "pass") << json["reasons"];
  EXPECT_GT(json["epsilon_before"], 0.01);
  EXPECT_LT(json["epsilon_after"], 0.05 * json["epsilon_before"].get<double>());
  for (const char* name : {"field.mha", "report.html", "trace.svg", "view0_before.png", "view2_after.png",
                           "view1_difference_after.png", "view0_outlines.png", "view2_outlines.png"})
    EXPECT_GT(fs::file_size(scratch / "out" / name), 100U) << name;
  // Another command reads the field back.
  EXPECT_EQ(
      run("birdseye", "render --volume " + (folder / "ct.nii.gz").string() + " --deformation " +
                          (scratch / "out/field.mha").string() + " --size 64x48 --out " + (scratch / "p.png").string())
          .code,
      0);
}

TEST(RegisterViewsCommand, FindsItByGeometry) {
  const Scratch scratch;
  const auto file = changed(scratch, "optimiser = \"gradient\"", "optimiser = \"geometry\"");
  const auto result = run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = read_json(scratch / "r.json");
  EXPECT_EQ(json["optimiser"], "geometry");
  EXPECT_GT(json["tre_before_mm_mean"], 3);
  EXPECT_LT(json["surface_tre_after_mm_mean"], 1);
  EXPECT_GT(json["stereo_points"], 100);
  EXPECT_GT(json["min_jacobian"], 0.3);
  EXPECT_GT(json["uncertainty_mm"], 0);
  // What it says of each landmark's error is about what that is.
  double sum_mm2 = 0, expected_mm2 = 0;
  for (const nlohmann::json& landmark : json["landmarks"]) {
    sum_mm2 += std::pow(landmark["error_mm"].get<double>(), 2);
    expected_mm2 += std::pow(landmark["rms_mm"].get<double>(), 2);
  }
  EXPECT_LT(sum_mm2, 4 * expected_mm2);
  EXPECT_GT(json["expected_error"]["target"]["radius95_mm"], json["expected_error"]["target"]["rms_mm"]);
  for (const char* kind : {"seen", "hidden", "surface", "inside"})
    EXPECT_GT(json["expected_error"][kind]["rms_mm"], 0) << kind;
  EXPECT_TRUE(json["open"].is_array());
  EXPECT_TRUE(fs::exists(scratch / "out" / "expected_error.png"));
}

TEST(RegisterViewsCommand, GeometryPassesNothingWhereTwoViewsHaveEachOthersPose) {
  const Scratch scratch;
  make_case(scratch);
  const fs::path file = changed(scratch, "\"gradient\"([^]*)\"view0.txt\"([^]*)\"view1.txt\"",
                                "\"geometry\"$1\"view1.txt\"$2\"view0.txt\"");
  const auto result = run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
  ASSERT_NE(result.code, 2) << result.output;
  EXPECT_NE(read_json(scratch / "r.json")["verdict"], "pass") << result.output;
}

/// One of five poses is off by 4 mm across its line of sight: as the sensor shifted on the scope, say.
TEST(RegisterViewsCommand, GeometryHoldsOneViewAgainstTheOthers) {
  const Scratch scratch;
  const auto made = run("birdseye-sim", "case --out " + (scratch / "c").string() + " --seed 1 --size 384x288");
  ASSERT_EQ(made.code, 0) << made.output;
  const fs::path file = scratch / "c/case.toml";
  const auto good = run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
  ASSERT_EQ(good.code, 0) << good.output;
  const nlohmann::json json = read_json(scratch / "r.json");
  // An organ that the elastic hypothesis follows best, and far from which its modes must not fold either.
  EXPECT_GT(json["min_jacobian"], 0.5);
  EXPECT_LT(json["hidden_tre_after_mm_mean"], 0.5 * json["hidden_tre_before_mm_mean"].get<double>());
  ASSERT_TRUE(json.contains("held_out")) << json;
  EXPECT_LT(json["held_out"]["off_mm"], 0.5);
  const fs::path pose = scratch / "c" / fs::path(json["held_out"]["view"].get<std::string>()).replace_extension("txt");
  auto matrix = host::read_pose(pose);
  ASSERT_TRUE(matrix);
  (*matrix)(0, 3) += 4;
  std::ofstream(pose) << host::pose_text(*matrix);
  const auto bad = run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
  ASSERT_NE(bad.code, 2) << bad.output;
  EXPECT_NE(read_json(scratch / "r.json")["verdict"], "pass") << bad.output;
}

/// The poses err as a filtered tracker's do, so that the views' rays pass by one another by some pixels.
TEST(RegisterViewsCommand, GeometryFindsWhereTheCamerasWereWhenTheirPosesErr) {
  const Scratch scratch;
  const auto made = run("birdseye-sim", "case --out " + (scratch / "c").string() +
                                            " --seed 1 --size 384x288 --pose-noise-mm 0.3 --pose-noise-deg 0.15");
  ASSERT_EQ(made.code, 0) << made.output;
  const auto result =
      run("birdseye", arguments(scratch / "c/case.toml", scratch) + " --json " + (scratch / "r.json").string());
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = read_json(scratch / "r.json");
  EXPECT_EQ(json["verdict"], "pass") << json["reasons"];
  EXPECT_GT(json["stereo_points"], 300);
  EXPECT_LT(json["surface_tre_after_mm_mean"], 0.3 * json["surface_tre_before_mm_mean"].get<double>());
  EXPECT_LT(json["hidden_tre_after_mm_mean"], 0.5 * json["hidden_tre_before_mm_mean"].get<double>());
  // The sensor's errors, its turn with a lever to the eye.
  EXPECT_GT(json["poses"]["eye_sigma_mm"], 0.2);
  EXPECT_LT(json["poses"]["eye_sigma_mm"], 1.5);
  EXPECT_GT(json["poses"]["angle_sigma_deg"], 0.05);
  EXPECT_LT(json["poses"]["angle_sigma_deg"], 0.3);
  EXPECT_GT(json["per_view"][0]["eye_moved_mm"], 0.05);
  // What the views have wrong together is in the error that is to be expected.
  EXPECT_LT(json["tumour_tre_after_mm_mean"], json["expected_error"]["target"]["radius95_mm"]);
  EXPECT_GT(json["expected_error"]["target"]["rms_mm"], 0.4);
}

TEST(RegisterViewsCommand, FailsWhereNoViewSeesTheOrgan) {
  const Scratch scratch;
  const auto file = changed(scratch, "\"gradient\"", "\"geometry\"");
  for (const char* view : {"view0", "view1", "view2"})
    std::ofstream(scratch / "c" / (std::string(view) + ".txt")) << "1 0 0 0\n0 1 0 0\n0 0 1 -4000\n0 0 0 1\n";
  // An earlier registration's results must not be taken for this one's.
  fs::create_directories(scratch / "out");
  for (const char* name : {"field.mha", "report.html", "view0_after.png", "viewpoint_after.png"})
    std::ofstream(scratch / "out" / name) << "an earlier one's";
  std::ofstream(scratch / "out/result.json")
      << R"({"verdict": "pass", "reasons": ["of a version that listed no files"]})";
  const auto result = run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
  EXPECT_EQ(result.code, 3) << result.output;
  EXPECT_EQ(read_json(scratch / "r.json")["verdict"], "fail");
  for (const char* name : {"field.mha", "report.html", "view0_after.png"})
    EXPECT_FALSE(fs::exists(scratch / "out" / name)) << name;
  EXPECT_TRUE(fs::exists(scratch / "out/result.json"));
  EXPECT_TRUE(fs::exists(scratch / "out/viewpoint_after.png")) << "is somebody's own";
}

TEST(RegisterViewsCommand, FilesOfTheUsersOwnAreNotRemoved) {
  const Scratch scratch;
  const std::string command =
      "register views --case " + scratch.file("case.toml", "") + " --out " + scratch.path().string();
  for (const char* name : {"view0_before.png", "pose.txt"}) {
    const std::string own = scratch.file(name, "the user's own");
    expect_refused("birdseye", command, {name, "not of an earlier register views", "give another --out"});
    EXPECT_EQ(contents_of(own), "the user's own");
    fs::remove(own);
  }
  expect_refused("birdseye", command + " --json " + (scratch / "report.html").string(),
                 {"report.html", "holds this file by itself", "give --json another name"});
}

/// What a registration says of an organ that lies as in its CT. from and to: what of the case is changed, as changed()
/// has it.
nlohmann::json registered_at_rest(const std::string& from, const std::string& to) {
  const Scratch scratch;
  const auto made = run(
      "birdseye-sim", "case --out " + (scratch / "c").string() + " --seed 1 --views 4 --size 384x288 --no-deformation");
  EXPECT_EQ(made.code, 0) << made.output;
  const auto file = changed(scratch, from, to);
  const auto result = run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
  EXPECT_EQ(result.code, 0) << result.output;
  return read_json(scratch / "r.json");
}

void expect_nothing_moved(const nlohmann::json& json) {
  EXPECT_LT(json["surface_tre_after_mm_mean"], 0.3);
  EXPECT_EQ(json["verdict"], "pass") << json["reasons"];
  EXPECT_NE(json["reasons"][0].get<std::string>().find("nothing moved beyond"), std::string::npos) << json["reasons"];
}

TEST(RegisterViewsCommand, GeometryLeavesAnOrganThatDidNotMove) {
  const nlohmann::json json = registered_at_rest("optimiser = .*\n", "");
  EXPECT_EQ(json["optimiser"], "geometry") << "it is what is taken without a word";
  expect_nothing_moved(json);
}

TEST(RegisterViewsCommand, GradientLeavesAnOrganThatDidNotMove) {
  const nlohmann::json json =
      registered_at_rest("control_points = \\[.*\\]([^]*)\"geometry\"", "control_points = [3, 3, 3]$1\"gradient\"");
  EXPECT_EQ(json["dof"], 81);
  expect_nothing_moved(json);
}

TEST(RegisterViewsCommand, FindsItByValuesAlone) {
  const Scratch scratch;
  const auto file = changed(scratch, "optimiser = \"gradient\"",
                            "optimiser = \"simplex\"\nmost_evaluations = 60\nsimilarity = \"nmi\"");
  const auto result = run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
  ASSERT_NE(result.code, 2) << result.output;
  const nlohmann::json json = read_json(scratch / "r.json");
  EXPECT_EQ(json["optimiser"], "simplex");
  EXPECT_EQ(json["similarity"], "nmi");
  EXPECT_EQ(json["gradient_evaluations"], 0);
  EXPECT_LE(json["evaluations"], 62);
  EXPECT_LT(json["epsilon_after"], 0.3 * json["epsilon_before"].get<double>());
}

TEST(RegisterViewsCommand, StartsFromAField) {
  const Scratch scratch;
  const auto file =
      changed(scratch, "optimiser = \"gradient\"", "optimiser = \"gradient\"\ninitial = \"truth/field.mha\"");
  const auto result = run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
  ASSERT_NE(result.code, 2) << result.output;
  const nlohmann::json json = read_json(scratch / "r.json");
  EXPECT_LT(json["tre_before_mm_mean"], 0.1);
  EXPECT_LT(json["tre_after_mm_mean"], 1);
}

TEST(RegisterViewsCommand, RefusesCasesThatCannotBeUsed) {
  const Scratch scratch;
  for (const auto& [from, to, words] : std::vector<std::tuple<std::string, std::string, std::vector<std::string>>>{
           {"ct.nii.gz", "none.nii.gz", {"none.nii.gz", "does not exist"}},
           {"\"gradient\"", "\"guess\"", {"optimiser", "simplex"}},
           {"\"gradient\"", "\"simplex\"\nsimilarity = \"taste\"", {"similarity", "ncc"}},
           {"\"gradient\"", "\"gradient\"\nunknowns = \"vertices\"", {"unknowns", "simplex"}},
           {"\"gradient\"", "\"simplex\"\nrefine_pose = true", {"refine_pose", "gradient"}},
           {"\"gradient\"", "\"powell\"\nunknowns = \"corners\"", {"unknowns", "vertices"}},
           {"control_points = \\[.*\\]([^]*)\"gradient\"", "$1\"simplex\"", {"control_points", "auto"}},
           {"truth/control_points.json", "truth/truth.json", {"truth.json", "control_points.json"}},
           {"control_points = \\[.*\\]", "control_points = [0, 1, 1]", {"control_points"}},
           {"level = ", "refine_pose = 1\nlevel = ", {"refine_pose", "type"}},
           {"level = ", "pose_prior = -1.0\nlevel = ", {"pose_prior"}},
           {"\\[truth\\]", "[truth]\npose = \"camera.yaml\"", {"camera.yaml"}},
           {"view1.txt", "none.txt", {"view 1", "none.txt", "does not exist"}},
           {"label_values = \\[.*\\]", "label_values = []", {"label_values"}},
           {"image = \"view1.png\"", "image = \"camera.yaml\"", {"camera.yaml", "picture"}},
           {"camera_from_patient = \"view1.txt\"", "camera_from_patient = \"camera.yaml\"", {"camera.yaml"}},
           {"place_mm = \\[.*\\]", "place_mm = [4000, 2, 3]", {"[target] place_mm", "outside the CT"}},
           {"level = ", "levle = ", {"[model] levle", "not known", "level"}},
           {"\\[truth\\]", "[turth]", {"turth", "truth"}},
           {"\\[model\\]", "[model", {"case.toml"}}}) {
    expect_refused("birdseye", arguments(changed(scratch, from, to), scratch), words, scratch / "out");
  }
}

/// The case's landmarks of a kind, with where they are.
std::vector<host::Landmark> of_kind(const host::RegistrationCase& c, const std::string& kind, std::size_t most) {
  std::vector<host::Landmark> out;
  for (const host::Landmark& landmark : c.landmarks) {
    if (landmark.name.rfind(kind, 0) == 0 && out.size() < most) out.push_back(landmark);
  }
  return out;
}

/// As a case's file has a landmark, by the pixels of all views that have it in the picture, off by so many millimetres.
std::string named_in_views(const host::RegistrationCase& c, const host::Landmark& landmark, double off_mm) {
  std::string text = fmt::format("\n[[landmark]]\nname = \"{}\"\nplace_mm = [{:.6f}]\n", landmark.name,
                                 fmt::join(landmark.rest_mm, ", "));
  for (const host::VideoView& view : c.views) {
    const Eigen::Vector3d place = landmark.deformed_mm + off_mm * Eigen::Vector3d(0.6, -0.64, 0.48);
    const auto pixel = project(view.camera, view.camera_from_patient * place);
    if (!pixel || pixel->minCoeff() < 0 || pixel->x() > view.camera.width_px - 1 ||
        pixel->y() > view.camera.height_px - 1)
      continue;
    text += fmt::format("[[landmark.seen]]\nview = \"{}\"\npixel = [{:.6f}]\n", view.name, fmt::join(*pixel, ", "));
  }
  return text;
}

TEST(RegisterViewsCommand, GeometryTakesTouchesLandmarksAndOtherPlaces) {
  const Scratch scratch;
  const auto made = run("birdseye-sim", "case --out " + (scratch / "c").string() +
                                            " --seed 2 --views 3 --size 384x288 --dof 81 --touches 40");
  ASSERT_EQ(made.code, 0) << made.output;
  const fs::path file = scratch / "c/case.toml";
  const std::string touched = contents_of(file);
  ASSERT_NE(touched.find("points.csv"), std::string::npos);
  const auto registered = [&](const std::string& text) {
    std::ofstream(file) << text;
    const auto result = run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
    EXPECT_NE(result.code, 2) << result.output;
    return read_json(scratch / "r.json");
  };
  const std::string plain = std::regex_replace(touched, std::regex("\\[points\\]\npath = .*\n"), "");
  const nlohmann::json without = registered(plain), with = registered(touched);
  EXPECT_FALSE(without.contains("surface_points"));
  EXPECT_EQ(with["surface_points"]["used"], 40);
  EXPECT_LE(with["surface_points"]["thought_wrong"], 4);
  EXPECT_LT(with["surface_points"]["rms_mm"], 1.5);
  EXPECT_LT(with["hidden_tre_after_mm_mean"], without["hidden_tre_after_mm_mean"]);
  EXPECT_LT(with["expected_error"]["hidden"]["rms_mm"], without["expected_error"]["hidden"]["rms_mm"]);

  const auto c = host::read_case(file);
  ASSERT_TRUE(c) << c.error().what;
  std::string named = plain;
  for (const host::Landmark& landmark : of_kind(*c, "surface", 6)) named += named_in_views(*c, landmark, 0);
  const host::Landmark wrong = of_kind(*c, "surface", 7).back();
  named += named_in_views(*c, wrong, 20);
  std::ofstream vessels(scratch / "c/vessels.csv");
  vessels << "x_mm,y_mm,z_mm,sigma_mm,rest_x_mm,rest_y_mm,rest_z_mm\n";
  for (const host::Landmark& vessel : of_kind(*c, "vessel", 8))
    vessels << fmt::format("{:.6f}, 1, {:.6f}\n", fmt::join(vessel.deformed_mm, ","), fmt::join(vessel.rest_mm, ","));
  vessels.close();
  named += "\n[points]\npath = \"vessels.csv\"\n";
  const nlohmann::json matched = registered(named);
  ASSERT_EQ(matched["matched_points"]["used"], 15);
  EXPECT_LT(matched["matched_points"]["rms_mm"], 1.5);
  for (const nlohmann::json& one : matched["matched_points"]["each"])
    EXPECT_EQ(one["thought_wrong"].get<bool>(), one["name"] == wrong.name) << one;
  EXPECT_EQ(matched["matched_points"]["each"][14]["name"], "vessels.csv line 9");
  EXPECT_LT(matched["vessel_tre_after_mm_mean"], without["vessel_tre_after_mm_mean"]);
  EXPECT_LT(matched["expected_error"]["inside"]["rms_mm"], without["expected_error"]["inside"]["rms_mm"]);
}

TEST(RegisterViewsCommand, GeometryTellsTouchesThatTheViewsContradictAndCountsOneOnceHoweverOftenItIsGiven) {
  const Scratch scratch;
  const auto made =
      run("birdseye-sim", "case --out " + (scratch / "c").string() + " --seed 2 --views 4 --size 384x288 --dof 81");
  ASSERT_EQ(made.code, 0) << made.output;
  const fs::path file = scratch / "c/case.toml";
  const auto c = host::read_case(file);
  ASSERT_TRUE(c) << c.error().what;
  const std::string plain = contents_of(file) + "\n[points]\npath = \"lie.csv\"\n";
  const auto of_points = [&](const std::string& rows) {
    std::ofstream(scratch / "c/lie.csv") << "x_mm,y_mm,z_mm,sigma_mm\n" << rows;
    std::ofstream(file) << plain;
    return run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
  };
  // Each 8 mm off, away from the middle of the surface.
  const auto places = of_kind(*c, "surface", 20);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const host::Landmark& one : places) middle += one.deformed_mm / static_cast<double>(places.size());
  std::string off, repeated;
  for (const host::Landmark& one : places) {
    const Eigen::Vector3d place = one.deformed_mm + 8 * (one.deformed_mm - middle).normalized();
    off += fmt::format("{:.4f},1\n", fmt::join(place, ","));
  }
  const Eigen::Vector3d pressed = places.front().deformed_mm + 3 * (places.front().deformed_mm - middle).normalized();
  for (int i = 0; i < 300; ++i) repeated += fmt::format("{:.4f},0.01\n", fmt::join(pressed, ","));
  const auto told = of_points(off);
  const nlohmann::json lied = read_json(scratch / "r.json");
  EXPECT_NE(lied["verdict"], "pass") << told.output;
  EXPECT_GE(lied["surface_points"]["thought_wrong"], 10);
  EXPECT_NE(told.output.find("case.toml, [points], places of the surface"), std::string::npos) << told.output;
  EXPECT_NE(told.output.find("thought to be wrong"), std::string::npos) << told.output;
  EXPECT_GE(lied["reasons"].size(), 2U) << "what is known of the target stays: " << lied["reasons"];
  // One that is wrong is told, and is a slip of a hand.
  const auto slip = of_points(off.substr(0, off.find('\n') + 1));
  const nlohmann::json slipped = read_json(scratch / "r.json");
  EXPECT_EQ(slipped["surface_points"]["thought_wrong"], 1);
  EXPECT_EQ(slipped["reasons"].size(), 1U) << slipped["reasons"];
  EXPECT_NE(slip.output.find("1 of 1 is"), std::string::npos) << slip.output;
  (void)of_points(repeated.substr(0, repeated.find('\n') + 1));
  const double once_mm = read_json(scratch / "r.json")["tre_after_mm_mean"];
  (void)of_points(repeated);
  const nlohmann::json many = read_json(scratch / "r.json");
  EXPECT_EQ(many["surface_points"]["used"], 300);
  EXPECT_LT(many["tre_after_mm_mean"].get<double>(), once_mm + 0.3);
}

TEST(RegisterViewsCommand, RefusesLandmarksAndPlacesThatCannotBe) {
  const Scratch scratch;
  make_case(scratch);
  const std::string landmark = "[[landmark]]\nname = \"fissure\"\nplace_mm = [PLACE]\n";
  const std::string good = "[[landmark.seen]]\nview = \"view0.png\"\npixel = [100, 80]\n";
  const auto c = host::read_case(scratch / "c/case.toml");
  ASSERT_TRUE(c);
  const std::string place = fmt::format("{:.3f}", fmt::join(c->landmarks.front().rest_mm, ", "));
  const std::string points = "[points]\npath = \"points.csv\"\n", header = "x_mm,y_mm,z_mm,sigma_mm\n";
  std::string many = header;
  for (int i = 0; i < 301; ++i) many += "1,2,3,1\n";
  struct Refused {
    std::string text, csv;
    std::vector<std::string> words;
  };
  for (const auto& [text, csv, words] : std::vector<Refused>{
           {landmark, "", {"[landmark 0] seen", "is missing"}},
           {"[[landmark]]\nname = \"a\"\nplace_mm = [1, 2]\n" + good, "", {"[landmark 0] place_mm", "three numbers"}},
           {"[[landmark]]\nname = \"a\"\nplace_mm = [4000, 2, 3]\n" + good, "", {"a: place_mm", "outside the CT"}},
           {"landmark = [1]\n", "", {"[landmark 0] name", "missing"}},
           {"[landmark]\nname = \"a\"\n", "", {"[[landmark]]"}},
           {landmark + "sigma_mm = 0\n" + good, "", {"fissure", "sigma_mm is 0"}},
           {landmark + good + good, "", {"fissure", "view0.png is named twice"}},
           {landmark + good + landmark + good, "", {"[landmark 1]", "another landmark's"}},
           {landmark + "[[landmark.seen]]\nview = \"view9.png\"\npixel = [1, 2]\n", "", {"view9.png", "none of"}},
           {landmark + "[[landmark.seen]]\nview = \"view0.png\"\npixel = [384, 2]\n", "", {"view0.png", "384x288"}},
           {landmark + "[[landmark.seen]]\nview = \"view0.png\"\npixel = [3]\n", "", {"[landmark.seen 0] pixel"}},
           {landmark + good + "sigma_px = -1\n", "", {"view0.png", "sigma_px is -1"}},
           {landmark + good + "sigma = 1\n", "", {"[landmark.seen] sigma", "sigma_px"}},
           {"points = 3\n", "", {"[points] path", "missing"}},
           {points, "1,2,3,1\n", {"points.csv", "first line", "x_mm,y_mm,z_mm,sigma_mm"}},
           {points, "", {"points.csv", "empty"}},
           {points, header, {"points.csv", "no places"}},
           {points, header + "1,2,3\n", {"points.csv: line 2", "3 fields"}},
           {points, header + "1,2,3,1\n1,two,3,1\n", {"points.csv: line 3", "'two'"}},
           {points, header + "1,2,nan,1\n", {"points.csv: line 2", "'nan'"}},
           {points, header + "1,2,3,0\n", {"points.csv: line 2", "sigma_mm is 0"}},
           {points, header + "1,2,3,1e200\n", {"points.csv: line 2", "sigma_mm is 1e+200", "0.01 to 100"}},
           {points, header + "12 5,2,3,1\n", {"points.csv: line 2", "'12 5'"}},
           {points, "x_mm,y_mm,z_mm,sigma_mm,rest_x_mm,rest_y_mm,rest_z_mm\n1,2,3,1,4,,6\n", {"line 2", "'' is not"}},
           {points, many, {"points.csv: line 302", "300"}}}) {
    std::ofstream(scratch / "c/points.csv") << csv;
    const std::string filled = std::regex_replace(text, std::regex("PLACE"), place);
    // Before the tables, for a key of the file itself has to be there.
    const fs::path file = changed(scratch, "^([^]*)\"gradient\"([^]*)$",
                                  text[0] == '[' ? "$1\"geometry\"$2" + filled : filled + "$1\"geometry\"$2");
    expect_refused("birdseye", arguments(file, scratch), words, scratch / "out");
  }
  std::ofstream(scratch / "c/points.csv") << header + "1,2,3,1\n";
  for (const std::string& text : {points, std::regex_replace(landmark + good, std::regex("PLACE"), place)}) {
    const fs::path file = changed(scratch, "^([^]*)$", "$1" + text);
    expect_refused("birdseye", arguments(file, scratch), {"needs optimiser = \"geometry\""}, scratch / "out");
  }
}

TEST(RegisterViewsCommand, SaysWhenAllViewsAreFromOnePlace) {
  const Scratch scratch;
  const auto file = changed(scratch, "x^", "");
  // Half a pixel or so to the side of the first, with other noise.
  for (const char* name : {"view1", "view2"}) {
    const fs::path other = scratch / name;
    const auto made =
        run("birdseye-sim", "case --out " + other.string() +
                                " --seed 5 --views 3 --size 384x288 --dof 3 --amplitude-mm 8 --noise 1." + name[4]);
    ASSERT_EQ(made.code, 0) << made.output;
    fs::copy_file(other / "view0.png", scratch / "c" / (std::string(name) + ".png"),
                  fs::copy_options::overwrite_existing);
    std::istringstream in(contents_of(scratch / "c/view0.txt"));
    std::vector<double> m(16);
    for (double& number : m) in >> number;
    m[3] += name[4] == '1' ? 0.2 : -0.2;
    std::ofstream out(scratch / "c" / (std::string(name) + ".txt"));
    for (std::size_t i = 0; i < 16; ++i) out << m[i] << (i % 4 == 3 ? "\n" : " ");
  }
  const auto result = run("birdseye", arguments(file, scratch) + " --json " + (scratch / "r.json").string());
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = read_json(scratch / "r.json");
  EXPECT_EQ(json["verdict"], "marginal");
  EXPECT_NE(json["reasons"][0].get<std::string>().find("degrees apart"), std::string::npos) << json["reasons"];
}

TEST(RegisterViewsCommand, RefusesPicturesThatSayNothing) {
  const Scratch scratch;
  for (const int grey : {0, 90}) {
    const auto file = changed(scratch, "image = \"view1.png\"", "image = \"flat.pgm\"");
    std::ofstream flat(scratch / "c/flat.pgm");
    flat << "P2\n384 288\n255\n";
    for (int i = 0; i < 384 * 288; ++i) flat << grey << "\n";
    flat.close();
    expect_refused("birdseye", arguments(file, scratch), {"flat.pgm", "constant"}, scratch / "out");
  }
  // A mask that leaves nothing to compare.
  const auto file = changed(scratch, "mask = \"mask.png\"", "mask = \"flat.pgm\"");
  expect_refused("birdseye", arguments(file, scratch), {"view0.png", "overlap", "nothing is left"}, scratch / "out");
}

TEST(RegisterViewsCommand, RefusesAnInitialFieldThatFolds) {
  const Scratch scratch;
  const auto file = changed(scratch, "optimiser = \"gradient\"", "optimiser = \"gradient\"\ninitial = \"folds.mha\"");
  std::ofstream field(scratch / "c/folds.mha", std::ios::binary);
  field << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
           "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nElementSpacing = 10 10 10\nDimSize = 3 3 3\n"
           "ElementNumberOfChannels = 3\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n";
  // The middle goes 30 mm past its neighbours, which are 10 mm away.
  for (int point = 0; point < 27; ++point) {
    const float u[3] = {point == 13 ? 30.0F : 0.0F, 0, 0};
    field.write(reinterpret_cast<const char*>(u), sizeof u);
  }
  field.close();
  expect_refused("birdseye", arguments(file, scratch), {"folds.mha", "fold"}, scratch / "out");
}

TEST(RegisterViewsCommand, FailsWhereTwoViewsHaveEachOthersPose) {
  const Scratch scratch;
  const fs::path file = changed(scratch, "\"view0.txt\"([^]*)\"view1.txt\"", "\"view1.txt\"$1\"view0.txt\"");
  const auto result = run("birdseye", arguments(file, scratch));
  constexpr int kVerdictFail = 3;
  EXPECT_EQ(result.code, kVerdictFail) << result.output;
  EXPECT_NE(result.output.find("worse than before"), std::string::npos) << result.output;
}

TEST(RegisterViewsCommand, RefusesAPictureOfWhichNextToNothingCounts) {
  const Scratch scratch;
  make_case(scratch);
  std::string mask(384 * 288, '\0');
  for (std::size_t row = 140; row < 150; ++row) mask.replace(384 * row + 180, 10, 10, '\xff');
  std::ofstream(scratch / "c/small.pgm", std::ios::binary) << "P5\n384 288\n255\n" << mask;
  const fs::path file = changed(scratch, "\"mask.png\"", "\"small.pgm\"");
  expect_refused("birdseye", arguments(file, scratch), {"view0.png", "100", "masked"}, scratch / "out");
}

TEST(RegisterViewsCommand, RefusesTwoViewsThatAreTheSame) {
  const Scratch scratch;
  const auto file = changed(scratch, "image = \"view1.png\"[^]*?camera_from_patient = \"view1.txt\"",
                            "image = \"view0.png\"\ncamera = \"camera.yaml\"\ncamera_from_patient = \"view0.txt\"");
  expect_refused("birdseye", arguments(file, scratch), {"same picture"}, scratch / "out");
}

TEST(RegisterViewsCommand, RefusesACameraOfAnotherSize) {
  const Scratch scratch;
  const auto file = changed(scratch, "x^", "");
  const std::string camera =
      std::regex_replace(contents_of(scratch / "c/camera.yaml"), std::regex("image_width: *384"), "image_width: 640");
  std::ofstream(scratch / "c/camera.yaml") << camera;
  expect_refused("birdseye", arguments(file, scratch), {"camera", "640x288", "384x288"}, scratch / "out");
}

TEST(RegisterViewsCommand, FailsWhereAViewSeesNothing) {
  const Scratch scratch;
  const auto file = changed(scratch, "x^", "");
  std::ofstream(scratch / "c/view2.txt") << "1 0 0 0\n0 1 0 0\n0 0 1 -4000\n0 0 0 1\n";
  const auto result = run("birdseye", arguments(file, scratch));
  EXPECT_EQ(result.code, 3) << result.output;
  EXPECT_NE(result.output.find("view2.png: sees nothing of the organ"), std::string::npos) << result.output;
}

}  // namespace
}  // namespace birdseye
