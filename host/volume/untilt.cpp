#include "host/volume/untilt.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace birdseye::host {

namespace {

constexpr std::int16_t kNothing_hu = -1024;

/// A shift within a plane: whole pixels, and the share of the next one.
struct Shift {
  Eigen::Vector2i whole;
  Eigen::Vector2d share;
};

/// Of each slice, in pixels, against the least of all.
std::vector<Eigen::Vector2d> shifts_px(const std::vector<DicomSlice>& slices, const ImageFile& image) {
  std::vector<Eigen::Vector2d> shifts;
  Eigen::Vector2d least = Eigen::Vector2d::Zero();
  for (const DicomSlice& slice : slices) {
    const Eigen::Vector3d move = slice.position_mm - slices.front().position_mm;
    shifts.emplace_back(move.dot(image.axes.col(0)) / image.spacing_mm.x(),
                        move.dot(image.axes.col(1)) / image.spacing_mm.y());
    least = least.cwiseMin(shifts.back());
  }
  for (Eigen::Vector2d& shift : shifts) shift -= least;
  return shifts;
}

Shift parted(const Eigen::Vector2d& shift_px) {
  constexpr double kNone = 1e-6;  // rounding must not make a grid point of a slice's own an interpolated one
  Shift shift;
  for (int axis = 0; axis < 2; ++axis) {
    const double whole = std::floor(shift_px[axis] + kNone);
    shift.whole[axis] = static_cast<int>(whole);
    shift.share[axis] = std::max(0.0, shift_px[axis] - whole);
  }
  return shift;
}

/// The slice's value at whole pixels, nothing outside of it.
double value_at(const std::int16_t* slice, int columns, int rows, int i, int j) {
  if (i < 0 || j < 0 || i >= columns || j >= rows) return kNothing_hu;
  return slice[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(i)];
}

/// Its pixel (i, j) lies at (i, j) + shift of the plane that it is laid into.
void lay(const std::int16_t* slice, int columns, int rows, const Shift& shift, std::int16_t* plane, int wide,
         int tall) {
  const double u = shift.share.x(), v = shift.share.y();
  for (int j = 0; j < tall; ++j) {
    for (int i = 0; i < wide; ++i) {
      const int x = i - shift.whole.x(), y = j - shift.whole.y();
      const auto at = [&](int dx, int dy) { return value_at(slice, columns, rows, x - dx, y - dy); };
      const double value = (1 - v) * ((1 - u) * at(0, 0) + u * at(1, 0)) + v * ((1 - u) * at(0, 1) + u * at(1, 1));
      *plane++ = static_cast<std::int16_t>(value + std::copysign(0.5, value));
    }
  }
}

/// Two points with weights 1 - s and s, one apart, spread by the root of s (1 - s).
double spread(double share) {
  return std::sqrt(share * (1 - share));
}

/// Interpolates planes at these places, mm from the first, to even ones.
void even_out(const std::vector<double>& along_mm, double step_mm, ImageFile& image, UntiltCost& cost) {
  const auto planes = static_cast<std::size_t>(std::floor(along_mm.back() / step_mm + 1e-6)) + 1;
  const std::size_t plane = static_cast<std::size_t>(image.size[0]) * static_cast<std::size_t>(image.size[1]);
  std::vector<std::int16_t> hu(plane * planes);
  std::size_t below = 0;
  for (std::size_t k = 0; k < planes; ++k) {
    const double at_mm = step_mm * static_cast<double>(k);
    while (below + 2 < along_mm.size() && along_mm[below + 1] <= at_mm) ++below;
    const double apart_mm = along_mm[below + 1] - along_mm[below];
    const double share = std::clamp((at_mm - along_mm[below]) / apart_mm, 0.0, 1.0);
    const std::int16_t* low = image.hu.data() + below * plane;
    for (std::size_t i = 0; i < plane; ++i) {
      const double value = (1 - share) * low[i] + share * low[i + plane];
      hu[k * plane + i] = static_cast<std::int16_t>(value + std::copysign(0.5, value));
    }
    const double blur_mm = apart_mm * spread(share);
    cost.across_mm += blur_mm * blur_mm / static_cast<double>(planes);
    cost.worst_across_mm = std::max(cost.worst_across_mm, blur_mm);
  }
  cost.across_mm = std::sqrt(cost.across_mm);
  image.size[2] = static_cast<int>(planes);
  image.spacing_mm.z() = step_mm;
  image.hu = std::move(hu);
}

}  // namespace

UntiltCost untilt(const SliceStack& stack, ImageFile& image) {
  const std::vector<DicomSlice>& slices = stack.slices;
  const auto shifts = shifts_px(slices, image);
  Eigen::Vector2d most = Eigen::Vector2d::Zero();
  Eigen::Vector2d first = shifts.front();
  for (const Eigen::Vector2d& shift : shifts) most = most.cwiseMax(shift);
  const int columns = image.size[0], rows = image.size[1];
  const int wide = columns + static_cast<int>(std::ceil(most.x() - 1e-6));
  const int tall = rows + static_cast<int>(std::ceil(most.y() - 1e-6));
  const std::size_t had = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const std::size_t plane = static_cast<std::size_t>(wide) * static_cast<std::size_t>(tall);
  std::vector<std::int16_t> hu(plane * slices.size());
  UntiltCost cost;
  for (std::size_t k = 0; k < slices.size(); ++k) {
    const Shift shift = parted(shifts[k]);
    lay(image.hu.data() + k * had, columns, rows, shift, hu.data() + k * plane, wide, tall);
    const Eigen::Vector2d blur_mm(spread(shift.share.x()) * image.spacing_mm.x(),
                                  spread(shift.share.y()) * image.spacing_mm.y());
    cost.blur_mm += blur_mm.squaredNorm() / static_cast<double>(slices.size());
    cost.worst_blur_mm = std::max(cost.worst_blur_mm, blur_mm.norm());
  }
  cost.blur_mm = std::sqrt(cost.blur_mm);
  image.size = {wide, tall, image.size[2]};
  image.origin_mm = slices.front().position_mm - image.axes.col(0) * first.x() * image.spacing_mm.x() -
                    image.axes.col(1) * first.y() * image.spacing_mm.y();
  image.hu = std::move(hu);
  if (stack.usual_step_mm > 0) {
    std::vector<double> along_mm;
    along_mm.reserve(slices.size());
    for (const DicomSlice& slice : slices)
      along_mm.push_back((slice.position_mm - slices.front().position_mm).dot(image.axes.col(2)));
    even_out(along_mm, stack.usual_step_mm, image, cost);
  }
  return cost;
}

}  // namespace birdseye::host
