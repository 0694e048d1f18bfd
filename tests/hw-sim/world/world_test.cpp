#include "hw-sim/world/world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
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
