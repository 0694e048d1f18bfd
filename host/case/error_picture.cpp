#include "host/case/error_picture.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "host/registration/geometry/organ_surface.hpp"
#include "host/registration/geometry/seen_surface.hpp"
#include "host/report/even_colours.hpp"
#include "host/report/slice_picture.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

constexpr int kSide_px = 250, kScale_px = 60;
constexpr std::uint8_t kGround = 32;
constexpr Colour kWriting{255, 255, 255};

/// From where the organ is looked at, head up or, from above and below, the front up. Patient LPS.
struct Side {
  const char* name;
  Vector3d look, right;
};

std::array<Side, 6> sides() {
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  return {Side{"from the front", y, x}, {"from the left", -x, y},  {"from above", -z, -x},
          {"from the back", -y, -x},    {"from the right", x, -y}, {"from below", z, x}};
}

/// A round figure that is no less than the largest.
double end_of_scale_mm(std::span<const SurfacePlace> places) {
  double most_mm = 0;
  for (const SurfacePlace& place : places) most_mm = std::max(most_mm, place.rms_mm);
  for (const double end_mm : {0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0, 15.0, 20.0}) {
    if (most_mm <= end_mm) return end_mm;
  }
  return most_mm;
}

/// From nothing to the end of the scale.
class Scale {
 public:
  explicit Scale(double end_mm) : end_mm_(end_mm) {}
  [[nodiscard]] Colour of(double mm, double brightness) const {
    Colour out = even_colour(mm / end_mm_);
    for (std::uint8_t& channel : out) channel = static_cast<std::uint8_t>(brightness * channel);
    return out;
  }
  [[nodiscard]] double end_mm() const { return end_mm_; }

 private:
  double end_mm_;
};

/// Between places, of which the nearest count most.
class Interpolated {
 public:
  explicit Interpolated(std::span<const SurfacePlace> places)
      : places_mm_(static_cast<Eigen::Index>(places.size()), 3), rms_mm_(static_cast<Eigen::Index>(places.size())) {
    for (Eigen::Index i = 0; i < rms_mm_.size(); ++i) {
      const SurfacePlace& place = places[static_cast<std::size_t>(i)];
      places_mm_.row(i) = place.seen_mm.cast<float>().transpose();
      rms_mm_[i] = static_cast<float>(place.rms_mm);
    }
  }
  [[nodiscard]] double at(const Vector3d& place_mm) const {
    constexpr float kNear_mm = 6;
    const Eigen::ArrayXf squared_mm2 =
        (places_mm_.rowwise() - place_mm.cast<float>().transpose()).rowwise().squaredNorm().array() +
        kNear_mm * kNear_mm;
    const Eigen::ArrayXf weights = squared_mm2.cube().inverse();
    return static_cast<double>((weights * rms_mm_).sum() / weights.sum());
  }

 private:
  Eigen::MatrixX3f places_mm_;
  Eigen::ArrayXf rms_mm_;
};

struct Box {
  Vector3d middle_mm;
  double longest_mm;
};

Box box_of(std::span<const SurfacePlace> places) {
  Vector3d least = places.front().seen_mm, most = least;
  for (const SurfacePlace& place : places) {
    least = least.cwiseMin(place.seen_mm);
    most = most.cwiseMax(place.seen_mm);
  }
  return {0.5 * (least + most), (most - least).maxCoeff()};
}

Picture ground(int width_px, int height_px) {
  const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  return {width_px, height_px, std::vector<std::uint8_t>(3 * pixels, kGround)};
}

Picture draw_side(const SeenSurface& surface, const Side& side, const SlicePlane& plane, const Interpolated& rms_mm,
                  const Scale& scale) {
  constexpr double kAway_mm = 1000, kShadow = 0.5;
  Picture out = ground(plane.width_px, plane.height_px);
  tbb::parallel_for(0, plane.height_px, [&](int y) {
    for (int x = 0; x < plane.width_px; ++x) {
      const Vector3d from_mm = plane.at(x + 0.5, y + 0.5) - kAway_mm * side.look;
      const auto met = surface.meet(from_mm, side.look);
      if (!met || met->distance_mm != 0) continue;
      const Vector3d place_mm = from_mm + met->depth_mm * side.look;
      const double facing = std::clamp(-surface.normal(place_mm).dot(side.look), 0.0, 1.0);
      const Colour colour = scale.of(rms_mm.at(place_mm), kShadow + (1 - kShadow) * facing);
      const auto pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(plane.width_px) + static_cast<std::size_t>(x);
      std::copy(colour.begin(), colour.end(), out.rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixel));
    }
  });
  return out;
}

void draw_scale(Picture& picture, int top_px, const Scale& scale) {
  constexpr int kAside_px = 40, kHigh_px = 14, kIntervals = 5;
  const int wide_px = picture.width_px - 2 * kAside_px;
  for (int x = 0; x < wide_px; ++x) {
    const Colour colour = scale.of(scale.end_mm() * x / wide_px, 1);
    for (int y = 0; y < kHigh_px; ++y) {
      const int pixel = (top_px + 22 + y) * picture.width_px + kAside_px + x;
      std::copy(colour.begin(), colour.end(), picture.rgb.begin() + std::ptrdiff_t{3} * pixel);
    }
  }
  draw_text(picture, {kAside_px, top_px + 16.0}, "error to be expected, mm rms", kWriting);
  for (int n = 0; n <= kIntervals; ++n) {
    const double share = static_cast<double>(n) / kIntervals;
    draw_text(picture, {kAside_px + share * wide_px - 8, top_px + 52.0}, fmt::format("{:.3g}", share * scale.end_mm()),
              kWriting);
  }
}

}  // namespace

Picture draw_expected_error(const SignedDistance& organ, std::span<const SurfacePlace> places,
                            const std::optional<Vector3d>& target_mm) {
  constexpr int kColumns = 3, kRows = 2, kCross_px = 14;
  constexpr double kFilled = 0.88;
  const SeenSurface surface(organ);
  const Interpolated rms_mm(places);
  const Scale scale(end_of_scale_mm(places));
  const Box box = box_of(places);
  Picture out = ground(kColumns * kSide_px, kRows * kSide_px + kScale_px);
  int n = 0;
  for (const Side& side : sides()) {
    const SlicePlane plane{
        box.middle_mm, side.right, side.look.cross(side.right), box.longest_mm / (kFilled * kSide_px),
        kSide_px,      kSide_px};
    Picture picture = draw_side(surface, side, plane, rms_mm, scale);
    draw_text(picture, {8, 18}, side.name, kWriting);
    if (target_mm) {
      const Eigen::Vector2d at_px = plane.px_of(*target_mm);
      draw_cross_hair(picture, at_px, kCross_px, kWriting);
      if (n == 0) draw_text(picture, at_px + Eigen::Vector2d(10, -8), "target", kWriting);
    }
    paste(out, picture, n % kColumns * kSide_px, n / kColumns * kSide_px);
    ++n;
  }
  draw_scale(out, kRows * kSide_px, scale);
  return out;
}

std::optional<Picture> expected_error_picture(const RegistrationCase& c, const CaseRegistration& result) {
  const ViewRegistration& found = result.found;
  if (!result.organ || !found.expected || found.expected->places.empty()) return std::nullopt;
  std::optional<Vector3d> target_mm;
  if (c.target_mm) target_mm = found.field.deformed_of(*c.target_mm);
  return draw_expected_error(deformed_distance(result.organ->distance, found.field), found.expected->places, target_mm);
}

}  // namespace birdseye::host
