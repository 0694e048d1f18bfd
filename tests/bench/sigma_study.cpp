// Whether stated errors are true: simulated calibrations, and how often the truth lies within the 95 % bounds.
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/median.hpp"
#include "calibration/base/student95.hpp"
#include "calibration/camera/camera_calibration.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/hand_eye/pose_streams.hpp"
#include "calibration/latency/latency.hpp"
#include "calibration/points/pivot.hpp"
#include "tests/support/board_views.hpp"
#include "tests/support/hand_eye_bench.hpp"
#include "tests/support/hand_eye_stream.hpp"
#include "tests/support/latency_streams.hpp"
#include "tests/support/simulated_field.hpp"
#include "tests/support/simulated_pointer.hpp"

namespace birdseye::testing {
namespace {

using namespace calibration;

/// One figure of one calibration: how far off it is, and how far it may be by its 95 % bound.
struct Stated {
  double off = 0, bound = 0;
};

struct Figure {
  std::string name;
  std::vector<Stated> trials;

  /// The bound's median width over what 95 % of the errors stay below: 1 where bounds are as narrow as they may be.
  [[nodiscard]] double width() const {
    std::vector<double> off, bound;
    for (const Stated& s : trials) {
      off.push_back(s.off);
      bound.push_back(s.bound);
    }
    std::ranges::sort(off);
    return median_of(bound) / off[static_cast<std::size_t>(0.95 * static_cast<double>(off.size()))];
  }
  [[nodiscard]] double within() const {
    const auto count = std::ranges::count_if(trials, [](const Stated& s) { return s.off <= s.bound; });
    return 100.0 * static_cast<double>(count) / static_cast<double>(trials.size());
  }
};

/// Trials of one kind: seed -> one Stated for each name, or none where nothing was found.
void study(const std::string& kind, const std::vector<std::string>& names, int trials,
           const std::function<std::vector<Stated>(unsigned)>& trial) {
  std::vector<Figure> figures;
  for (const std::string& name : names) figures.push_back({name, {}});
  int failed = 0;
  for (int seed = 1; seed <= trials; ++seed) {
    const std::vector<Stated> stated = trial(static_cast<unsigned>(seed));
    if (stated.size() != names.size()) {
      ++failed;
      continue;
    }
    for (std::size_t i = 0; i < stated.size(); ++i) figures[i].trials.push_back(stated[i]);
  }
  for (const Figure& f : figures)
    fmt::print("| {} | {} | {} | {:.1f} % | {:.2f} |{}\n", kind, f.name, f.trials.size(), f.within(), f.width(),
               failed > 0 ? fmt::format(" {} gave none", failed) : "");
  std::fflush(stdout);
}

/// A lens that no model of ours describes: the rays bend as those of a lens of equal area, squeezed a little.
Eigen::Vector2d foreign_distortion(const Eigen::Vector2d& undistorted) {
  const double r = undistorted.norm();
  if (r < 1e-9) return undistorted;
  const double angle = std::atan(r);
  const double bent = 0.55 * 2 * std::sin(angle / 2) + 0.45 * r / (1 + 0.18 * r * r);
  return undistorted * bent / r;
}

struct LensScene {
  int views = 15;
  bool foreign = false;
  double bent_mm = 0;  ///< of the board's middle over its corners
  double view_shift_px = 0;
};

std::vector<Stated> lens_trial(const LensScene& scene, unsigned seed) {
  const BoardScene board;
  CameraModel truth = hd_lens(-0.25, 0.08, 0.0008, -0.0006);
  if (scene.foreign) truth = hd_lens(0);
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  std::vector<PatternView> views;
  const auto points = board.points_mm();
  const Eigen::Vector3d middle = (points.front() + points.back()) / 2;
  for (const auto& pose : board.poses(scene.views, seed)) {
    PatternView& view = views.emplace_back();
    view.name = "view" + std::to_string(views.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      Eigen::Vector3d place = points[i];
      place.z() += scene.bent_mm * (1 - (place - middle).squaredNorm() / (points.front() - middle).squaredNorm());
      const Eigen::Vector3d p = pose * place;
      Eigen::Vector2d px = *project(truth, p);
      if (scene.foreign) {
        const Eigen::Vector2d bent = foreign_distortion(p.head<2>() / p.z());
        px = Eigen::Vector2d(truth.fx_px * bent.x() + truth.cx_px, truth.fy_px * bent.y() + truth.cy_px);
      }
      px += board.noise_px * Eigen::Vector2d(normal(rng), normal(rng));
      if (!BoardScene::inside(truth, px)) continue;
      view.ids.push_back(static_cast<int>(i));
      view.points_in_marker_mm.push_back(points[i]);
      view.points_px.push_back(px);
    }
  }
  const auto found = calibrate_camera(views, truth.width_px, truth.height_px);
  if (!found) return {};
  const CameraVector sigma = kNormal95 * found->sigma();
  const CameraModel& c = found->camera;
  return {{std::abs(c.fx_px - truth.fx_px), sigma[0]},
          {std::abs(c.fy_px - truth.fy_px), sigma[1]},
          {std::abs(c.cx_px - truth.cx_px), sigma[2]},
          {std::abs(c.cy_px - truth.cy_px), sigma[3]}};
}

/// The 95 % region, as a distance that is 1 on its surface; and the error across the line of sight at the board.
std::vector<Stated> hand_eye_stated(const HandEyeResult& found, const Transform<Camera, Sensor>& truth) {
  Vector6d error;
  error << rotation_log(Eigen::Matrix3d(truth.rotation() * found.camera_from_sensor.rotation().transpose())),
      truth.translation() - found.camera_from_sensor.translation();
  const double distance = std::sqrt(error.dot(found.covariance.ldlt().solve(error)));
  const Eigen::Vector3d ahead(0, 0, found.working_distance_mm);
  const Eigen::Vector3d off = truth * (found.camera_from_sensor.inverse() * ahead) - ahead;
  // Of two coordinates with one sigma: Rayleigh's 95 % point.
  return {{distance, std::sqrt(found.region_limit)}, {off.head<2>().norm(), 2.448 * found.sigma_at_board_mm()}};
}

std::vector<Stated> stations_trial(int stations, bool own_lens, unsigned seed) {
  HandEyeBench bench({.stations = stations, .corner_px = 0.2, .position_mm = 1.8, .angle_deg = 0.5, .seed = seed});
  if (own_lens) {
    BoardScene board;
    board.noise_px = 0.3;
    const CameraModel truth = *bench.input.camera;
    const auto lens = calibrate_camera(board.views(truth, 12, seed), truth.width_px, truth.height_px);
    if (!lens) return {};
    bench.input.camera = lens->camera;
    bench.input.camera_covariance = lens->covariance;
  }
  const auto found = calibrate_hand_eye(bench.input);
  if (!found || !found->solved || found->observability.board_scale <= 0) return {};
  auto stated = hand_eye_stated(*found, bench.camera_from_sensor);
  stated.push_back(
      {std::abs(found->observability.board_scale - 1), kNormal95 * found->observability.board_scale_sigma});
  return stated;
}

/// How many good stations of many calibrations are left out, and how many are named odd.
void study_good_stations(int trials) {
  for (const int stations : {6, 12, 20, 40}) {
    int taken = 0, left_out = 0, odd = 0, losing = 0;
    for (int seed = 1; seed <= trials; ++seed) {
      const HandEyeBench bench({.stations = stations,
                                .corner_px = 0.2,
                                .position_mm = 1.8,
                                .angle_deg = 0.5,
                                .seed = static_cast<unsigned>(seed)});
      const auto found = calibrate_hand_eye(bench.input);
      if (!found || !found->solved) continue;
      taken += stations;
      left_out += static_cast<int>(found->outliers.size());
      losing += found->outliers.empty() ? 0 : 1;
      odd += static_cast<int>(std::ranges::count_if(found->stations, [&](const auto& s) { return is_odd(*found, s); }));
    }
    fmt::print("| {} good stations | {} of {} left out, in {} of {} calibrations; {} named odd |\n", stations, left_out,
               taken, losing, trials, odd);
  }
}

std::vector<Stated> stream_trial(const HandEyeStreamScene& scene) {
  const HandEyeStream stream(scene);
  const auto paired = pair_pose_streams(stream.sensor, stream.views);
  if (!paired) return {};
  HandEyeInput input;
  input.stations = paired->stations;
  input.estimate_time_offset = true;
  const auto found = calibrate_hand_eye(input);
  if (!found || !found->solved) return {};
  auto stated = hand_eye_stated(*found, stream.camera_from_sensor);
  const double offset_s = paired->offset_s + found->time_offset_s.value_or(0);
  stated.push_back({std::abs(offset_s - scene.clock_offset_s), kNormal95 * found->time_offset_sigma_s});
  return stated;
}

/// A pointer swept slowly about a divot; errors that last as long as `lasting` poses.
std::vector<Stated> tip_trial(double lasting, unsigned seed) {
  SimulatedPointer pointer;
  pointer.random.seed(seed);
  std::normal_distribution<double> normal;
  const auto rad = [](double deg) { return deg * kRadPerDeg; };
  std::vector<PivotPose> poses;
  std::array<double, 6> error{};
  const double kept = lasting > 0 ? std::exp(-1 / lasting) : 0;
  for (double& e : error) e = normal(pointer.random);
  for (int i = 0; i < 300; ++i) {
    const double t = 0.1 * i;
    const Eigen::Matrix3d rotation = rotation_exp(
        Eigen::Vector3d(rad(30) * std::sin(0.9 * t), rad(28) * std::sin(0.67 * t + 1), rad(20) * std::sin(0.31 * t)));
    for (double& e : error) e = kept * e + std::sqrt(1 - kept * kept) * normal(pointer.random);
    const Eigen::Matrix3d seen = rotation * rotation_exp(rad(0.5) * Eigen::Vector3d(error[0], error[1], error[2]));
    const Eigen::Vector3d place =
        pointer.pivot_mm - rotation * pointer.tip_mm + 1.0 * Eigen::Vector3d(error[3], error[4], error[5]);
    poses.push_back({{seen, place}, 0, t});
  }
  const auto found = solve_pivot(poses);
  if (!found) return {};
  const Eigen::Vector3d off = found->robust.tip_in_sensor_mm - pointer.tip_mm;
  return {{std::sqrt(off.dot(found->tip_covariance_mm2.ldlt().solve(off))), std::sqrt(7.815)}};
}

std::vector<Stated> latency_trial(unsigned seed) {
  const simulated::Hand hand(seed);
  simulated::StreamSettings tracker{.rate_hz = 103, .noise_deg = 0.3, .seed = seed};
  simulated::StreamSettings camera{.rate_hz = 25, .noise_deg = 0.2, .offset_ms = 83, .seed = seed + 5000};
  const auto found = find_latency(simulated::record(hand, tracker), simulated::record(hand, camera));
  if (!found || !found->determined) return {};
  const double half = (found->offset_ci95_ms[1] - found->offset_ci95_ms[0]) / 2;
  return {{std::abs(found->offset_ms - 83), half}};
}

std::vector<Stated> field_trial(double peak_mm, unsigned seed) {
  const hw_sim::FieldDistortion field(peak_mm, seed);
  GridSpec spec;
  spec.noise_mm = 0.6;
  const auto fit = fit_field(grid_samples(field, spec, seed));
  if (!fit) return {};
  GridSpec other = spec;
  other.nx = 4;
  other.ny = other.nz = 3;
  std::vector<Stated> all;
  for (const FieldSample& s : grid_samples(field, other, seed + 900)) {
    const auto corrected = fit->map.correct(s.measured);
    if (!corrected) continue;
    const Eigen::Vector3d truth = *fit->tracker_from_board * s.true_mm;
    all.push_back({(corrected->tracker_from_sensor.translation() - truth).norm(),
                   2.795 / std::sqrt(3) * corrected->sigma_mm});  // chi's 95 % point in space
  }
  if (all.empty()) return {};
  // One place of each map, another each time.
  return {all[seed % all.size()]};
}

int run(int trials, const std::string& only) {
  const auto wanted = [&](const std::string& kind) { return only.empty() || kind.find(only) != std::string::npos; };
  fmt::print(
      "| calibration | figure | trials | within the 95 % bound | bound over the errors' 95 % "
      "|\n|---|---|---|---|---|\n");
  const std::vector<std::string> lens{"fx", "fy", "cx", "cy"};
  if (wanted("lens")) {
    study("lens, 15 views", lens, trials, [](unsigned s) { return lens_trial({}, s); });
    study("lens, 8 views", lens, trials, [](unsigned s) { return lens_trial({.views = 8}, s); });
    study("lens of no model, 15 views", lens, trials, [](unsigned s) { return lens_trial({.foreign = true}, s); });
    study("lens, board bent by 0.2 mm", lens, trials, [](unsigned s) { return lens_trial({.bent_mm = 0.2}, s); });
  }
  const std::vector<std::string> hand_eye{"all six", "at the board", "board's size"};
  if (wanted("hand-eye stations")) {
    study("20 hand-eye stations", hand_eye, trials, [](unsigned s) { return stations_trial(20, false, s); });
    study("8 hand-eye stations", hand_eye, trials, [](unsigned s) { return stations_trial(8, false, s); });
    study("20 hand-eye stations, lens calibrated", hand_eye, trials,
          [](unsigned s) { return stations_trial(20, true, s); });
  }
  if (wanted("good stations")) study_good_stations(trials);
  if (wanted("hand-eye stream")) {
    const std::vector<std::string> figures{"all six", "at the board", "clock offset"};
    for (const auto& [lasting_s, bent_mm] : {std::pair(0.1, 0.0), {1.5, 0.0}, {1.5, 2.0}, {5.0, 2.0}}) {
      study(fmt::format("hand-eye stream, errors last {} s, field bent by {} mm", lasting_s, bent_mm), figures, trials,
            [lasting_s = lasting_s, bent_mm = bent_mm](unsigned s) {
              return stream_trial({.lasting_s = lasting_s, .bent_mm = bent_mm, .seed = s});
            });
    }
  }
  if (wanted("tip")) {
    study("tip, errors of single poses", {"tip"}, trials, [](unsigned s) { return tip_trial(0, s); });
    study("tip, errors that last 1 s", {"tip"}, trials, [](unsigned s) { return tip_trial(10, s); });
  }
  if (wanted("latency")) study("latency", {"offset"}, trials, latency_trial);
  if (wanted("field")) {
    study("field of 10 mm", {"a place"}, trials, [](unsigned s) { return field_trial(10, s); });
    study("field of 40 mm", {"a place"}, trials, [](unsigned s) { return field_trial(40, s); });
  }
  return 0;
}

}  // namespace
}  // namespace birdseye::testing

int main(int argc, char** argv) {
  const int trials = argc > 1 ? std::atoi(argv[1]) : 200;
  return birdseye::testing::run(std::max(1, trials), argc > 2 ? argv[2] : "");
}
