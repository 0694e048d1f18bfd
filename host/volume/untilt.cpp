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

}  // namespace

UntiltCost untilt(const std::vector<DicomSlice>& slices, ImageFile& image) {
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
    // Two points with weights 1 - s and s, one spacing apart, spread by s (1 - s) of its square.
    const Eigen::Vector2d spread =
        (shift.share.array() * (1 - shift.share.array())).sqrt() * image.spacing_mm.head<2>().array();
    cost.blur_mm += spread.squaredNorm() / static_cast<double>(slices.size());
    cost.worst_blur_mm = std::max(cost.worst_blur_mm, spread.norm());
  }
  cost.blur_mm = std::sqrt(cost.blur_mm);
  image.size = {wide, tall, image.size[2]};
  image.origin_mm = slices.front().position_mm - image.axes.col(0) * first.x() * image.spacing_mm.x() -
                    image.axes.col(1) * first.y() * image.spacing_mm.y();
  image.hu = std::move(hu);
  return cost;
}

}  // namespace birdseye::host
