#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <numbers>
#include <random>

#include "calibration/points/point_error.hpp"
#include "calibration/points/point_fit.hpp"
#include "host/registration/rigid/surface.hpp"
#include "host/registration/rigid/surface_refinement.hpp"
#include "tests/support/data.hpp"
#include "tests/support/points_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::read_points;

using Points = std::vector<Eigen::Vector3d>;

/// A lumpy body, 240 x 160 x 200 mm: no move but rest leaves it where it is.
Eigen::Vector3d on_body(double azimuth, double height) {
  const double lumps = 1 + 0.08 * std::sin(3 * azimuth) * std::cos(2 * height) + 0.05 * std::cos(2 * azimuth + height);
  return lumps * Eigen::Vector3d(120 * std::cos(azimuth) * std::cos(height), 80 * std::sin(azimuth) * std::cos(height),
                                 100 * std::sin(height));
}

/// The grid of a patch given by two parameters, in triangles.
template <typename Patch>
Surface mesh_of(int n, const Patch& patch) {
  Surface surface;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j)
      surface.vertices_mm.push_back(
          patch(static_cast<double>(i) / n, static_cast<double>(j) / n).template cast<float>());
  }
  const auto at = [n](int i, int j) { return static_cast<std::uint32_t>(i * (n + 1) + j); };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      surface.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      surface.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return surface;
}

Surface body() {
  return mesh_of(
      160, [](double u, double v) { return on_body(2 * std::numbers::pi * u, std::numbers::pi / 2 * (2 * v - 1)); });
}

/// Fiducials on the body's front, touched with an error; points of its front, touched with a smaller one.
struct TouchedBody {
  Transform<Tracker, Patient> truth{rotation_exp(Eigen::Vector3d(0.3, -2, 1)), Eigen::Vector3d(300, 20, -40)};
  Points fiducials{{-90, -60, 30}, {-20, -85, 70}, {60, -75, 40}, {80, -50, -50}, {-40, -80, -60}};
  Points touched, scan;
  calibration::PointFit<Patient, Tracker> fit;
  calibration::LocalisationError error;

  TouchedBody(unsigned seed, double fiducial_mm, double surface_mm, std::size_t points) {
    std::mt19937 rng(seed);
    std::normal_distribution<double> normal(0, 1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto noise = [&](double rms) {
      return Eigen::Vector3d(rms / std::sqrt(3.0) * Eigen::Vector3d(normal(rng), normal(rng), normal(rng)));
    };
    for (const Eigen::Vector3d& p : fiducials) touched.push_back(truth * p + noise(fiducial_mm));
    for (std::size_t i = 0; i < points; ++i) {
      const Eigen::Vector3d p = on_body(-std::numbers::pi / 2 + 1.2 * uniform(rng), uniform(rng));
      scan.push_back(truth * p + noise(surface_mm));
    }
    fit = *calibration::fit_points<Patient, Tracker>(fiducials, touched);
    error = calibration::localisation_error_of(fit.fre_rms_mm, fiducials.size());
  }
  [[nodiscard]] FiducialAnchor anchor() const { return {fit.to_from, touched, error.rms_mm, error.degrees_of_freedom}; }
  [[nodiscard]] double target_error_mm(const Transform<Patient, Tracker>& pose) const {
    const Eigen::Vector3d target(-30, 10, 5);
    return (pose * (truth * target) - target).norm();
  }
};

TEST(SurfaceIndex, FindsTheNearestPointOfTheTriangles) {
  const Surface surface = mesh_of(
      7, [](double u, double v) { return Eigen::Vector3d(50 * u, 40 * v, 10 * std::sin(5 * u) * std::cos(4 * v)); });
  const SurfaceIndex index(surface);
  std::mt19937 rng(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector3d p(80 * uniform(rng) - 15, 70 * uniform(rng) - 15, 60 * uniform(rng) - 30);
    const SurfacePoint nearest = index.nearest(p);
    EXPECT_NEAR((nearest.point_mm - p).norm(), nearest.distance_mm, 1e-9);
    // Against a fine sampling of every triangle.
    double sampled = 1e9;
    for (const auto& t : surface.triangles) {
      for (int a = 0; a <= 20; ++a) {
        for (int b = 0; a + b <= 20; ++b) {
          const Eigen::Vector3f q = surface.vertices_mm[t[0]] * (static_cast<float>(20 - a - b) / 20) +
                                    surface.vertices_mm[t[1]] * (static_cast<float>(a) / 20) +
                                    surface.vertices_mm[t[2]] * (static_cast<float>(b) / 20);
          sampled = std::min(sampled, (q.cast<double>() - p).norm());
        }
      }
    }
    EXPECT_LE(nearest.distance_mm, sampled + 1e-5);
    EXPECT_GE(nearest.distance_mm, sampled - 0.3);  // half the sampling's step
  }
}

TEST(SurfaceRefinement, BringsTheTargetNearer) {
  const Surface surface = body();
  double before = 0;
  double after = 0;
  int accepted = 0;
  constexpr int kTrials = 20;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    TouchedBody patient(seed, 3, 0.5, 200);
    // A stray tenth: the pointer lifted off between places.
    for (std::size_t i = 0; i < patient.scan.size(); i += 12) patient.scan[i] += Eigen::Vector3d(10, -15, 12);
    const auto refined = refine_on_surface(surface, patient.scan, patient.anchor());
    ASSERT_TRUE(refined) << refined.error().what;
    accepted += refined->accepted ? 1 : 0;
    before += patient.target_error_mm(patient.fit.to_from) / kTrials;
    after += patient.target_error_mm(refined->patient_from_tracker) / kTrials;
    EXPECT_LT(refined->rms_after_mm, refined->accepted ? 0.45 : 100) << refined->told;
    EXPECT_EQ(refined->kept, std::ceil(0.9 * static_cast<double>(refined->places)));
    EXPECT_GE(refined->places, 180U);
  }
  EXPECT_GE(accepted, kTrials - 1);  // one in a hundred is refused by chance
  EXPECT_LT(after, 0.35 * before) << before;
}

TEST(SurfaceRefinement, WhatAPlaneLeavesOpenStaysWithTheFiducials) {
  const Surface plane =
      mesh_of(20, [](double u, double v) { return Eigen::Vector3d(400 * u - 200, 0, 400 * v - 200); });
  TouchedBody patient(5, 0.6, 0, 0);
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> uniform(-80, 80);
  for (int i = 0; i < 100; ++i)
    patient.scan.emplace_back(patient.truth * Eigen::Vector3d(uniform(rng), 0, uniform(rng)));
  const auto refined = refine_on_surface(plane, patient.scan, patient.anchor());
  ASSERT_TRUE(refined) << refined.error().what;
  EXPECT_TRUE(refined->accepted) << refined->told;
  EXPECT_LT(refined->rms_after_mm, 0.05);  // five fiducials weigh against a hundred points
  const Eigen::Vector3d middle = patient.truth * Eigen::Vector3d(0, -70, 0);
  const Eigen::Vector3d moved = refined->patient_from_tracker * middle - patient.fit.to_from * middle;
  EXPECT_LT(std::hypot(moved.x(), moved.z()), 0.15);
}

TEST(SurfaceRefinement, RefusesAnotherSurface) {
  const Surface surface = body();
  TouchedBody patient(7, 0.6, 0.3, 200);
  const Eigen::Vector3d shift = patient.truth.rotation() * Eigen::Vector3d(0, 8, 0);
  for (Eigen::Vector3d& p : patient.scan) p += shift;
  const auto refined = refine_on_surface(surface, patient.scan, patient.anchor());
  ASSERT_TRUE(refined);
  EXPECT_FALSE(refined->accepted);
  EXPECT_NEAR(refined->moved_mm, 8, 1);
  EXPECT_EQ(refined->patient_from_tracker.matrix(), patient.fit.to_from.matrix());
  EXPECT_NE(refined->told.find("is refused"), std::string::npos);
  EXPECT_EQ(refine_on_surface(surface, std::span(patient.scan).first(9), patient.anchor()).error().code,
            Errc::degenerate);
  patient.scan[3].x() = NAN;
  EXPECT_EQ(refine_on_surface(surface, patient.scan, patient.anchor()).error().code, Errc::bad_value);
}

TEST(SurfaceRefinement, ACoordinateOutOfThisWorldIsSaidToBe) {
  TouchedBody patient(3, 0.6, 0.3, 60);
  patient.scan[7].x() = 2e9;
  const auto refused = refine_on_surface(body(), patient.scan, patient.anchor());
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::bad_value);
  EXPECT_NE(refused.error().what.find("thousand kilometres"), std::string::npos) << refused.error().what;
}

TEST(SurfaceRefinement, OneTouchManyTimesIsNoSurfaceAndWeighsOnce) {
  const Surface surface = body();
  TouchedBody patient(3, 0.6, 0.3, 60);
  const auto plain = refine_on_surface(surface, patient.scan, patient.anchor());
  ASSERT_TRUE(plain) << plain.error().what;
  const Points thirty(30, patient.scan[0]);
  const auto one = refine_on_surface(surface, thirty, patient.anchor());
  ASSERT_FALSE(one) << one->told;
  EXPECT_EQ(one.error().code, Errc::degenerate);
  EXPECT_NE(one.error().what.find("30 points on the surface (places 3 mm apart: 1): touch at least 10"),
            std::string::npos)
      << one.error().what;
  // Held still at one place for ten times as many as all others together, pressed in, by a hand that trembles.
  Points held = patient.scan;
  std::mt19937 rng(4);
  std::normal_distribution<double> tremble(0, 0.2);
  const Eigen::Vector3d in = patient.truth.rotation() * Eigen::Vector3d(0, 1.5, 0);
  for (int i = 0; i < 600; ++i)
    held.emplace_back(patient.scan[0] + in + Eigen::Vector3d(tremble(rng), tremble(rng), tremble(rng)));
  const auto weighed = refine_on_surface(surface, held, patient.anchor());
  ASSERT_TRUE(weighed) << weighed.error().what;
  EXPECT_EQ(weighed->points, 660U);
  EXPECT_LE(weighed->places, plain->places + 2);
  const Eigen::Vector3d target = patient.truth * Eigen::Vector3d(-30, 10, 5);
  EXPECT_LT((weighed->surface_pose * target - plain->surface_pose * target).norm(), 0.2);
}

TEST(SurfaceFile, EveryFormatGivesTheSameTriangles) {
  const birdseye::testing::Scratch scratch;
  const std::string ply_head =
      "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  std::string binary = "ply\nformat binary_little_endian 1.0\n" + ply_head;
  const float xyz[12] = {0, 0, 0, 10, 0, 0, 10, 20, 0, 0, 20, 5};
  binary.append(reinterpret_cast<const char*>(xyz), sizeof xyz);
  binary += '\4';
  const int corners[4] = {0, 1, 2, 3};
  binary.append(reinterpret_cast<const char*>(corners), sizeof corners);
  for (const std::string& path :
       {scratch.file("a.ply", "ply\nformat ascii 1.0\n" + ply_head + "0 0 0\n10 0 0\n10 20 0\n0 20 5\n4 0 1 2 3\n"),
        scratch.file("b.ply", binary), scratch.file("c.obj", "v 0 0 0\nv 10 0 0\nv 10 20 0\nv 0 20 5\nf 1 2 3 4\n"),
        scratch.file("d.vtk",
                     "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 10 0 0 10 20 "
                     "0\n0 20 5\nPOLYGONS 1 5\n4 0 1 2 3\n")}) {
    const auto surface = read_surface(path);
    ASSERT_TRUE(surface) << path << surface.error().what;
    EXPECT_EQ(surface->triangles.size(), 2U) << path;
    EXPECT_EQ(surface->vertices_mm.size(), 4U) << path;
    const SurfaceIndex index(*surface);
    EXPECT_NEAR(index.nearest({9, 1, 3}).distance_mm, 3, 0.01) << path;
  }
}

/// A wall of two triangles, 10 x 20 mm, in each form that is read; last: the z of its last corner.
std::map<std::string, std::string> walls(const std::string& last = "5") {
  const std::string head =
      "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  const auto bytes = [](const auto& values, bool turned) {
    std::string out;
    for (const auto value : values) {
      std::string one(reinterpret_cast<const char*>(&value), sizeof value);
      if (turned) std::reverse(one.begin(), one.end());
      out += one;
    }
    return out;
  };
  const std::array<float, 12> xyz{0, 0, 0, 10, 0, 0, 10, 20, 0, 0, 20, 5};
  const std::array<int, 4> first{3, 0, 1, 2}, second{3, 0, 2, 3};
  const auto face = [&](const auto& corners, bool turned) { return '\3' + bytes(corners, turned).substr(4); };
  const auto triangles = [&](bool turned) { return face(first, turned) + face(second, turned); };
  const std::string vtk = "# vtk DataFile Version 3.0\nx\n";
  const std::string corner = "vertex 0 0 0\nvertex 10 20 0\nvertex ";
  const auto facet = [&](const std::string& third) {
    return "facet normal 0 0 0\nouter loop\n" + corner + third + "\nendloop\nendfacet\n";
  };
  std::string stl = std::string(80, 'x') + bytes(std::array<std::uint32_t, 1>{2}, false);
  for (const std::array<float, 3>& third : {std::array<float, 3>{10, 0, 0}, {0, 20, 5}})
    stl += bytes(std::array<float, 9>{0, 0, 0, 0, 0, 0, 10, 20, 0}, false) + bytes(third, false) + std::string(2, '\0');
  return {
      {"ascii.ply", "ply\nformat ascii 1.0\n" + head + "0 0 0\n10 0 0\n10 20 0\n0 20 " + last + "\n3 0 1 2\n3 0 2 3\n"},
      {"little.ply", "ply\nformat binary_little_endian 1.0\n" + head + bytes(xyz, false) + triangles(false)},
      {"big.ply", "ply\nformat binary_big_endian 1.0\n" + head + bytes(xyz, true) + triangles(true)},
      {"lines.obj", "v 0 0 0\nv 10 0 0\nv 10 20 0\nv 0 20 " + last + "\nf 1 2 3\nf 1 3 4\n"},
      {"ascii.stl", "solid wall\n" + facet("10 0 0") + facet("0 20 " + last) + "endsolid\n"},
      {"binary.stl", stl},
      {"ascii.vtk", vtk + "ASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 10 0 0 10 20 0 0 20 " + last +
                        "\nPOLYGONS 2 8\n3 0 1 2\n3 0 2 3\n"},
      {"binary.vtk", vtk + "BINARY\nDATASET POLYDATA\nPOINTS 4 float\n" + bytes(xyz, true) + "\nPOLYGONS 2 8\n" +
                         bytes(first, true) + bytes(second, true)}};
}

TEST(SurfaceFile, TakesNothingFromOtherFiles) {
  const birdseye::testing::Scratch scratch;
  (void)scratch.file("skin.mtl", "newmtl skin\nKd 1 0 0\n");
  const auto coloured = read_surface(scratch.file(
      "coloured.obj", "mtllib skin.mtl\nv 0 0 0\nv 10 0 0\nv 10 20 0\nv 0 20 5\nusemtl skin\nf 1 2 3\nf 1 3 4\n"));
  ASSERT_TRUE(coloured) << coloured.error().what;
  EXPECT_EQ(coloured->triangles.size(), 2U) << "a material is no part of a surface";
}

/// Assimp reads some fifty forms, and leaves it to its caller to move, turn and scale what they hold.
TEST(SurfaceFile, TakesNoOtherFormWhateverItsName) {
  const birdseye::testing::Scratch scratch;
  const std::string off = "OFF\n4 2 0\n0 0 0\n10 0 0\n10 20 0\n0 20 5\n3 0 1 2\n3 0 2 3\n";
  const std::string amf =
      "<?xml version=\"1.0\"?>\n<amf unit=\"inch\"><object id=\"0\"><mesh><vertices>"
      "<vertex><coordinates><x>0</x><y>0</y><z>0</z></coordinates></vertex>"
      "<vertex><coordinates><x>9</x><y>0</y><z>0</z></coordinates></vertex>"
      "<vertex><coordinates><x>0</x><y>9</y><z>0</z></coordinates></vertex></vertices><volume>"
      "<triangle><v1>0</v1><v2>1</v2><v3>2</v3></triangle></volume></mesh></object></amf>\n";
  for (const auto& [name, text] : {std::pair{"wall.off", off}, {"wall.amf", amf}, {"wall", walls()["ascii.ply"]}}) {
    const std::string path = scratch.file(name, text);
    const auto surface = read_surface(path);
    ASSERT_FALSE(surface) << name;
    EXPECT_EQ(surface.error().what,
              path + ": is no STL, PLY, OBJ or VTK by its name; export it as PLY, STL, OBJ or VTK polygons");
  }
  for (const std::string extension : {"stl", "ply", "vtk"}) {
    for (const std::string& text : {off, amf, walls()["lines.obj"]}) {
      const std::string path = scratch.file("named." + extension, text);
      const auto surface = read_surface(path);
      ASSERT_FALSE(surface) << extension << " of " << text;
      EXPECT_EQ(surface.error().what.find(path + ": is named ." + extension + " and does not begin as one does"), 0U)
          << surface.error().what;
    }
  }
  for (const std::string& text : {off, amf, walls()["ascii.vtk"]})
    EXPECT_FALSE(read_surface(scratch.file("named.obj", text))) << text;
  const auto upper = read_surface(scratch.file("WALL.VTK", walls()["ascii.vtk"]));
  ASSERT_TRUE(upper) << upper.error().what;
  EXPECT_EQ(upper->triangles.size(), 2U);
}

TEST(SurfaceFile, OneThatSaysItIsInRasIsRefusedWithTheRemedy) {
  const birdseye::testing::Scratch scratch;
  const auto forms = [](const std::string& remark) {
    auto said = walls();
    const auto put = [&said](const char* name, const std::string& at, const std::string& what, std::size_t length) {
      std::string& text = said[name];
      text.replace(text.find(at), length, what);
    };
    put("binary.stl", std::string(60, 'x'), "3D Slicer output. " + remark + ' ', 19 + remark.size());
    put("ascii.stl", "solid wall", "solid 3D Slicer output. " + remark, 10);
    for (const char* name : {"ascii.ply", "little.ply", "big.ply"})
      put(name, "element", "comment " + remark + "\nelement", 7);
    put("lines.obj", "v", "# 3D Slicer output. " + remark + "\nv", 1);
    for (const char* name : {"ascii.vtk", "binary.vtk"}) put(name, "\nx\n", "\n3D Slicer output. " + remark + "\n", 3);
    return said;
  };
  for (const auto& [name, text] : forms("SPACE=RAS")) {
    const std::string path = scratch.file(name, text);
    const auto surface = read_surface(path);
    ASSERT_FALSE(surface) << name;
    EXPECT_EQ(surface.error().what.find(path + ": says SPACE=RAS, and a surface is read in LPS; save it again in LPS"),
              0U)
        << surface.error().what;
  }
  for (const char* remark : {"SPACE=LPS", "COLOR_SPACE=sRGB"}) {
    for (const auto& [name, text] : forms(remark)) {
      const auto surface = read_surface(scratch.file(name, text));
      ASSERT_TRUE(surface) << name << " " << remark << " " << surface.error().what;
      EXPECT_EQ(surface->triangles.size(), 2U) << name;
    }
  }
}

TEST(SurfaceFile, RefusesWhatIsNoSurfaceInOneLine) {
  const birdseye::testing::Scratch scratch;
  const auto expect = [](const std::string& path, const char* words) {
    const auto surface = read_surface(path);
    ASSERT_FALSE(surface) << path;
    EXPECT_EQ(surface.error().what.find(path), 0U);
    EXPECT_NE(surface.error().what.find(words), std::string::npos) << surface.error().what;
  };
  expect((scratch / "none.ply").string(), "no such file");
  expect(scratch.path().string(), "no such file");
  expect(scratch.file("text.ply", "what"), "is named .ply and does not begin as one does");
  expect(scratch.file("text.vtk", "what"), "is named .vtk and does not begin as one does");
  expect(scratch.file("text.obj", "what\n"), "no triangles");
  expect(scratch.file("cut.ply", "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\n"), "end_header");
  expect(scratch.file("index.vtk",
                      "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 10 0 0 "
                      "10 20 0\nPOLYGONS 1 4\n3 0 1 9\n"),
         "no triangles");
  expect(scratch.file("cut.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 300000000 float\n0 0"),
         "is cut short");
  expect(scratch.file("huge.vtk",
                      "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 10 0 0 "
                      "10 20 0\nPOLYGONS 1 900000000\n900000000 0 1 2\n"),
         "is cut short");
}

TEST(SurfaceFile, OneThatIsCutShortIsNotTakenForASmallerOne) {
  const birdseye::testing::Scratch scratch;
  for (const auto& [name, text] : walls()) {
    const auto whole = read_surface(scratch.file(name, text));
    ASSERT_TRUE(whole) << whole.error().what;
    EXPECT_EQ(whole->triangles.size(), 2U) << name;
    for (const std::size_t missing : {1U, 3U, 9U, 17U, 30U}) {
      if (name == "lines.obj" && text[text.size() - missing - 1] == '\n') continue;  // where nothing tells
      if (name == "ascii.stl" && missing == 1) continue;
      const auto cut = read_surface(scratch.file(name, text.substr(0, text.size() - missing)));
      ASSERT_FALSE(cut) << name << " without " << missing;
      EXPECT_EQ(cut.error().what.find((scratch / name).string() + ": is cut short"), 0U) << cut.error().what;
    }
  }
}

TEST(SurfaceFile, OfVtksNewerVersionTheRemedyIsSaid) {
  const birdseye::testing::Scratch scratch;
  const auto newer = read_surface(scratch.file(
      "newer.vtk",
      "# vtk DataFile Version 5.1\nvtk output\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 9 0 0 0 9 0\n"
      "POLYGONS 2 3\nOFFSETS vtktypeint64\n0 3\nCONNECTIVITY vtktypeint64\n0 1 2\n"));
  ASSERT_FALSE(newer);
  EXPECT_NE(newer.error().what.find("save it as version 4.2"), std::string::npos) << newer.error().what;
}

TEST(SurfaceFile, ACornerThatIsFarAwayIsRefusedHoweverItIsWritten) {
  const birdseye::testing::Scratch scratch;
  for (const char* far : {"99999999999999999999", "-99999999999999999999.5", "1e6", "100001"}) {
    for (const auto& [name, text] : walls(far)) {
      if (!name.starts_with("ascii") && name != "lines.obj") continue;
      const auto surface = read_surface(scratch.file(name, text));
      ASSERT_FALSE(surface) << name << " " << far;
      const std::string& what = surface.error().what;
      EXPECT_EQ(what.find((scratch / name).string() + ": "), 0U) << what;
      EXPECT_TRUE(what.find("has a coordinate of more than 18 digits") != std::string::npos ||
                  what.find("is more than 100 m from the origin") != std::string::npos)
          << what;
    }
  }
  for (const auto& [name, text] : walls("5.00000000000000000000000001"))
    EXPECT_TRUE(read_surface(scratch.file(name, text))) << name;
}

TEST(SurfaceRefinement, PelvisPhantomAsPublishedAndBeyond) {
  const auto data = birdseye::testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto folder = *data / "fiducial_registration_pelvis_phantom";
  const auto surface = read_surface(folder / "pelvis_cropped_decimated.vtk");
  ASSERT_TRUE(surface) << surface.error().what;
  EXPECT_EQ(surface->vertices_mm.size(), 47831U);
  EXPECT_EQ(surface->triangles.size(), 93003U);
  const Points scan = read_points(folder / "Tracker_Surface_Scan.txt");
  EXPECT_EQ(scan.size(), 2000U);
  const Points touched = read_points(folder / "Tracker_Fiducial_Markers.txt");
  const Points ct = read_points(folder / "pelvis_cropped_ct_fiducial_markers.txt");
  const auto fit = calibration::fit_points<Patient, Tracker>(ct, touched);
  ASSERT_TRUE(fit);
  const auto error = calibration::localisation_error_of(fit->fre_rms_mm, 4);
  const auto refined =
      refine_on_surface(*surface, scan, {fit->to_from, touched, error.rms_mm, error.degrees_of_freedom});
  ASSERT_TRUE(refined) << refined.error().what;
  // The recording's own surface lies 8.5 mm beside its fiducials, in one direction: theirs moved them by 8.02 mm.
  EXPECT_FALSE(refined->accepted) << refined->told;
  EXPECT_NEAR(refined->moved_mm, 8.50, 0.02);
  EXPECT_NEAR(refined->allowed_mm, 1.25, 0.01);
  EXPECT_NEAR(refined->rms_before_mm, 5.62, 0.01);
  EXPECT_NEAR(refined->rms_after_mm, 0.36, 0.01);

  std::ifstream in(folder / "Tracker_to_pelvis_cropped_with_icp.txt");
  Eigen::Matrix4d m;
  for (int i = 0; i < 16; ++i) in >> m(i / 4, i % 4);
  const auto published = Transform<Patient, Tracker>::from_matrix(m);
  const SurfaceIndex index(*surface);
  double apart2_mm2 = 0;
  std::vector<double> ours_mm, theirs_mm;
  for (const Eigen::Vector3d& p : scan) {
    apart2_mm2 += (refined->surface_pose * p - published * p).squaredNorm() / 2000;
    ours_mm.push_back(index.nearest(refined->surface_pose * p).distance_mm);
    theirs_mm.push_back(index.nearest(published * p).distance_mm);
  }
  // 1.3 mm and 0.3 deg from the published result, and nearer to the surface: half the points to 0.24 mm, where
  // that one has them to 0.85 mm.
  EXPECT_NEAR(std::sqrt(apart2_mm2), 1.29, 0.02);
  EXPECT_NEAR(rotation_angle_between(refined->surface_pose.rotation(), published.rotation()), 0.0048, 0.0001);
  std::sort(ours_mm.begin(), ours_mm.end());
  std::sort(theirs_mm.begin(), theirs_mm.end());
  EXPECT_NEAR(ours_mm[1000], 0.237, 0.01);
  EXPECT_NEAR(theirs_mm[1000], 0.847, 0.01);
  EXPECT_LT(ours_mm[1800], theirs_mm[1800]);
}

}  // namespace
}  // namespace birdseye::host
