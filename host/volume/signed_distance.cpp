#include "host/volume/signed_distance.hpp"

#include <itkImage.h>
#include <itkLinearInterpolateImageFunction.h>
#include <itkNearestNeighborExtrapolateImageFunction.h>
#include <itkReinitializeLevelSetImageFilter.h>
#include <itkResampleImageFilter.h>
#include <itkSmoothingRecursiveGaussianImageFilter.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace birdseye::host {

namespace {

using Share = itk::Image<float, 3>;

constexpr double kSmoothing_mm = 1;

/// Where a mask is not 0: its first and last voxel along each axis.
struct Extent {
  std::array<int, 3> first{}, last{};
};
Extent extent_of(const Volume& grid, std::span<const std::uint8_t> mask) {
  Extent out{grid.size, {-1, -1, -1}};
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        if (mask[grid.index(i, j, k)] == 0) continue;
        const std::array<int, 3> p{i, j, k};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          out.first[axis] = std::min(out.first[axis], p[axis]);
          out.last[axis] = std::max(out.last[axis], p[axis]);
        }
      }
    }
  }
  return out;
}

/// The share of organ at each voxel, in a frame of its own: mm along the grid's axes, from the first voxel's centre on.
Share::Pointer image_of(const Volume& grid, std::span<const std::uint8_t> mask) {
  const auto image = Share::New();
  Share::SizeType size;
  Share::SpacingType spacing;
  for (unsigned axis = 0; axis < 3; ++axis) {
    size[axis] = static_cast<itk::SizeValueType>(grid.size[axis]);
    spacing[axis] = grid.spacing_mm[axis];
  }
  image->SetRegions(size);
  image->SetSpacing(spacing);
  image->Allocate();
  std::transform(mask.begin(), mask.end(), image->GetBufferPointer(),
                 [](std::uint8_t m) { return m != 0 ? 1.0F : 0.0F; });
  const auto smooth = itk::SmoothingRecursiveGaussianImageFilter<Share, Share>::New();
  smooth->SetInput(image);
  smooth->SetSigma(std::max(kSmoothing_mm, 0.5 * grid.spacing_mm.maxCoeff()));
  smooth->Update();
  return smooth->GetOutput();
}

/// At the points of another grid, whose first point is at origin_mm. Steps are of 1 there: the filters after it count
/// in them.
Share::Pointer resampled(const Share::Pointer& share, const std::array<int, 3>& points, double spacing_mm,
                         const Eigen::Vector3d& origin_mm) {
  const auto resample = itk::ResampleImageFilter<Share, Share>::New();
  resample->SetInput(share);
  resample->SetInterpolator(itk::LinearInterpolateImageFunction<Share>::New());
  resample->SetExtrapolator(itk::NearestNeighborExtrapolateImageFunction<Share, double>::New());
  Share::SizeType size;
  Share::PointType origin;
  Share::SpacingType steps;
  steps.Fill(spacing_mm);
  for (unsigned axis = 0; axis < 3; ++axis) {
    size[axis] = static_cast<itk::SizeValueType>(points[axis]);
    origin[axis] = origin_mm[axis];
  }
  resample->SetSize(size);
  resample->SetOutputOrigin(origin);
  resample->SetOutputSpacing(steps);
  resample->Update();
  const Share::Pointer out = resample->GetOutput();
  steps.Fill(1);
  out->SetSpacing(steps);
  return out;
}

/// Steps of the grid from where the values are a level, positive where they are above it: by fast marching from between
/// the grid's points. Infinite beyond most_steps, where that is given.
Share::Pointer distance_of(const Share::Pointer& values, double level, std::optional<double> most_steps) {
  const auto march = itk::ReinitializeLevelSetImageFilter<Share>::New();
  march->SetInput(values);
  march->SetLevelSetValue(level);
  if (most_steps) {
    march->NarrowBandingOn();
    march->SetOutputNarrowBandwidth(2 * *most_steps);
  }
  march->Update();
  return march->GetOutput();
}

/// An image of its own memory, points in steps of 1.
Share::Pointer grid_of(const std::array<int, 3>& points) {
  const auto out = Share::New();
  Share::SizeType size;
  for (unsigned axis = 0; axis < 3; ++axis) size[axis] = static_cast<itk::SizeValueType>(points[axis]);
  out->SetRegions(size);
  out->Allocate();
  return out;
}

constexpr int kEvery = 3;  ///< points of the grid, of which there are a multiple and one

/// Steps of the grid, positive where the share is over a half. Near the boundary each point of the grid is marched to.
/// Further off, where the distance need not be exact to a fraction of a step but must keep growing, every third is: a
/// twenty-seventh of the work. That march begins where the near one ends, four steps to either side of the boundary,
/// for between every third point a thin organ is lost.
std::vector<float> steps_from_boundary(const Share::Pointer& share, const std::array<int, 3>& points) {
  constexpr float kNear = 6, kAllNear = 4, kAllFar = 5.5F;
  const Share::Pointer near = distance_of(share, 0.5, static_cast<double>(kNear));
  const std::size_t count = grid_count(points);
  std::vector<float> out(near->GetBufferPointer(), near->GetBufferPointer() + count);
  for (float& steps : out) steps = std::clamp(steps, -kNear, kNear);
  std::array<int, 3> coarse_points{};
  for (std::size_t axis = 0; axis < 3; ++axis) coarse_points[axis] = (points[axis] - 1) / kEvery + 1;
  const Share::Pointer coarse = grid_of(coarse_points);
  float* value = coarse->GetBufferPointer();
  for (int k = 0; k < coarse_points[2]; ++k) {
    for (int j = 0; j < coarse_points[1]; ++j) {
      for (int i = 0; i < coarse_points[0]; ++i)
        *value++ = out[grid_index(points, kEvery * i, kEvery * j, kEvery * k)] / kEvery;
    }
  }
  const float* const first = coarse->GetBufferPointer();
  const auto [least, most] = std::minmax_element(first, first + grid_count(coarse_points));
  constexpr float kAll = kAllNear / kEvery;
  const Share::Pointer outside = *least < -kAll ? distance_of(coarse, -kAll, std::nullopt) : nullptr;
  const Share::Pointer inside = *most > kAll ? distance_of(coarse, kAll, std::nullopt) : nullptr;
  for (int k = 0; k < points[2]; ++k) {
    for (int j = 0; j < points[1]; ++j) {
      for (int i = 0; i < points[0]; ++i) {
        float& here = out[grid_index(points, i, j, k)];
        if (std::abs(here) < kAllNear) continue;
        const Share::Pointer& far = here < 0 ? outside : inside;
        if (!far) continue;
        const float* const steps = far->GetBufferPointer();
        const std::array<int, 3> base{i / kEvery, j / kEvery, k / kEvery};
        const std::array<float, 3> t{static_cast<float>(i % kEvery) / kEvery, static_cast<float>(j % kEvery) / kEvery,
                                     static_cast<float>(k % kEvery) / kEvery};
        float there = here < 0 ? -kAllNear : kAllNear;
        for (int n = 0; n < 8; ++n) {
          float weight = kEvery;  // of a coarse step, in steps
          std::array<int, 3> corner = base;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const int high = n >> axis & 1;
            weight *= high != 0 ? t[axis] : 1 - t[axis];
            corner[axis] += high;
          }
          if (weight > 0) there += weight * steps[grid_index(coarse_points, corner[0], corner[1], corner[2])];
        }
        const float of_far = std::clamp((std::abs(here) - kAllNear) / (kAllFar - kAllNear), 0.0F, 1.0F);
        here += of_far * (there - here);
      }
    }
  }
  return out;
}

}  // namespace

SignedDistance::SignedDistance(const std::array<int, 3>& points, double spacing_mm,
                               const Eigen::Affine3d& patient_from_box, std::span<const float> distances_mm)
    : points_(points),
      spacing_mm_(spacing_mm),
      box_mm_(spacing_mm * Eigen::Vector3d(points[0] - 1, points[1] - 1, points[2] - 1)),
      patient_from_box_(patient_from_box),
      box_from_patient_(patient_from_box.inverse()),
      values_(grid_count(points)) {
  for (int k = 0; k < points[2]; ++k) {
    for (int j = 0; j < points[1]; ++j) {
      for (int i = 0; i < points[0]; ++i) {
        const std::array<int, 3> p{i, j, k};
        Eigen::Vector4f& value = values_[grid_index(points, i, j, k)];
        value[3] = distances_mm[grid_index(points, i, j, k)];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          std::array<int, 3> low = p, high = p;
          low[axis] = std::max(0, p[axis] - 1);
          high[axis] = std::min(points[axis] - 1, p[axis] + 1);
          value[static_cast<Eigen::Index>(axis)] = (distances_mm[grid_index(points, high[0], high[1], high[2])] -
                                                    distances_mm[grid_index(points, low[0], low[1], low[2])]) /
                                                   static_cast<float>((high[axis] - low[axis]) * spacing_mm);
        }
      }
    }
  }
}

SignedDistance::Cell SignedDistance::cell_of(const Eigen::Vector3d& place_in_patient_mm) const {
  const Eigen::Vector3d place_mm = box_from_patient_ * place_in_patient_mm;
  const Eigen::Vector3d nearest_mm = place_mm.cwiseMax(0.0).cwiseMin(box_mm_);
  const Eigen::Vector3f x = (nearest_mm / spacing_mm_).cast<float>();
  Cell cell{};
  std::array<int, 3> base{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float v = x[static_cast<Eigen::Index>(axis)];
    base[axis] = std::min(static_cast<int>(v), points_[axis] - 2);
    cell.t[axis] = v - static_cast<float>(base[axis]);
  }
  cell.base = grid_index(points_, base[0], base[1], base[2]);
  cell.beyond_mm = place_mm - nearest_mm;
  return cell;
}

SignedDistance::Sample SignedDistance::sample(const Eigen::Vector3d& place_in_patient_mm) const {
  const Cell cell = cell_of(place_in_patient_mm);
  const auto row = static_cast<std::size_t>(points_[0]), slice = row * static_cast<std::size_t>(points_[1]);
  const Eigen::Vector4f* const v = &values_[cell.base];
  const auto along_x = [&](std::size_t at) -> Eigen::Vector4f { return v[at] + cell.t[0] * (v[at + 1] - v[at]); };
  const auto plane = [&](std::size_t at) -> Eigen::Vector4f {
    const Eigen::Vector4f low = along_x(at);
    return low + cell.t[1] * (along_x(at + row) - low);
  };
  const Eigen::Vector4f low = plane(0);
  const Eigen::Vector4f value = low + cell.t[2] * (plane(slice) - low);
  Sample out{static_cast<double>(value[3]), patient_from_box_.linear() * value.head<3>().cast<double>()};
  if (const double away_mm = cell.beyond_mm.norm(); away_mm > 0) {
    out.distance_mm += away_mm;
    out.gradient = patient_from_box_.linear() * cell.beyond_mm / away_mm;
  }
  return out;
}

double SignedDistance::distance_mm(const Eigen::Vector3d& place_in_patient_mm) const {
  const Cell cell = cell_of(place_in_patient_mm);
  const auto row = static_cast<std::size_t>(points_[0]), slice = row * static_cast<std::size_t>(points_[1]);
  const Eigen::Vector4f* const v = &values_[cell.base];
  const auto along_x = [&](std::size_t at) { return v[at][3] + cell.t[0] * (v[at + 1][3] - v[at][3]); };
  const auto plane = [&](std::size_t at) {
    const float low = along_x(at);
    return low + cell.t[1] * (along_x(at + row) - low);
  };
  const float low = plane(0);
  return static_cast<double>(low + cell.t[2] * (plane(slice) - low)) + cell.beyond_mm.norm();
}

Result<SignedDistance> signed_distance_of(const Volume& grid, std::span<const std::uint8_t> mask, double spacing_mm,
                                          double margin_mm) {
  const Eigen::Matrix3d axes = grid.patient_from_voxel.linear() * grid.spacing_mm.cwiseInverse().asDiagonal();
  if ((axes.transpose() * axes - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > 1e-3)
    return Error{Errc::bad_value, "the volume's axes are not at right angles; resample it"};
  constexpr int kFewest = 4;
  if (*std::min_element(grid.size.begin(), grid.size.end()) < kFewest)
    return Error{Errc::bad_value, "the volume has an axis of fewer than 4 voxels; give one of more slices"};
  const auto inside = std::count_if(mask.begin(), mask.end(), [](std::uint8_t m) { return m != 0; });
  if (inside == 0)
    return Error{Errc::not_found, "nothing of the volume is seen; check label_values and the transfer function"};
  if (static_cast<std::size_t>(inside) == mask.size())
    return Error{Errc::not_found,
                 "all of the volume is seen, and so no surface; check label_values and the transfer function"};
  const Extent extent = extent_of(grid, mask);
  std::array<int, 3> points{};
  Eigen::Vector3d origin_mm;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<Eigen::Index>(axis);
    origin_mm[n] = grid.spacing_mm[n] * extent.first[axis] - margin_mm;
    const double extent_mm = grid.spacing_mm[n] * (extent.last[axis] - extent.first[axis]) + 2 * margin_mm;
    points[axis] = kEvery * std::max(1, static_cast<int>(std::ceil(extent_mm / (kEvery * spacing_mm)))) + 1;
  }
  const Share::Pointer share = resampled(image_of(grid, mask), points, spacing_mm, origin_mm);
  if (*std::max_element(share->GetBufferPointer(), share->GetBufferPointer() + grid_count(points)) <= 0.5F) {
    return Error{
        Errc::not_found,
        "what is seen of the volume is too thin to have an inside; check label_values and the transfer function"};
  }
  std::vector<float> distances_mm = steps_from_boundary(share, points);
  for (float& d : distances_mm) d *= static_cast<float>(-spacing_mm);
  Eigen::Affine3d patient_from_box;
  patient_from_box.linear() = axes;
  patient_from_box.translation() = grid.patient_from_voxel.translation() + axes * origin_mm;
  patient_from_box.makeAffine();
  return SignedDistance(points, spacing_mm, patient_from_box, distances_mm);
}

}  // namespace birdseye::host
