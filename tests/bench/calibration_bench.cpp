#include <benchmark/benchmark.h>

#include <opencv2/calib3d.hpp>

#include "calibration/camera/camera_calibration.hpp"
#include "tests/support/board_views.hpp"
#include "tests/support/hand_eye_bench.hpp"

namespace birdseye::testing {
namespace {

/// A lens like a laparoscope's, at 1920 x 1080.
CameraModel lens_1080p() {
  return {1920, 1080, 1622, 1623, 955, 548, -0.28, 0.09, 1e-4, -2e-4, 0};
}

std::vector<calibration::PatternView> views_of(int count) {
  const CameraModel lens = lens_1080p();
  const BoardScene scene{.columns = 18, .rows = 12, .pitch_mm = 4};
  std::mt19937 rng(1);
  std::vector<calibration::PatternView> views;
  for (const auto& pose : scene.poses(count, 2)) views.push_back(scene.view(lens, pose, rng, "view"));
  return views;
}

/// 30 views: all five lens models, ten folds each, robust, with covariance.
void camera_calibration(benchmark::State& state) {
  const auto views = views_of(30);
  for (auto _ : state) benchmark::DoNotOptimize(calibration::calibrate_camera(views, 1920, 1080));
}
BENCHMARK(camera_calibration)->Unit(benchmark::kMillisecond);

/// The same as the peer does it: one model, once.
void camera_calibration_one_model(benchmark::State& state) {
  const auto views = views_of(30);
  calibration::CameraCalibrationSettings settings;
  settings.model = calibration::LensModel::radial3_tangential2;
  settings.robust = false;
  settings.folds = 2;
  for (auto _ : state) benchmark::DoNotOptimize(calibration::calibrate_camera(views, 1920, 1080, settings));
}
BENCHMARK(camera_calibration_one_model)->Unit(benchmark::kMillisecond);

void camera_calibration_opencv_peer(benchmark::State& state) {
  std::vector<std::vector<cv::Point3f>> objects;
  std::vector<std::vector<cv::Point2f>> images;
  for (const auto& view : views_of(30)) {
    auto& object = objects.emplace_back();
    auto& image = images.emplace_back();
    for (std::size_t i = 0; i < view.ids.size(); ++i) {
      const Eigen::Vector3f p = view.points_in_marker_mm[i].cast<float>();
      const Eigen::Vector2f q = view.points_px[i].cast<float>();
      object.emplace_back(p.x(), p.y(), p.z());
      image.emplace_back(q.x(), q.y());
    }
  }
  for (auto _ : state) {
    cv::Mat matrix, distortion;
    std::vector<cv::Mat> turns, shifts;
    benchmark::DoNotOptimize(
        cv::calibrateCamera(objects, images, cv::Size(1920, 1080), matrix, distortion, turns, shifts));
  }
}
BENCHMARK(camera_calibration_opencv_peer)->Unit(benchmark::kMillisecond);

/// Starts, refinement, covariance, leave-one-out, over all corners.
void hand_eye_calibration(benchmark::State& state) {
  const HandEyeBench bench(HandEyeScene{
      .stations = static_cast<int>(state.range(0)), .corner_px = 0.2, .position_mm = 1.04, .angle_deg = 0.29});
  for (auto _ : state) benchmark::DoNotOptimize(calibration::calibrate_hand_eye(bench.input));
}
BENCHMARK(hand_eye_calibration)->Arg(30)->Arg(50)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace birdseye::testing

BENCHMARK_MAIN();
