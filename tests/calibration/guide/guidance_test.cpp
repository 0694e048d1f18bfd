#include "calibration/guide/guidance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "calibration/base/units.hpp"
#include "calibration/guide/scope_move.hpp"
#include "tests/support/lens.hpp"

namespace birdseye::calibration {
namespace {

using testing::wide_lens;
using CameraPose = Transform<Camera, Marker>;

const Eigen::Vector3d kExtent_mm(39, 27, 0);
const Eigen::Vector3d kCentre_mm = 0.5 * kExtent_mm;

/// A scope over a board, with a tracker of a miniBIRD's noise.
struct Cart {
  CameraModel camera = wide_lens();
  Transform<Camera, Sensor> camera_from_sensor{rotation_exp(Eigen::Vector3d(0.4, -1.1, 0.6)),
                                               Eigen::Vector3d(12, -35, 260)};
  Transform<Tracker, Marker> tracker_from_marker{rotation_exp(Eigen::Vector3d(-0.5, 0.3, 1.4)),
                                                 Eigen::Vector3d(180, 90, -60)};
  std::mt19937 rng;
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  explicit Cart(unsigned seed) : rng(seed) {}

  Eigen::Vector3d noise(double sigma) { return sigma * Eigen::Vector3d(normal(rng), normal(rng), normal(rng)); }
  template <typename To, typename From>
  Transform<To, From> disturbed(const Transform<To, From>& t, double angle_rad, double place_mm) {
    return {Eigen::Matrix3d(t.rotation() * rotation_exp(noise(angle_rad))), t.translation() + noise(place_mm)};
  }

  Station station(const CameraPose& pose) {
    Station s;
    const StationNoise sigma;
    s.tracker_from_sensor = disturbed(tracker_from_marker * pose.inverse() * camera_from_sensor, sigma.angle_sigma_rad,
                                      sigma.position_sigma_mm);
    s.camera_from_marker = disturbed(pose, 0.03 * kRadPerDeg, 0.05);
    for (int j = 0; j <= 4; ++j) {
      for (int i = 0; i <= 6; ++i) {
        s.corners_px.push_back(
            *project(camera, pose * Eigen::Vector3d(i / 6.0 * kExtent_mm.x(), j / 4.0 * kExtent_mm.y(), 0)));
      }
    }
    return s;
  }

  [[nodiscard]] bool whole_board_seen(const CameraPose& pose) const {
    for (const auto& [x, y] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
      const auto at = project(camera, pose * Eigen::Vector3d(x * kExtent_mm.x(), y * kExtent_mm.y(), 0));
      if (!at || at->minCoeff() < 16 || at->x() > camera.width_px - 16 || at->y() > camera.height_px - 16) return false;
    }
    return true;
  }

  double between(double low, double high) { return low + (high - low) * uniform(rng); }
  /// Anywhere that the advice could be, with the whole board in the picture.
  CameraPose random_pose(double most_tilt_deg = 36, double most_turn_deg = 180) {
    while (true) {
      const ScopeView view{between(0, most_tilt_deg) * kRadPerDeg, between(-180, 180) * kRadPerDeg,
                           between(-most_turn_deg, most_turn_deg) * kRadPerDeg, between(70, 110)};
      const CameraPose pose = pose_of(view, kCentre_mm, {between(-0.2, 0.2), between(-0.15, 0.15)});
      if (whole_board_seen(pose)) return pose;
    }
  }

  /// By maximum likelihood, derivatives by differences: the error of the hand-eye, rotation counted over 90 mm.
  [[nodiscard]] double solved_error_mm(const std::vector<Station>& stations) const {
    using Twist = Eigen::Matrix<double, 6, 1>;
    using Twists = Eigen::Matrix<double, 12, 1>;
    const auto moved = []<typename T>(const T& t, const Twist& by) {
      return T(Eigen::Matrix3d(t.rotation() * rotation_exp(by.head<3>())),
               Eigen::Vector3d(t.translation() + by.tail<3>()));
    };
    const StationNoise sigma;
    // Where the tracker has the sensor against where the picture says that it is.
    const auto residuals = [&](const Twists& by) {
      const auto x = moved(camera_from_sensor, by.head<6>());
      const auto w = moved(tracker_from_marker, by.tail<6>());
      Eigen::VectorXd r(6 * static_cast<Eigen::Index>(stations.size()));
      Eigen::Index i = 0;
      for (const Station& s : stations) {
        const auto said = w * s.camera_from_marker.inverse() * x;
        r.segment<3>(i) =
            rotation_log(said.rotation().transpose() * s.tracker_from_sensor.rotation()) / sigma.angle_sigma_rad;
        r.segment<3>(i + 3) = (s.tracker_from_sensor.translation() - said.translation()) / sigma.position_sigma_mm;
        i += 6;
      }
      return r;
    };
    Twists at = Twists::Zero();
    for (int iteration = 0; iteration < 6; ++iteration) {
      const Eigen::VectorXd r = residuals(at);
      Eigen::MatrixXd by(r.size(), 12);
      for (int k = 0; k < 12; ++k) {
        Twists step = at;
        step[k] += 1e-6;
        by.col(k) = (residuals(step) - r) / 1e-6;
      }
      at -= by.colPivHouseholderQr().solve(r);
    }
    const Transform<Camera, Camera> wrong = moved(camera_from_sensor, at.head<6>()) * camera_from_sensor.inverse();
    return std::hypot(wrong.translation().norm(), 90 * rotation_log(wrong.rotation()).norm());
  }
};

double rms(const std::vector<double>& values) {
  double squares = 0;
  for (const double v : values) squares += v * v;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

TEST(Guidance, FollowingItBeatsRandomPoses) {
  constexpr int kTrials = 24, kFirst = 5, kMore = 6;
  std::vector<double> advised_mm, random_mm, timid_mm;
  for (unsigned seed = 1; seed <= kTrials; ++seed) {
    Cart cart(seed);
    std::vector<Station> advised;
    for (int i = 0; i < kFirst; ++i) advised.push_back(cart.station(cart.random_pose()));
    std::vector<Station> random = advised, timid = advised;
    for (int i = 0; i < kMore; ++i) {
      const NextPose next = next_best_pose(advised, cart.camera, kExtent_mm, advised.back().camera_from_marker);
      EXPECT_GT(next.gain, 0);
      EXPECT_TRUE(cart.whole_board_seen(next.camera_from_marker));
      // A hand reaches what it is told to within some degrees.
      const CameraPose reached = cart.disturbed(next.camera_from_marker, 2 * kRadPerDeg, 1);
      advised.push_back(cart.station(reached));
      random.push_back(cart.station(cart.random_pose()));
      timid.push_back(cart.station(cart.random_pose(20, 30)));  // as people do who are told nothing
    }
    advised_mm.push_back(cart.solved_error_mm(advised));
    random_mm.push_back(cart.solved_error_mm(random));
    timid_mm.push_back(cart.solved_error_mm(timid));
  }
  RecordProperty("advised_mm", std::to_string(rms(advised_mm)));
  RecordProperty("random_mm", std::to_string(rms(random_mm)));
  RecordProperty("timid_mm", std::to_string(rms(timid_mm)));
  EXPECT_LT(rms(advised_mm), 0.9 * rms(random_mm));
  EXPECT_LT(rms(advised_mm), 0.7 * rms(timid_mm));
}

TEST(Guidance, ExpectedErrorIsWhatSimulationFinds) {
  // The prediction that poses are compared by, against the errors of a solver that knows nothing of it.
  std::vector<double> found_mm;
  std::vector<CameraPose> poses;
  Cart chooser(3);
  for (int i = 0; i < 12; ++i) poses.push_back(chooser.random_pose());
  for (unsigned seed = 100; seed < 160; ++seed) {
    Cart cart(seed);
    std::vector<Station> stations;
    for (const CameraPose& pose : poses) stations.push_back(cart.station(pose));
    found_mm.push_back(cart.solved_error_mm(stations));
  }
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 12; ++i) points.emplace_back(i % 4 * 13, i / 4 * 13.5, 0);
  StationInformation information(chooser.camera, points, chooser.camera_from_sensor, 90, {});
  for (const CameraPose& pose : poses) information.add(pose);
  information.solve();
  const double before_mm = information.expected_error_mm();
  EXPECT_NEAR(rms(found_mm) / before_mm, 1, 0.2);
  // One more station by the short way and by the long.
  const CameraPose more = chooser.random_pose();
  const double short_way_mm = information.expected_error_mm(more);
  information.add(more);
  information.solve();
  EXPECT_NEAR(short_way_mm, information.expected_error_mm(), 1e-6 * before_mm);
  EXPECT_LT(short_way_mm, before_mm);
}

TEST(Guidance, LeadsOutOfTurnsAboutOneAxis) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Cart cart(seed);
    // About the scope's own axis only, which leaves the hand-eye's place along it open.
    std::vector<Station> stations;
    for (int i = 0; i < 5; ++i) {
      stations.push_back(cart.station(pose_of({0, 0, (i - 2) * 40 * kRadPerDeg, 90}, kCentre_mm, {0, 0})));
    }
    const NextPose next = next_best_pose(stations, cart.camera, kExtent_mm, stations.back().camera_from_marker);
    const ScopeView view = scope_view(next.camera_from_marker);
    EXPECT_GT(view.tilt_rad, 15 * kRadPerDeg);
    ASSERT_TRUE(next.move.has_value());
    EXPECT_TRUE(next.move->tilt.has_value());
    EXPECT_GT(next.gain, 0.3);
    // Tilts to one side and back only, the scope never turned about its axis.
    stations.clear();
    for (int i = 0; i < 5; ++i) {
      stations.push_back(cart.station(
          pose_of({std::abs(i - 2) * 15 * kRadPerDeg, i < 2 ? 180 * kRadPerDeg : 0, 0, 90}, kCentre_mm, {0, 0})));
    }
    const NextPose other = next_best_pose(stations, cart.camera, kExtent_mm, stations.back().camera_from_marker);
    const Eigen::Matrix3d moved =
        other.camera_from_marker.rotation() * stations[2].camera_from_marker.rotation().transpose();
    const Eigen::Vector3d turn = rotation_log(moved);
    // The old axis is the picture's vertical.
    EXPECT_GT(turn.cross(Eigen::Vector3d::UnitY()).norm(), 25 * kRadPerDeg);
    EXPECT_GT(other.gain, 0.3);
  }
}

TEST(Guidance, BeginsWithoutStations) {
  Cart cart(1);
  const NextPose next = next_best_pose({}, cart.camera, kExtent_mm, std::nullopt);
  EXPECT_TRUE(cart.whole_board_seen(next.camera_from_marker));
  EXPECT_TRUE(next.from_straight);
  EXPECT_TRUE(next.move.has_value());
}

TEST(Guidance, PassesOverStationsThatAreNotFinite) {
  Cart cart(4);
  std::vector<Station> stations;
  for (int i = 0; i < 4; ++i) stations.push_back(cart.station(cart.random_pose()));
  const NextPose without = next_best_pose(stations, cart.camera, kExtent_mm, std::nullopt);
  stations.push_back(stations[0]);
  stations.back().camera_from_marker = CameraPose(Eigen::Matrix3d(Eigen::Matrix3d::Constant(NAN)), {0, 0, 90});
  const NextPose with = next_best_pose(stations, cart.camera, kExtent_mm, stations.back().camera_from_marker);
  EXPECT_EQ(with.from_straight, without.from_straight);
  EXPECT_EQ(with.camera_from_marker.matrix(), without.camera_from_marker.matrix());
  EXPECT_EQ(with.gain, without.gain);
}

TEST(Guidance, SaysWhatToDoWhereNoPoseShowsTheBoard) {
  Cart cart(1);
  cart.camera.k1 = -4;  // folds before the board fits
  const NextPose next = next_best_pose({}, cart.camera, kExtent_mm, std::nullopt);
  EXPECT_EQ(next.gain, 0);
  EXPECT_FALSE(next.move.has_value());
}

TEST(Guidance, IsTheSameForABoardWhoseAxisPointsToTheCamera) {
  Cart cart(5);
  // The board's frame turned over about its x axis, its extent along y the other way; the camera sees the same.
  const Eigen::Matrix3d over = Eigen::Vector3d(1, -1, -1).asDiagonal();
  const Transform<Marker, Marker> turned(over, Eigen::Vector3d(0, kExtent_mm.y(), 0));
  std::vector<Station> stations, turned_stations;
  for (int i = 0; i < 6; ++i) {
    stations.push_back(cart.station(cart.random_pose()));
    turned_stations.push_back(stations.back());
    turned_stations.back().camera_from_marker = stations.back().camera_from_marker * turned;
  }
  const auto now = stations.back().camera_from_marker;
  const NextPose a = next_best_pose(stations, cart.camera, kExtent_mm, now);
  const NextPose b = next_best_pose(turned_stations, cart.camera, kExtent_mm, now * turned);
  EXPECT_NEAR(a.gain, b.gain, 0.03 * a.gain);
  EXPECT_EQ(coverage_of(stations, 768, 576).tilts_covered(), coverage_of(turned_stations, 768, 576).tilts_covered());
}

TEST(ScopeView, IsUndoneByPoseOf) {
  Cart cart(7);
  for (int i = 0; i < 50; ++i) {
    ScopeView view{cart.between(0.05, 1.2), cart.between(-3, 3), cart.between(-3, 3), cart.between(40, 200),
                   i % 2 == 0};
    const ScopeView back = scope_view(pose_of(view, kCentre_mm, {0, 0}));
    EXPECT_NEAR(back.tilt_rad, view.tilt_rad, 1e-9);
    EXPECT_NEAR(back.direction_rad, view.direction_rad, 1e-9);
    EXPECT_NEAR(back.turn_rad, view.turn_rad, 1e-9);
    EXPECT_NEAR(back.distance_mm, view.distance_mm, 1e-9);
    EXPECT_EQ(back.from_behind, view.from_behind);
  }
}

/// The scope led around the board's middle: its camera head `degrees` to where (x, y) points in the picture, then
/// turned about its axis.
CameraPose led(const CameraPose& now, double degrees, double x, double y, double turn_deg) {
  const Eigen::Vector3d pivot = now * kCentre_mm;
  // To lead the head to the picture's x is to turn everything that is seen the other way about the pivot: the board's
  // side on x comes nearer.
  const Eigen::Vector3d axis = Eigen::Vector3d(x, y, 0).normalized().cross(Eigen::Vector3d::UnitZ());
  const Eigen::Matrix3d seen_turns = rotation_exp(-degrees * kRadPerDeg * axis);
  const Eigen::Matrix3d roll = rotation_exp(-turn_deg * kRadPerDeg * Eigen::Vector3d::UnitZ());
  return {Eigen::Matrix3d(roll * seen_turns * now.rotation()),
          roll * (seen_turns * (now.translation() - pivot) + pivot)};
}

TEST(ScopeMove, TiltBringsThatSideOfThePictureNearer) {
  const CameraModel camera = wide_lens();
  const std::pair<PictureWay, Eigen::Vector2d> kWays[] = {
      {PictureWay::left, {-1, 0}},     {PictureWay::right, {1, 0}},     {PictureWay::up, {0, -1}},
      {PictureWay::down, {0, 1}},      {PictureWay::up_left, {-1, -1}}, {PictureWay::down_right, {1, 1}},
      {PictureWay::up_right, {1, -1}}, {PictureWay::down_left, {-1, 1}}};
  Cart cart(11);
  for (const auto& [word, way] : kWays) {
    for (int i = 0; i < 6; ++i) {
      const CameraPose now = pose_of({0.2 * i, 1.0 * i, 0.7 * i, 90}, kCentre_mm, {0, 0});
      const CameraPose next = led(now, 30, way.x(), way.y(), 40.0 * (i % 3));
      const ScopeMove move = move_between(now, next, camera, kCentre_mm);
      ASSERT_TRUE(move.tilt.has_value());
      EXPECT_NEAR(move.tilt->by_rad, 30 * kRadPerDeg, 1e-9);
      EXPECT_EQ(move.tilt->way, word);
      // By projecting: two squares that look equally large now, one on the word's side of the board's middle; after
      // the tilt it is the larger.
      const auto size_px = [&, &way = way](const CameraPose& pose, double side) {
        const Eigen::Vector3d middle = now * kCentre_mm;
        const Eigen::Vector3d at = middle + side * 8 * Eigen::Vector3d(way.x(), way.y(), 0).normalized();
        const auto pixel = [&](double dx, double dy) {
          CameraModel pinhole = camera;
          pinhole.k1 = pinhole.k2 = pinhole.k3 = pinhole.p1 = pinhole.p2 = 0;
          pinhole.fy_px = pinhole.fx_px;
          return *project(pinhole, pose * (now.inverse() * (at + Eigen::Vector3d(dx, dy, 0))));
        };
        return (pixel(1, 0) - pixel(-1, 0)).norm() * (pixel(0, 1) - pixel(0, -1)).norm();
      };
      EXPECT_NEAR(size_px(now, 1) / size_px(now, -1), 1, 1e-9);
      EXPECT_GT(size_px(next, 1) / size_px(next, -1), 1.1);
    }
  }
}

TEST(ScopeMove, ClockwiseMovesTheRightOfThePictureUp) {
  const CameraModel camera = wide_lens();
  const CameraPose now = pose_of({0.3, 0.5, 1.0, 90}, kCentre_mm, {0, 0});
  const Eigen::Vector3d on_the_right = now.inverse() * (now * kCentre_mm + Eigen::Vector3d(10, 0, 0));
  for (const int degrees : {90, 45, 70, 135}) {
    const CameraPose clockwise = led(now, 0, 1, 0, degrees), back = led(now, 0, 1, 0, -degrees);
    EXPECT_NEAR(*move_between(now, clockwise, camera, kCentre_mm).turn_rad, degrees * kRadPerDeg, 1e-9);
    EXPECT_NEAR(*move_between(now, back, camera, kCentre_mm).turn_rad, -degrees * kRadPerDeg, 1e-9);
    EXPECT_LT(project(camera, clockwise * on_the_right)->y(), project(camera, now * on_the_right)->y() - 20);
    EXPECT_GT(project(camera, back * on_the_right)->y(), project(camera, now * on_the_right)->y() + 20);
  }
}

TEST(ScopeMove, NamesDistanceAndPlaceInThePicture) {
  const CameraModel camera = wide_lens();
  const CameraPose now = pose_of({0.1, 0.5, 0, 90}, kCentre_mm, {0, 0});
  const auto move = [&](double distance_mm, double x, double y) {
    return move_between(now, pose_of({0.1, 0.5, 0, distance_mm}, kCentre_mm, {x, y}), camera, kCentre_mm);
  };
  EXPECT_NEAR(*move(70, 0, 0).nearer_mm, 20, 0.5);
  EXPECT_NEAR(*move(120, 0, 0).nearer_mm, -30, 0.5);
  EXPECT_FALSE(move(70, 0, 0).board.has_value());
  EXPECT_EQ(move(90, -0.2, -0.2).board, BoardPlace::upper_left);
  EXPECT_EQ(move(90, 0.3, 0).board, BoardPlace::right);
  EXPECT_EQ(move(90, 0, 0.25).board, BoardPlace::lower);
  EXPECT_EQ(move(70, -0.2, 0.2).board, BoardPlace::lower_left);
  const ScopeMove none = move(91, 0.01, 0);
  EXPECT_FALSE(none.tilt || none.turn_rad || none.nearer_mm || none.board);
}

TEST(Coverage, CountsWhatStationsHaveBeenToSee) {
  Cart cart(1);
  EXPECT_EQ(coverage_line(coverage_of({}, 768, 576)),
            "picture 0 of 20 cells, tilts 0 of 16, turns 0 of 4, distances 0 of 2");
  std::vector<Station> stations;
  const auto add = [&](double tilt_deg, double direction_deg, double turn_deg, double distance_mm) {
    stations.push_back(cart.station(pose_of(
        {tilt_deg * kRadPerDeg, direction_deg * kRadPerDeg, turn_deg * kRadPerDeg, distance_mm}, kCentre_mm, {0, 0})));
    return coverage_of(stations, cart.camera.width_px, cart.camera.height_px);
  };
  Coverage c = add(3, 0, 0, 90);
  EXPECT_EQ(c.tilts_covered(), 0);
  EXPECT_EQ(c.turns_covered(), 1);
  EXPECT_EQ(c.distances_covered(), 1);
  EXPECT_NEAR(c.nearest_mm, 90, 1);
  c = add(15, 0, 0, 92);
  EXPECT_EQ(c.tilts_covered(), 1);
  EXPECT_TRUE(c.tilts[0]);
  c = add(35, 90, 0, 92);
  EXPECT_TRUE(c.tilts[8 + 2]);
  c = add(35, -44, 95, 130);
  EXPECT_TRUE(c.tilts[8 + 7]);
  EXPECT_EQ(c.tilts_covered(), 3);
  EXPECT_EQ(c.turns_covered(), 2);
  EXPECT_EQ(c.distances_covered(), 2);
  EXPECT_NEAR(c.share, (c.cells_covered() / 20.0 + 3 / 16.0 + 2 / 4.0 + 1) / 4, 1e-12);

  Station corner;
  corner.corners_px = {{0, 0}, {767, 575}, {-1, 3}, {NAN, 3}, {300, 1e9}};
  corner.camera_from_marker = stations[0].camera_from_marker;
  const Coverage cells = coverage_of(std::vector<Station>{corner}, 768, 576);
  EXPECT_EQ(cells.cells_covered(), 2);
  EXPECT_TRUE(cells.cells.front());
  EXPECT_TRUE(cells.cells.back());
}

}  // namespace
}  // namespace birdseye::calibration
