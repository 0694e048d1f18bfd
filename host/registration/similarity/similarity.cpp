#include "host/registration/similarity/similarity.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "host/registration/similarity/joint_histogram.hpp"

namespace birdseye::host {

namespace {

/// Sums of two pictures' values over the overlap. Whole numbers: any order of adding gives the same.
struct Moments {
  std::int64_t n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;

  void operator+=(const Moments& m) { n += m.n, a += m.a, b += m.b, aa += m.aa, bb += m.bb, ab += m.ab; }
  /// Zero where either picture is constant.
  [[nodiscard]] double correlation() const {
    const auto covariance = [this](std::int64_t xy, std::int64_t x, std::int64_t y) {
      return static_cast<double>(n) * static_cast<double>(xy) - static_cast<double>(x) * static_cast<double>(y);
    };
    const double variances = covariance(aa, a, a) * covariance(bb, b, b);
    return variances > 0 ? covariance(ab, a, b) / std::sqrt(variances) : 0;
  }
};

template <typename T>
Moments moments(const T* a, const T* b, std::span<const std::uint8_t> overlap) {
  // Short enough for the sums of products of gradients, at most 1020 * 1020, to fit 32 bits.
  constexpr std::size_t kRow = 1024;
  const std::size_t rows = (overlap.size() + kRow - 1) / kRow;
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, rows, 32), Moments{},
      [&](const tbb::blocked_range<std::size_t>& range, Moments sum) {
        for (std::size_t row = range.begin(); row != range.end(); ++row) {
          int n = 0, sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
          for (std::size_t i = row * kRow; i < std::min((row + 1) * kRow, overlap.size()); ++i) {
            const int inside = overlap[i] != 0 ? -1 : 0;
            const int x = a[i] & inside, y = b[i] & inside;
            n -= inside;
            sum_a += x;
            sum_b += y;
            aa += x * x;
            bb += y * y;
            ab += x * y;
          }
          sum += {n, sum_a, sum_b, aa, bb, ab};
        }
        return sum;
      },
      [](Moments m, const Moments& other) {
        m += other;
        return m;
      });
}

class MutualInformation : public Similarity {
 public:
  MutualInformation(JointHistogram histogram, bool normalised)
      : histogram_(std::move(histogram)), normalised_(normalised) {}
  [[nodiscard]] double value(std::span<const std::uint8_t> synthetic) const override {
    const JointHistogram::Entropies h = histogram_.entropies(synthetic);
    return normalised_ ? (h.reference + h.synthetic) / h.joint : h.mutual_information();
  }

 private:
  JointHistogram histogram_;
  bool normalised_;
};

class Correlation : public Similarity {
 public:
  explicit Correlation(const Reference& reference)
      : grey_(reference.grey.begin(), reference.grey.end()),
        overlap_(reference.overlap.begin(), reference.overlap.end()) {}
  [[nodiscard]] double value(std::span<const std::uint8_t> synthetic) const override {
    assert(synthetic.size() == grey_.size());
    return moments(grey_.data(), synthetic.data(), overlap_).correlation();
  }

 private:
  std::vector<std::uint8_t> grey_, overlap_;
};

class GradientCorrelation : public Similarity {
 public:
  explicit GradientCorrelation(const Reference& reference)
      : width_px_(reference.width_px),
        height_px_(reference.height_px),
        x_(sobel(reference.grey, true)),
        y_(sobel(reference.grey, false)) {
    const cv::Mat overlap = picture(reference.overlap) != 0;
    cv::Mat inner;
    cv::erode(overlap, inner, cv::Mat::ones(3, 3, CV_8U), {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
    overlap_.assign(inner.datastart, inner.dataend);
  }
  [[nodiscard]] double value(std::span<const std::uint8_t> synthetic) const override {
    assert(synthetic.size() == overlap_.size());
    const cv::Mat x = sobel(synthetic, true), y = sobel(synthetic, false);
    return (correlation(x_, x) + correlation(y_, y)) / 2;
  }
  [[nodiscard]] bool constant() const { return correlation(x_, x_) == 0 && correlation(y_, y_) == 0; }

 private:
  [[nodiscard]] cv::Mat picture(std::span<const std::uint8_t> grey) const {
    return {height_px_, width_px_, CV_8U, const_cast<std::uint8_t*>(grey.data())};
  }
  [[nodiscard]] cv::Mat sobel(std::span<const std::uint8_t> grey, bool along_x) const {
    cv::Mat gradient;
    cv::Sobel(picture(grey), gradient, CV_16S, along_x ? 1 : 0, along_x ? 0 : 1);
    return gradient;
  }
  [[nodiscard]] double correlation(const cv::Mat& a, const cv::Mat& b) const {
    return moments(a.ptr<std::int16_t>(), b.ptr<std::int16_t>(), overlap_).correlation();
  }

  int width_px_, height_px_;
  cv::Mat x_, y_;
  std::vector<std::uint8_t> overlap_;
};

}  // namespace

Result<void> check(const Reference& reference) {
  const auto pixels = static_cast<std::size_t>(reference.width_px) * static_cast<std::size_t>(reference.height_px);
  for (const auto& [name, size] :
       {std::pair("reference picture", reference.grey.size()), std::pair("overlap mask", reference.overlap.size())}) {
    if (size != pixels || pixels == 0) {
      return Error{Errc::bad_value, fmt::format("{}: {} pixels, not {}x{}; give one of the video's size", name, size,
                                                reference.width_px, reference.height_px)};
    }
  }
  int least = 256, most = -1;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (reference.overlap[i] == 0) continue;
    least = std::min<int>(least, reference.grey[i]);
    most = std::max<int>(most, reference.grey[i]);
  }
  if (most < 0) return Error{Errc::degenerate, "overlap mask: leaves no pixel; mask less, or take another view"};
  if (least == most) {
    return Error{Errc::degenerate, fmt::format("reference picture: constant ({}) over the overlap; is the lens covered?"
                                               " Take another view",
                                               least)};
  }
  return {};
}

const std::vector<std::string>& similarity_names() {
  static const std::vector<std::string> names{"mi", "nmi", "ncc", "gradient"};
  return names;
}

Result<std::unique_ptr<Similarity>> make_similarity(const std::string& name, const Reference& reference, int bins) {
  constexpr int kFewestBins = 2, kMostBins = 128;
  if (auto sound = check(reference); !sound) return sound.error();
  if (bins < kFewestBins || bins > kMostBins) {
    return Error{Errc::bad_value, fmt::format("bins: {}; choose {} to {}", bins, kFewestBins, kMostBins)};
  }
  const Error constant{Errc::degenerate,
                       fmt::format("reference picture: constant to the measure \"{}\"; choose another, or more bins"
                                   " or another view",
                                   name)};
  if (name == "mi" || name == "nmi") {
    JointHistogram histogram(reference.grey, reference.overlap, bins);
    if (histogram.entropies(reference.grey).reference == 0) return constant;
    return std::unique_ptr<Similarity>(std::make_unique<MutualInformation>(std::move(histogram), name == "nmi"));
  }
  if (name == "ncc") return std::unique_ptr<Similarity>(std::make_unique<Correlation>(reference));
  if (name == "gradient") {
    auto gradient = std::make_unique<GradientCorrelation>(reference);
    if (gradient->constant()) return constant;
    return std::unique_ptr<Similarity>(std::move(gradient));
  }
  return Error{Errc::bad_value,
               fmt::format("similarity \"{}\": unknown; choose one of {}", name, fmt::join(similarity_names(), ", "))};
}

}  // namespace birdseye::host
