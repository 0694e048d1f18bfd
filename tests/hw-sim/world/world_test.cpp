#include "hw-sim/world/world.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <utility>

#include "calibration/base/units.hpp"
#include "hw-sim/phantom/body.hpp"
#include "hw-sim/phantom/implants.hpp"

namespace birdseye::hw_sim {
namespace {

struct Scene {
  PhantomTruth truth;
  Mesh liver;
};

const Scene& scene() {
  static const Scene made = [] {
    const Body body = procedural_body(1);
    const Implants implants = *choose_implants(body, 1);
    const Grid box = Grid::around(body.grid.origin_mm, body.grid.last_mm(), 3);
    return Scene{{implants.liver_centre_mm, implants.tumour_centre_mm, implants.markers_mm},
                 surface_of(ScalarGrid::sample(body.liver_mm, box))};
  }();
  return made;
}

TEST(Surface, VerticesLieOnTheField) {
  const Field ball = [](const Eigen::Vector3d& p) { return p.norm() - 20; };
  const Mesh mesh = surface_of(
      ScalarGrid::sample(ball, Grid::around(Eigen::Vector3d::Constant(-25), Eigen::Vector3d::Constant(25), 1)));
  ASSERT_GT(mesh.triangles.size(), 1000U);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    EXPECT_NEAR(mesh.vertices[i].norm(), 20, 0.05);
    EXPECT_GT(mesh.normals[i].dot(mesh.vertices[i].normalized()), 0.98F);
  }
}

TEST(Implants, TheTumourLiesInTheLiverAndTheMarkersStandOnTheSkin) {
  const Body body = procedural_body(1);
  for (const std::uint64_t seed : {1U, 2U, 77U}) {
    const auto implants = choose_implants(body, seed);
    ASSERT_TRUE(implants) << implants.error().what;
    EXPECT_LT(body.liver_mm(implants->tumour_centre_mm), -15);
    for (const Eigen::Vector3d& marker : implants->markers_mm) {
      EXPECT_NEAR(body.skin_mm(marker), kMarkerRadiusMm, 0.4);
      for (const Eigen::Vector3d& other : implants->markers_mm) {
        if (&other != &marker) {
          EXPECT_GT((other - marker).norm(), 35);
        }
      }
    }
  }
}

TEST(World, ThePointerTouchesEachFiducialAndTheScopeStandsStillAtItsStations) {
  const auto world = World::create(scene().truth, scene().liver, laparoscope_lens(768, 576), 1);
  ASSERT_TRUE(world) << world.error().what;
  double nearest[6];
  std::fill(std::begin(nearest), std::end(nearest), 1e9);
  int still = 0;
  for (int i = 0; 0.01 * i < world->ends_s(); ++i) {
    const double t = 0.01 * i;
    const Eigen::Vector3d tip = world->tracker_from_pointer(t) * world->tip_in_pointer_mm();
    for (std::size_t f = 0; f < 6; ++f) {
      nearest[f] = std::min(nearest[f], (tip - world->tracker_from_patient() * scene().truth.fiducials_mm[f]).norm());
    }
    const Eigen::Vector3d a = world->tracker_from_sensor(t).translation();
    const Eigen::Vector3d b = world->tracker_from_sensor(t + 0.01).translation();
    if (world->at_bench(t) && (a - b).norm() < 1e-9) ++still;
    EXPECT_LT((a - b).norm(), 40) << t;
  }
  for (const double distance : nearest) EXPECT_LT(distance, 1e-9);
  EXPECT_GT(still, 600);
}

TEST(World, TheScopeTurnsAboutOnePointOfTheWallWhileItLooks) {
  const auto world = World::create(scene().truth, scene().liver, laparoscope_lens(768, 576), 1);
  ASSERT_TRUE(world) << world.error().what;
  // The point nearest to all optical axes, by least squares, must lie on each of them.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  std::vector<Transform<Tracker, Camera>> poses;
  poses.reserve(69);
  for (int i = 0; i < 69; ++i) poses.push_back(world->tracker_from_camera(world->ends_s() - 6.9 + 0.1 * i));
  for (const auto& pose : poses) {
    const Eigen::Vector3d axis = pose.rotation().col(2);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    normal += across;
    right += across * pose.translation();
  }
  const Eigen::Vector3d port = normal.inverse() * right;
  for (const auto& pose : poses) {
    const Eigen::Vector3d in_camera = pose.inverse() * port;
    EXPECT_LT(in_camera.head<2>().norm(), 1e-6);
    EXPECT_LT(in_camera.z(), -60);
  }
}

TEST(World, TheScopeIsHeldStillAtPlacesAboutTheLiverWhereThatIsAskedFor) {
  const CameraModel lens = laparoscope_lens(768, 576);
  const auto without = World::create(scene().truth, scene().liver, lens, 1);
  const auto world = World::create(scene().truth, scene().liver, lens, 1, {.views = true});
  ASSERT_TRUE(without && world);
  for (const Stage& stage : without->stages()) EXPECT_NE(stage.name, "views");
  const auto& stages = world->stages();
  const auto begins = [&stages](const char* name) {
    return std::find_if(stages.begin(), stages.end(), [&](const Stage& s) { return s.name == name; })->begins_s;
  };
  const Eigen::Vector3d& tumour_mm = scene().truth.tumour_centre_mm;
  std::vector<Eigen::Vector3d> directions;  // from the tumour to the lens, of each place where the scope is still
  bool still = false;
  for (int i = 0; begins("views") + 0.01 * i < begins("look"); ++i) {
    const auto at = [&](double s) {
      return world->tracker_from_patient().inverse() * world->tracker_from_camera(begins("views") + s);
    };
    const auto pose = at(0.01 * i);
    const Eigen::Vector3d from_tumour = pose.translation() - tumour_mm;
    EXPECT_LT((at(0.01 * i + 0.01).translation() - pose.translation()).norm(), 6) << i;
    const bool was = std::exchange(still, (at(0.01 * i + 0.01).translation() - pose.translation()).norm() < 1e-9);
    if (!still || was) continue;
    directions.push_back(from_tumour.normalized());
    EXPECT_TRUE(project(lens, pose.inverse() * tumour_mm));
  }
  ASSERT_EQ(directions.size(), 5U);
  const auto between_deg = [&](std::size_t a, std::size_t b) {
    return std::acos(directions[a].dot(directions[b])) / kRadPerDeg;
  };
  for (std::size_t i = 1; i < directions.size(); ++i) {
    EXPECT_GT(between_deg(i - 1, i), 10);
    EXPECT_LT(between_deg(i - 1, i), 25);
  }
  EXPECT_GT(between_deg(0, directions.size() - 1), 45);
}

/// From a place to the nearest place of a triangle.
double off_triangle_mm(const Eigen::Vector3d& place, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                       const Eigen::Vector3d& c) {
  const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
  const auto beyond = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return (to - from).cross(place - from).dot(normal) < 0;
  };
  if (!beyond(a, b) && !beyond(b, c) && !beyond(c, a)) return std::abs((place - a).dot(normal));
  const auto off_edge_mm = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const double along = std::clamp((place - from).dot(to - from) / (to - from).squaredNorm(), 0.0, 1.0);
    return (place - from - along * (to - from)).norm();
  };
  return std::min({off_edge_mm(a, b), off_edge_mm(b, c), off_edge_mm(c, a)});
}

double off_mesh_mm(const Eigen::Vector3d& place, const Mesh& mesh) {
  constexpr double kNear_mm = 12;
  double least_mm = 1e9;
  for (const auto& triangle : mesh.triangles) {
    const auto corner = [&](std::size_t i) -> Eigen::Vector3d { return mesh.vertices[triangle[i]].cast<double>(); };
    if ((corner(0) - place).cwiseAbs().maxCoeff() > kNear_mm) continue;
    least_mm = std::min(least_mm, off_triangle_mm(place, corner(0), corner(1), corner(2)));
  }
  return least_mm;
}

TEST(World, ThePointerStrokesTheLiverAsItLiesNowWhereThatIsAskedFor) {
  const CameraModel lens = laparoscope_lens(768, 576);
  Mesh moved = scene().liver;
  for (Eigen::Vector3f& vertex : moved.vertices)
    vertex += Eigen::Vector3f(2, -6 + 2 * std::sin(vertex.x() / 40), 1 + std::cos(vertex.z() / 50));
  compute_normals(moved);
  const auto without = World::create(scene().truth, scene().liver, lens, 1);
  const auto world = World::create(scene().truth, scene().liver, lens, 1, {.strokes = true}, &moved);
  ASSERT_TRUE(without && world);
  const auto& stages = world->stages();
  const auto stroke = std::find_if(stages.begin(), stages.end(), [](const Stage& s) { return s.name == "stroke"; });
  ASSERT_NE(stroke, stages.end());
  const double lasts_s = std::next(stroke)->begins_s - stroke->begins_s;
  EXPECT_GT(lasts_s, 8);
  EXPECT_LT(lasts_s, 30);
  EXPECT_NEAR(world->ends_s(), without->ends_s() + lasts_s, 1e-9);
  // What comes before is as without strokes, and what comes after, later.
  for (int i = 0; i < 200; ++i) {
    const double before_s = stroke->begins_s * i / 200, look_s = stroke->begins_s + 0.03 * i;
    EXPECT_EQ(world->tracker_from_pointer(before_s).matrix(), without->tracker_from_pointer(before_s).matrix());
    EXPECT_EQ(world->tracker_from_sensor(before_s).matrix(), without->tracker_from_sensor(before_s).matrix());
    EXPECT_LT(
        (world->tracker_from_sensor(look_s + lasts_s).matrix() - without->tracker_from_sensor(look_s).matrix()).norm(),
        1e-6);
  }
  const auto tip_mm = [&](double s) -> Eigen::Vector3d {
    return world->tracker_from_patient().inverse() * (world->tracker_from_pointer(s) * world->tip_in_pointer_mm());
  };
  const double begins_s = stroke->begins_s;
  EXPECT_LT((tip_mm(begins_s + lasts_s + 1) - tip_mm(begins_s)).norm(), 1e-6) << "parked again";
  Eigen::AlignedBox3d about;
  int stroking = 0, of_rest = 0;
  const int steps = static_cast<int>(lasts_s / 0.05);
  for (int i = 0; i < steps; ++i) {
    const double s = begins_s + 0.05 * i;
    if (!world->strokes(s) || !world->strokes(s + 0.01)) continue;
    ++stroking;
    about.extend(tip_mm(s));
    EXPECT_LT(off_mesh_mm(tip_mm(s), moved), 0.1) << s;
    EXPECT_NEAR((tip_mm(s + 0.01) - tip_mm(s)).norm(), 0.4, 0.05) << "40 mm/s";
    of_rest += off_mesh_mm(tip_mm(s), scene().liver) < 1 ? 1 : 0;
  }
  EXPECT_GT(stroking, steps / 2);
  EXPECT_LT(of_rest, stroking / 10) << "not the liver as the CT has it";
  EXPECT_GT(about.diagonal().norm(), 80);
}

TEST(Laparoscope, TheSameFrameIsTheSameBytesAndAnotherIsNot) {
  const CameraModel lens = laparoscope_lens(384, 288);
  const auto world = World::create(scene().truth, scene().liver, lens, 1);
  ASSERT_TRUE(world) << world.error().what;
  const auto scope = Laparoscope::create({.lens = lens});
  ASSERT_TRUE(scope);
  (*scope)->set_cavity({.organ = scene().liver, .wall_centre_mm = scene().truth.liver_centre_mm});
  const auto pose = world->tracker_from_camera(world->ends_s() - 3).inverse() * world->tracker_from_patient();
  const auto first = (*scope)->look_into_cavity(pose, 7);
  EXPECT_EQ(first, (*scope)->look_into_cavity(pose, 7));
  EXPECT_NE(first, (*scope)->look_into_cavity(pose, 8));
}

/// With BIRDSEYE_PICTURES set to a folder, writes frames there as raw RGB 768x576, for a person to look at.
TEST(Laparoscope, Pictures) {
  const char* folder = std::getenv("BIRDSEYE_PICTURES");
  if (folder == nullptr) GTEST_SKIP() << "set BIRDSEYE_PICTURES to a folder to get pictures to look at";
  const CameraModel lens = laparoscope_lens(768, 576);
  const auto world = World::create(scene().truth, scene().liver, lens, 1);
  ASSERT_TRUE(world) << world.error().what;
  const auto scope = Laparoscope::create({.lens = lens});
  (*scope)->set_cavity({.organ = scene().liver, .wall_centre_mm = scene().truth.liver_centre_mm});
  (*scope)->set_bench(world->board());
  int number = 0;
  for (const double t : {0.1, 2.7, 5.0, world->ends_s() - 6.8, world->ends_s() - 5, world->ends_s() - 2}) {
    const auto pose = world->tracker_from_camera(t);
    const auto rgb = world->at_bench(t) ? (*scope)->look_at_bench(pose.inverse() * world->tracker_from_marker(), 1)
                                        : (*scope)->look_into_cavity(pose.inverse() * world->tracker_from_patient(), 1);
    std::ofstream out(std::string(folder) + "/" + std::to_string(number++) + ".rgb", std::ios::binary);
    out.write(reinterpret_cast<const char*>(rgb.data()), static_cast<std::streamsize>(rgb.size()));
  }
}

}  // namespace
}  // namespace birdseye::hw_sim
