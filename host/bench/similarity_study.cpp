#include "host/bench/similarity_study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/median.hpp"
#include "drivers/system/clock.hpp"
#include "host/bench/bench_machine.hpp"
#include "host/registration/similarity/parzen_mutual_information.hpp"
#include "host/registration/similarity/similarity.hpp"

namespace birdseye::host {

namespace {

constexpr int kPictureWidth_px = 768, kPictureHeight_px = 576, kBins = 64;

/// A lit, noisy ellipse with some texture on black; number shifts it.
std::vector<std::uint8_t> bench_picture(int number) {
  std::mt19937 random(static_cast<unsigned>(number));
  std::uniform_real_distribution<double> noise(-12, 12);
  std::vector<std::uint8_t> grey;
  grey.reserve(std::size_t{kPictureWidth_px} * kPictureHeight_px);
  for (int y = 0; y < kPictureHeight_px; ++y) {
    for (int x = 0; x < kPictureWidth_px; ++x) {
      const double r = std::hypot((x - 384 - 3 * number) / 300.0, (y - 288) / 220.0);
      const double texture = 40 * std::sin(0.04 * x + 0.1 * number) * std::cos(0.05 * y);
      const double value = r < 1 ? 60 + 90 * (1 - r * r) + texture + noise(random) : 0;
      grey.push_back(static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0)));
    }
  }
  return grey;
}

/// The peer: OpenCV's histogram, and equation 4 as it stands.
double opencv_mutual_information(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  const auto picture = [](const std::vector<std::uint8_t>& grey) {
    return cv::Mat(kPictureHeight_px, kPictureWidth_px, CV_8U, const_cast<std::uint8_t*>(grey.data()));
  };
  const cv::Mat pictures[] = {picture(a), picture(b)};
  const int channels[] = {0, 1}, sizes[] = {kBins, kBins};
  const float range[] = {0, 256};
  const float* ranges[] = {range, range};
  cv::Mat joint;
  cv::calcHist(pictures, 2, channels, cv::Mat(), joint, 2, sizes, ranges);
  joint /= static_cast<double>(a.size());
  cv::Mat of_a, of_b;
  cv::reduce(joint, of_a, 1, cv::REDUCE_SUM);
  cv::reduce(joint, of_b, 0, cv::REDUCE_SUM);
  double sum = 0;
  for (int i = 0; i < kBins; ++i) {
    for (int j = 0; j < kBins; ++j) {
      const double p = joint.at<float>(i, j);
      if (p > 0) sum += p * std::log(p / (of_a.at<float>(i) * of_b.at<float>(j)));
    }
  }
  return sum;
}

/// The least of some rounds' medians: of rounds, that in which the machine had least else to do. Ours and the peer's
/// rounds take turns, for both to meet the same machine.
struct SimilarityTimer {
  std::function<double()> work;
  double value = 0, best_ms = 0;

  void round() {
    constexpr int kCalls = 41;
    value = work();  // wakes the threads
    std::vector<double> times_ms;
    for (int i = 0; i < kCalls; ++i) {
      const HostTime began = host_now();
      value = work();
      times_ms.push_back((host_now() - began).seconds() * 1e3);
    }
    const double ms = median_of(std::move(times_ms));
    best_ms = best_ms > 0 ? std::min(best_ms, ms) : ms;
  }
};

}  // namespace

Result<nlohmann::json> similarity_study(int rounds) {
  const std::vector<std::uint8_t> video = bench_picture(0), synthetic = bench_picture(1);
  const std::vector<std::uint8_t> everywhere(video.size(), 1);
  const Reference reference{kPictureWidth_px, kPictureHeight_px, video, everywhere};
  std::vector<double> grey, gradient(video.size());
  for (const std::uint8_t g : synthetic) grey.push_back(g == 0 ? -0.25 : g / 255.0);

  std::vector<std::unique_ptr<Similarity>> measures;
  std::vector<std::pair<std::string, SimilarityTimer>> timers;
  timers.emplace_back("opencv mi", SimilarityTimer{[&] { return opencv_mutual_information(video, synthetic); }});
  for (const std::string& name : similarity_names()) {
    auto measure = make_similarity(name, reference, kBins);
    if (!measure) return measure.error();
    measures.push_back(*std::move(measure));
    timers.emplace_back(name, SimilarityTimer{[&synthetic, m = measures.back().get()] { return m->value(synthetic); }});
  }
  const auto parzen = ParzenMutualInformation::make(reference);
  if (!parzen) return parzen.error();
  timers.emplace_back("parzen mi", SimilarityTimer{[&] { return parzen->value(grey); }});
  timers.emplace_back("parzen mi and gradient",
                      SimilarityTimer{[&] { return parzen->value_and_gradient(grey, gradient); }});
  for (int round = 0; round < rounds; ++round) {
    for (auto& [name, timer] : timers) timer.round();
  }

  const SimilarityTimer &peer = timers[0].second, &mi = timers[1].second;
  nlohmann::json rows = nlohmann::json::array();
  for (const auto& [name, timer] : timers) {
    const bool is_parzen = name.starts_with("parzen");
    nlohmann::json row = {{"measure", name},
                          {"viewport", fmt::format("{}x{}", kPictureWidth_px, kPictureHeight_px)},
                          {"value", timer.value},
                          {"value_ms_median", timer.best_ms}};
    if (name != "ncc" && name != "gradient")
      row["bins"] = is_parzen ? ParzenMutualInformation::Settings{}.synthetic_bins : kBins;
    if (name == "mi") {
      row["opencv_ms_median"] = peer.best_ms;
      row["opencv_ratio"] = peer.best_ms / mi.best_ms;
    }
    rows.push_back(std::move(row));
  }
  // Values are judged here; times are for whoever knows the machine. OpenCV counts in single precision.
  constexpr double kMostApart = 1e-4;
  const bool sound = std::abs(mi.value - peer.value) <= kMostApart;
  return nlohmann::json{
      {"rows", rows},
      {"machine", bench_machine()},
      {"rounds", rounds},
      {"verdict", sound ? "pass" : "fail"},
      {"reasons", {fmt::format("mutual information {:.6f}, by OpenCV's histogram {:.6f}", mi.value, peer.value)}}};
}

}  // namespace birdseye::host
