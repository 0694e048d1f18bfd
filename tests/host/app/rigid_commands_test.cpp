// `volume markers` and `register fiducials`, from the outside.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/case/fiducial_checks.hpp"
#include "host/files/named_points.hpp"
#include "hw-sim/phantom/phantom.hpp"
#include "tests/support/command.hpp"
#include "tests/support/data.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::read_json;
using testing::run;
using testing::Scratch;

using Points = std::vector<Eigen::Vector3d>;

std::string text_of(const Points& points) {
  std::ostringstream text;
  text.precision(12);
  for (const Eigen::Vector3d& p : points) text << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  return text.str();
}

/// A rigid move, and what little a hand adds.
Points touched(const Points& points) {
  const Eigen::Affine3d move =
      Eigen::Translation3d(300, 20, -40) * Eigen::AngleAxisd(1.2, Eigen::Vector3d(1, -2, 0.5).normalized());
  Points out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto k = static_cast<double>(i);
    out.emplace_back(move * points[i] + 0.4 * Eigen::Vector3d(std::sin(5 * k), std::cos(3 * k), std::sin(7 * k + 1)));
  }
  return out;
}

const Points kMarkers{{-152, -50, 40}, {-78, -101, 106}, {-15, -113, 132},
                      {70, -105, 86},  {-99, -95, -38},  {34, -114, -56}};

TEST(RigidCommands, FromTheCtToTheTarget) {
  const Scratch scratch;
  hw_sim::PhantomSettings settings;
  settings.folder = scratch / "patient";
  ASSERT_TRUE(hw_sim::write_phantom(settings));
  const auto truth = hw_sim::read_phantom_truth(settings.folder);
  ASSERT_TRUE(truth);
  const std::string ct = (scratch / "patient/ct").string();
  const std::string points = (scratch / "m.txt").string();
  const auto found = run("birdseye", "volume markers " + ct + " --shape ball --diameter 8 --out " + points +
                                         " --picture " + (scratch / "m.png").string() + " --report " +
                                         (scratch / "m.html").string() + " --json " + (scratch / "m.json").string());
  ASSERT_EQ(found.code, 0) << found.output;
  const nlohmann::json markers = read_json(scratch / "m.json");
  EXPECT_EQ(markers["verdict"], "pass");
  ASSERT_EQ(markers["markers"].size(), truth->fiducials_mm.size());
  for (const Eigen::Vector3d& fiducial : truth->fiducials_mm) {
    double nearest = 1e9;
    for (const auto& m : markers["markers"]) {
      const auto c = m["centre_mm"].get<std::vector<double>>();
      nearest = std::min(nearest, (Eigen::Vector3d(c[0], c[1], c[2]) - fiducial).norm());
    }
    EXPECT_LT(nearest, 0.15);
  }
  EXPECT_GT(fs::file_size(scratch / "m.png"), 10'000U);
  const std::string markers_page = testing::contents_of(scratch / "m.html");
  EXPECT_NE(markers_page.find("<img src='data:image/png;base64,"), std::string::npos);
  EXPECT_NE(markers_page.find("6 markers found"), std::string::npos);

  // Pointed at, a few mm off, in an order of one's own.
  std::string near;
  const Points pointed(truth->fiducials_mm.rbegin(), truth->fiducials_mm.rbegin() + 3);
  for (const Eigen::Vector3d& p : pointed)
    near += fmt::format(" --near {:.1f},{:.1f},{:.1f}", p.x() + 3, p.y(), p.z() - 4);
  const std::string own = (scratch / "own.txt").string();
  const auto refined =
      run("birdseye", "volume markers " + ct + near + " --out " + own + " --json " + (scratch / "own.json").string());
  ASSERT_EQ(refined.code, 0) << refined.output;
  const auto places = host::read_points(own, host::PointsOf::patient);
  ASSERT_TRUE(places);
  ASSERT_EQ(places->size(), pointed.size());
  for (std::size_t i = 0; i < pointed.size(); ++i) EXPECT_LT(((*places)[i] - pointed[i]).norm(), 0.15);
  EXPECT_EQ(read_json(scratch / "own.json")["markers"][0]["kind"], "ball");
  const auto none = run("birdseye", "volume markers " + ct + near + " --near 0,0,0 --out " + own);
  EXPECT_EQ(none.code, 3) << none.output;
  EXPECT_NE(none.output.find("no marker within 10 mm of (0.0, 0.0, 0.0) mm"), std::string::npos) << none.output;

  // The file in RAS, whose places lie in tissue too.
  Points ras = *host::read_points(points, host::PointsOf::patient);
  const std::string as_touched = scratch.file("as_touched.txt", text_of(touched(ras)));
  for (Eigen::Vector3d& place : ras) place.head<2>() *= -1;
  const auto turned =
      run("birdseye", "register fiducials --ct " + scratch.file("ras.txt", text_of(ras)) + " --tracker " + as_touched +
                          " --volume " + ct + " --out " + (scratch / "ras_out.txt").string());
  EXPECT_EQ(turned.code, 3) << turned.output;
  EXPECT_NE(turned.output.find("the CT shows a marker at 0 of the 6 places of the CT's file, and at 6 with the other"),
            std::string::npos)
      << turned.output;

  // Five of six touched, in another order.
  Points five(truth->fiducials_mm.rbegin(), truth->fiducials_mm.rbegin() + 5);
  const std::string common = "register fiducials --ct " + points + " --tracker " +
                             scratch.file("t.txt", text_of(touched(five))) + " --match --targets " +
                             scratch.file("g.txt", text_of({truth->tumour_centre_mm})) + " --volume " + ct + " --map " +
                             (scratch / "map.png").string() + " --out " + (scratch / "p.txt").string() + " --report " +
                             (scratch / "r.html").string() + " --json " + (scratch / "r.json").string();
  const auto registered = run("birdseye", common);
  ASSERT_EQ(registered.code, 0) << registered.output;
  const nlohmann::json r = read_json(scratch / "r.json");
  EXPECT_EQ(r["verdict"], "pass") << r["reasons"];
  EXPECT_EQ(r["ct_of_touch"].size(), 5U);
  EXPECT_LT(r["fre_rms_mm"].get<double>(), 0.6);
  EXPECT_GT(r["fle_upper95_mm"].get<double>(), r["fle_rms_mm"].get<double>());
  ASSERT_EQ(r["tre_mm"].size(), 1U);
  EXPECT_LT(r["tre_mm"][0].get<double>(), 0.6);
  EXPECT_LE(r["tre_mm_min"].get<double>(), r["tre_mm"][0].get<double>());
  EXPECT_LE(r["tre_mm_median"].get<double>(), r["tre_mm_p95"].get<double>());
  EXPECT_LE(r["tre_mm_p95"].get<double>(), r["tre_mm_max"].get<double>());
  EXPECT_TRUE(r["outliers"].empty());
  EXPECT_GT(fs::file_size(scratch / "map.png"), 10'000U);
  const std::string page = testing::contents_of(scratch / "r.html");
  for (const char* words : {"Where the markers are", "By how much each touch is off", "The markers in the CT",
                            "Error to be expected", "target 1"})
    EXPECT_NE(page.find(words), std::string::npos) << words;
}

TEST(RigidCommands, ABlunderIsNamedAndASharperErrorPredictedWhereItIsKnown) {
  const Scratch scratch;
  Points wrong = touched(kMarkers);
  wrong[4] += Eigen::Vector3d(6, 6, -5);
  const std::string common = "register fiducials --ct " + scratch.file("c.txt", text_of(kMarkers)) + " --tracker " +
                             scratch.file("t.txt", text_of(wrong)) + " --targets " +
                             scratch.file("g.txt", "-50 -20 10\n") + " --out " + (scratch / "p.txt").string() +
                             " --json " + (scratch / "r.json").string();
  ASSERT_EQ(run("birdseye", common).code, 0);
  nlohmann::json r = read_json(scratch / "r.json");
  EXPECT_EQ(r["verdict"], "marginal");
  ASSERT_EQ(r["outliers"].size(), 1U) << r["reasons"];
  EXPECT_EQ(r["outliers"][0]["name"], "fiducial 5");
  EXPECT_NE(r["outliers"][0]["reason"].get<std::string>().find("from where the others put it"), std::string::npos);
  ASSERT_EQ(run("birdseye", common + " --fle 0.7").code, 0);
  EXPECT_EQ(read_json(scratch / "r.json")["fle_rms_mm"], 0.7);
  // A target far from markers that are badly touched.
  const auto far = run("birdseye", common + " --fle 14");
  EXPECT_EQ(far.code, 3);
  EXPECT_NE(far.output.find("predicted error at target 1"), std::string::npos);
}

TEST(RigidCommands, PelvisPhantomsSurfaceIsRefusedUnlessItsErrorIsKnownToBeLarger) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const Scratch scratch;
  const fs::path folder = *data / "fiducial_registration_pelvis_phantom";
  const std::string fiducials = "register fiducials --ct " +
                                (folder / "pelvis_cropped_ct_fiducial_markers.txt").string() + " --tracker " +
                                (folder / "Tracker_Fiducial_Markers.txt").string() + " --out " +
                                (scratch / "p.txt").string() + " --json " + (scratch / "r.json").string();
  const std::string common = fiducials + " --surface " + (folder / "pelvis_cropped_decimated.vtk").string() +
                             " --surface-points " + (folder / "Tracker_Surface_Scan.txt").string();
  ASSERT_EQ(run("birdseye", common).code, 0);
  const nlohmann::json refused = read_json(scratch / "r.json");
  EXPECT_EQ(refused["verdict"], "marginal");
  EXPECT_EQ(refused["surface"]["accepted"], false);
  EXPECT_NEAR(refused["surface"]["moved_mm"].get<double>(), 8.50, 0.02);
  std::ifstream published(folder / "Tracker_to_pelvis_cropped.txt");
  for (std::size_t i = 0; i < 16; ++i) {
    double expected = 0;
    published >> expected;
    EXPECT_NEAR(refused["patient_from_tracker"][i / 4][i % 4].get<double>(), expected, 1e-6);
  }
  ASSERT_EQ(run("birdseye", common + " --fle 8").code, 0);
  const nlohmann::json accepted = read_json(scratch / "r.json");
  EXPECT_EQ(accepted["surface"]["accepted"], true);
  EXPECT_EQ(accepted["patient_from_tracker"], accepted["surface"]["patient_from_tracker"]);
  EXPECT_LT(accepted["surface"]["rms_after_mm"].get<double>(), 0.4);
  // Its four markers make nearly a symmetric cross: which is which cannot be had from their distances.
  const auto matched = run("birdseye", fiducials + " --match");
  EXPECT_EQ(matched.code, 2);
  EXPECT_NE(matched.output.find("cannot be told apart"), std::string::npos) << matched.output;
}

TEST(RigidCommands, ARealAbdomenWithoutMarkersHasNone) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const Scratch scratch;
  for (const char* shape : {"ball --diameter 8", "ring --diameter 15 --hole 5", "post"}) {
    const auto result =
        run("birdseye", "volume markers " + (*data / "ct_abdomen/example_ct.nii.gz").string() + " --shape " + shape +
                            " --out " + (scratch / "m.txt").string() + " --json " + (scratch / "m.json").string());
    EXPECT_EQ(result.code, 3) << result.output;
    EXPECT_EQ(read_json(scratch / "m.json")["markers"].size(), 0U) << shape << result.output;
  }
}

TEST(RigidCommands, PointsThatDoNotFitAreNotWrittenAndTheReasonIsNamed) {
  const Scratch scratch;
  Points mirrored = kMarkers, metres = kMarkers, swapped = kMarkers;
  for (Eigen::Vector3d& point : mirrored) point.x() *= -1;
  for (Eigen::Vector3d& point : metres) point /= 1000;
  std::swap(swapped[0], swapped[1]);
  const std::string out = (scratch / "o.txt").string();
  for (const auto& [points, words] :
       {std::pair{mirrored, "is mirrored"}, {metres, "in metres"}, {swapped, "--match finds it"}}) {
    const auto result =
        run("birdseye", "register fiducials --ct " + scratch.file("p.txt", text_of(points)) + " --tracker " +
                            scratch.file("t.txt", text_of(touched(kMarkers))) + " --out " + out);
    EXPECT_EQ(result.code, 3) << result.output;
    EXPECT_NE(result.output.find(words), std::string::npos) << words << "\n" << result.output;
    EXPECT_NE(result.output.find("is not written: the verdict is fail"), std::string::npos) << result.output;
    EXPECT_FALSE(fs::exists(out));
    EXPECT_EQ(result.output.find("of an earlier run"), std::string::npos) << result.output;
  }
}

TEST(RigidCommands, OneFileTwiceAndOneMarkerTwiceAreRefused) {
  const Scratch scratch;
  const std::string out = (scratch / "o.txt").string(), markers = scratch.file("p.txt", text_of(kMarkers));
  const auto refuse = [&](const std::string& ct, const std::string& tracker, const std::vector<std::string>& words) {
    testing::expect_refused("birdseye", "register fiducials --ct " + ct + " --tracker " + tracker + " --out " + out,
                            words, out);
  };
  refuse(markers, markers, {"p.txt and ", "the same points to the last digit"});
  Points twice = kMarkers, touched_twice = touched(kMarkers);
  twice.push_back(twice[2] + Eigen::Vector3d(0.3, 0, 0));
  touched_twice.push_back(touched_twice[2]);
  refuse(scratch.file("twice.txt", text_of(twice)), scratch.file("t.txt", text_of(touched_twice)),
         {"twice.txt: points 3 and 7 are 0.30 mm apart, and are one marker"});
  refuse(markers + " --match", scratch.file("named.txt", "a 0 0 1\nb 90 0 1\nc 0 90 1\nd 0.5 0 1\n"),
         {"named.txt: points a and d are 0.50 mm apart"});
}

TEST(RigidCommands, AMirroredFileIsToldInAnyOrderToo) {
  const Scratch scratch;
  Points mirrored = kMarkers, cm = touched(kMarkers);
  for (Eigen::Vector3d& point : mirrored) point.x() *= -1;
  for (Eigen::Vector3d& point : cm) point /= 10;
  std::swap(mirrored[0], mirrored[3]);
  std::swap(cm[0], cm[3]);
  const std::string common = "register fiducials --out " + (scratch / "o.txt").string() + " --ct " +
                             scratch.file("p.txt", text_of(kMarkers)) + " --tracker ";
  testing::expect_refused("birdseye", common + scratch.file("m.txt", text_of(touched(mirrored))) + " --match",
                          {"only if they are mirrored"});
  testing::expect_refused("birdseye", common + scratch.file("cm.txt", text_of(cm)) + " --match",
                          {"if they are in cm: give mm"});
  // In the files' order, no single touch is to blame, and no more markers help.
  std::swap(mirrored[0], mirrored[3]);
  const auto told = run("birdseye", common + scratch.file("t.txt", text_of(touched(mirrored))) + " --targets " +
                                        scratch.file("targets.txt", "10 -60 30\n"));
  EXPECT_EQ(told.code, 3) << told.output;
  EXPECT_NE(told.output.find("mirrored"), std::string::npos) << told.output;
  EXPECT_EQ(told.output.find("again"), std::string::npos) << told.output;  // touch it, or them, again
  EXPECT_EQ(told.output.find("place markers"), std::string::npos) << told.output;
}

/// x y z a line, with a name before each where that is asked for.
std::string named_text(const Points& points, const std::vector<char>& names) {
  std::string text;
  for (std::size_t i = 0; i < points.size(); ++i)
    text += fmt::format("{} {:.9f} {:.9f} {:.9f}\n", names[i], points[i].x(), points[i].y(), points[i].z());
  return text;
}

TEST(RigidCommands, MarkersThatAnotherOrderFitsAsWellPassOnlyByName) {
  const Scratch scratch;
  Points prism;
  for (const double end : {0.0, 0.5}) {
    for (int k = 0; k < 3; ++k) {
      const double angle = end + k * 2.0943951023931953;  // a third of a turn
      prism.emplace_back(80 * std::cos(angle), 80 * std::sin(angle), end == 0 ? -60 : 60);
    }
  }
  const Points t = touched(prism), one_round{t[1], t[2], t[0], t[4], t[5], t[3]};
  const std::string out = " --out " + (scratch / "o.txt").string() + " --json " + (scratch / "r.json").string();
  const auto by_order = run("birdseye", "register fiducials --ct " + scratch.file("p.txt", text_of(prism)) +
                                            " --tracker " + scratch.file("t.txt", text_of(one_round)) + out);
  EXPECT_EQ(by_order.code, 0) << by_order.output;
  EXPECT_EQ(read_json(scratch / "r.json")["verdict"], "marginal");
  EXPECT_NE(by_order.output.find("cannot be told apart by their distances"), std::string::npos) << by_order.output;
  const auto by_name =
      run("birdseye", "register fiducials --ct " +
                          scratch.file("n.txt", named_text(prism, {'a', 'b', 'c', 'd', 'e', 'f'})) + " --tracker " +
                          scratch.file("m.txt", named_text(one_round, {'b', 'c', 'a', 'e', 'f', 'd'})) + out);
  EXPECT_EQ(by_name.code, 0) << by_name.output;
  EXPECT_EQ(read_json(scratch / "r.json")["verdict"], "pass") << by_name.output;
}

TEST(RigidCommands, AnErrorThatIsStatedTooSmallIsNotBelieved) {
  const Scratch scratch;
  const std::string common = "register fiducials --ct " + scratch.file("c.txt", text_of(kMarkers)) + " --tracker " +
                             scratch.file("t.txt", text_of(touched(kMarkers))) + " --targets " +
                             scratch.file("g.txt", "-50 -20 10\n") + " --out " + (scratch / "p.txt").string() +
                             " --json " + (scratch / "r.json").string();
  ASSERT_EQ(run("birdseye", common).code, 0);
  const nlohmann::json by_residuals = read_json(scratch / "r.json");
  EXPECT_EQ(by_residuals["verdict"], "pass");
  const auto refuted = run("birdseye", common + " --fle 0.1");
  EXPECT_EQ(refuted.code, 0);
  EXPECT_NE(refuted.output.find("times what --fle allows"), std::string::npos) << refuted.output;
  const nlohmann::json r = read_json(scratch / "r.json");
  EXPECT_EQ(r["verdict"], "marginal");
  EXPECT_EQ(r["tre_mm"], by_residuals["tre_mm"]) << "predicted by the larger";
  ASSERT_EQ(run("birdseye", common + " --fle 1").code, 0);
  EXPECT_EQ(read_json(scratch / "r.json")["verdict"], "pass");
}

TEST(RigidCommands, AnErrorThatIsStatedTooSmallIsNotBelievedOfFourMarkersEither) {
  const Scratch scratch;
  const Points four(kMarkers.begin() + 1, kMarkers.begin() + 5);
  const auto told = run("birdseye", "register fiducials --ct " + scratch.file("c.txt", text_of(four)) + " --tracker " +
                                        scratch.file("t.txt", text_of(touched(four))) + " --fle 0.05 --out " +
                                        (scratch / "p.txt").string() + " --json " + (scratch / "r.json").string());
  EXPECT_EQ(told.code, 0) << told.output;
  const nlohmann::json r = read_json(scratch / "r.json");
  EXPECT_EQ(r["verdict"], "marginal") << told.output;
  ASSERT_TRUE(r.contains("fle_times_over_stated")) << told.output;
  EXPECT_GT(r["fle_times_over_stated"], 3);
  EXPECT_GT(r["fle_rms_mm"], 0.1) << "by the residuals";
}

TEST(RigidCommands, AnotherScaleIsToldForItselfAndRefutesNoStatedError) {
  const Scratch scratch;
  Points ct = kMarkers;
  for (Eigen::Vector3d& place : ct) place *= 1.02;
  const auto told = run("birdseye", "register fiducials --ct " + scratch.file("c.txt", text_of(ct)) + " --tracker " +
                                        scratch.file("t.txt", text_of(touched(kMarkers))) + " --fle 0.7 --out " +
                                        (scratch / "p.txt").string() + " --json " + (scratch / "r.json").string());
  EXPECT_EQ(told.code, 3) << told.output;
  const nlohmann::json r = read_json(scratch / "r.json");
  EXPECT_EQ(r["verdict"], "fail") << told.output;
  EXPECT_FALSE(r.contains("fle_times_over_stated")) << told.output;
  EXPECT_EQ(r["fle_rms_mm"], 0.7);
  EXPECT_NE(told.output.find("lengths in the CT are 1.0"), std::string::npos) << told.output;
}

TEST(RigidCommands, TwoMarkersSeenAtTurnedPlacesAloneSayThatAFileIsInRas) {
  struct Case {
    std::size_t places, as_given, turned;
    bool ras;
  };
  for (const auto& [places, as_given, turned, ras] :
       {Case{6, 0, 2, true}, Case{6, 0, 6, true}, Case{6, 1, 5, true}, Case{6, 0, 1, false}, Case{6, 1, 2, false},
        Case{6, 4, 2, false}, Case{20, 0, 2, false}, Case{20, 0, 5, true}}) {
    const host::MarkersSeen seen{places, as_given, turned, true};
    EXPECT_EQ(seen.only_turned(), ras) << places << ' ' << as_given << ' ' << turned;
    EXPECT_FALSE(seen.only_turned() && seen.none());
  }
}

TEST(RigidCommands, OfSlicesTooFarApartTheSpacingIsToldAndNotTheOrder) {
  const Scratch scratch;
  Points ct = kMarkers;
  for (Eigen::Vector3d& place : ct) place.z() *= 1.25;
  const auto told =
      run("birdseye", "register fiducials --ct " + scratch.file("c.txt", text_of(ct)) + " --tracker " +
                          scratch.file("t.txt", text_of(touched(kMarkers))) + " --out " + (scratch / "o.txt").string());
  EXPECT_EQ(told.code, 3) << told.output;
  EXPECT_NE(told.output.find("lengths from head to foot in the CT are 1.2"), std::string::npos) << told.output;
  EXPECT_EQ(told.output.find("--match"), std::string::npos) << told.output;
}

TEST(RigidCommands, NamesPairWhateverTheirCase) {
  const Scratch scratch;
  std::string ct, tracker;
  const Points seen = touched(kMarkers);
  for (std::size_t i = 0; i < kMarkers.size(); ++i) {
    const Eigen::Vector3d &p = kMarkers[i], &t = seen[kMarkers.size() - 1 - i];
    ct += fmt::format("{} {} {} {}\n", static_cast<char>('A' + i), p.x(), p.y(), p.z());
    tracker += fmt::format("{} {} {} {}\n", static_cast<char>('f' - i), t.x(), t.y(), t.z());
  }
  const auto result = run("birdseye", "register fiducials --ct " + scratch.file("p.txt", ct) + " --tracker " +
                                          scratch.file("t.txt", tracker) + " --out " + (scratch / "o.txt").string());
  EXPECT_EQ(result.code, 0) << result.output;
  EXPECT_NE(result.output.find("paired by their names"), std::string::npos) << result.output;
}

TEST(RigidCommands, AFileOfAnEarlierRunIsNotTakenForThisRunsResult) {
  const Scratch scratch;
  Points mirrored = kMarkers;
  for (Eigen::Vector3d& point : mirrored) point.x() *= -1;
  const std::string older = scratch.file("o.txt", "older");
  const auto result =
      run("birdseye", "register fiducials --ct " + scratch.file("p.txt", text_of(mirrored)) + " --tracker " +
                          scratch.file("t.txt", text_of(touched(kMarkers))) + " --out " + older);
  EXPECT_EQ(result.code, 3) << result.output;
  EXPECT_NE(result.output.find("o.txt is not written: the verdict is fail; what is there is of an earlier run"),
            std::string::npos)
      << result.output;
  EXPECT_EQ(testing::contents_of(older), "older");
}

TEST(RigidCommands, RefuseBadInputInOneLine) {
  const Scratch scratch;
  const std::string points = scratch.file("p.txt", text_of(kMarkers));
  const std::string out = (scratch / "o.txt").string();
  const std::string fiducials = "register fiducials --ct " + points + " --tracker " + points + " --out " + out + " ";
  const std::string markers = "volume markers " + (scratch / "none").string() + " --out " + out + " ";
  for (const auto& [arguments, words] :
       {std::pair{fiducials + "--surface " + points, "--surface-points"},
        {fiducials + "--surface " + points + " --surface-points " + points, "is no STL, PLY, OBJ or VTK by its name"},
        {fiducials + "--surface " + (scratch / "no.ply").string() + " --surface-points " + points, "no such file"},
        {fiducials + "--targets " + (scratch / "no.txt").string(), "no such file"},
        {fiducials + "--volume " + (scratch / "no.mha").string(), "no such file"},
        {fiducials + "--fle -1", "--fle"},
        {fiducials + "--fle nan", "--fle"},
        {"register fiducials --ct " + points + " --tracker " + scratch.file("l.txt", "0 0 0\n1 1 1\n2 2 2\n") +
             " --match --out " + out,
         "on a line"},
        {markers + "--shape ball --diameter 8", "no such file"},
        {markers + "--shape cube --diameter 8", "--shape"},
        {markers + "--shape ball --diameter 0", "outer diameter"},
        {markers + "--shape ring --diameter 8", "hole"},
        {markers + "--shape cylinder --diameter 8 --hole 3", "height"},
        {markers + "--shape ball --diameter 8 --threshold 99999", "--threshold"},
        {markers + "--diameter 8", "--shape"},
        {markers + "--shape post --diameter -1", "outer diameter"},
        {markers + "--near 1,2", "X,Y,Z"},
        {markers + "--near 1,2,nan", "X,Y,Z"},
        {markers + "--near 1,2,3,4", "X,Y,Z"},
        {markers + "--near 1,2,3 --near 1:2:3", "X,Y,Z"}}) {
    const auto result = run("birdseye", arguments);
    EXPECT_EQ(result.code, 2) << arguments << result.output;
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
    EXPECT_NE(result.output.find(words), std::string::npos) << words << "\n" << result.output;
    EXPECT_FALSE(fs::exists(out));
  }
}

TEST(RigidCommands, AFileThatIsReadIsNotWrittenOver) {
  const Scratch scratch;
  const std::string ct = scratch.file("ct.txt", text_of(kMarkers)), read = text_of(touched(kMarkers));
  const std::string tracker = scratch.file("tracker.txt", read);
  for (const std::string& out : {"--out " + tracker, "--out " + (scratch / "r.txt").string() + " --json " + ct}) {
    const auto refused = run("birdseye", "register fiducials --ct " + ct + " --tracker " + tracker + " " + out);
    EXPECT_EQ(refused.code, 2) << refused.output;
    EXPECT_NE(refused.output.find("would be written over"), std::string::npos) << refused.output;
  }
  EXPECT_EQ(testing::contents_of(tracker), read);
  EXPECT_EQ(testing::contents_of(ct), text_of(kMarkers));
  EXPECT_FALSE(fs::exists(scratch / "r.txt"));
}

}  // namespace
}  // namespace birdseye
