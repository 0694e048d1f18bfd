#include "host/volume/marker_finder.hpp"

#include <itkConnectedComponentImageFilter.h>
#include <itkImage.h>
#include <itkImportImageFilter.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace birdseye::host {

namespace {

using Mask = itk::Image<unsigned char, 3>;
using Components = itk::Image<unsigned int, 3>;

struct Component {
  Eigen::Array3i low{1 << 30, 1 << 30, 1 << 30}, high{-1, -1, -1};
  std::size_t voxels = 0;
};

/// Connected voxels at or over the threshold, each with its bounding box.
std::vector<Component> bright_components(const Volume& ct, std::int16_t threshold) {
  const auto mask = Mask::New();
  Mask::SizeType size;
  for (unsigned axis = 0; axis < 3; ++axis) size[axis] = static_cast<itk::SizeValueType>(ct.size[axis]);
  mask->SetRegions(size);
  mask->Allocate();
  std::transform(ct.hu.begin(), ct.hu.end(), mask->GetBufferPointer(),
                 [threshold](std::int16_t hu) { return static_cast<unsigned char>(hu >= threshold ? 1 : 0); });
  const auto label = itk::ConnectedComponentImageFilter<Mask, Components>::New();
  label->SetInput(mask);
  label->FullyConnectedOn();
  label->Update();
  std::vector<Component> components(label->GetObjectCount());
  const unsigned* labels = label->GetOutput()->GetBufferPointer();
  for (int k = 0; k < ct.size[2]; ++k) {
    for (int j = 0; j < ct.size[1]; ++j) {
      for (int i = 0; i < ct.size[0]; ++i) {
        const unsigned id = labels[ct.index(i, j, k)];
        if (id == 0) continue;
        Component& c = components[id - 1];
        const Eigen::Array3i here(i, j, k);
        c.low = c.low.min(here);
        c.high = c.high.max(here);
        ++c.voxels;
      }
    }
  }
  return components;
}

bool fits(const Volume& ct, const Component& component, const MarkerShape& shape) {
  const double ball_mm3 = std::numbers::pi / 6 * std::pow(shape.diameter_mm, 3);
  const double volume_mm3 = static_cast<double>(component.voxels) * ct.spacing_mm.prod();
  if (volume_mm3 < 0.35 * ball_mm3 || volume_mm3 > 2.2 * ball_mm3) return false;
  for (int axis = 0; axis < 3; ++axis) {
    const double extent_mm = (component.high[axis] - component.low[axis] + 1) * ct.spacing_mm[axis];
    const double slack_mm = 1.5 * ct.spacing_mm[axis] + 1;
    if (std::abs(extent_mm - shape.diameter_mm) > slack_mm) return false;
  }
  return true;
}

}  // namespace

std::vector<Eigen::Vector3d> find_markers(const Volume& ct, const MarkerShape& shape) {
  struct Found {
    Eigen::Vector3d centre_mm;
    double weight;
  };
  std::vector<Found> found;
  for (const Component& component : bright_components(ct, shape.threshold_hu)) {
    if (!fits(ct, component, shape)) continue;
    // All of the ball, its partial voxels too, over a base that takes in air, skin and fat alike.
    constexpr double kBaseHu = 300;
    const Eigen::Array3i low = (component.low - 2).max(0);
    const Eigen::Array3i high = (component.high + 2).min(Eigen::Array3i(ct.size[0], ct.size[1], ct.size[2]) - 1);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight = 0;
    for (int k = low.z(); k <= high.z(); ++k) {
      for (int j = low.y(); j <= high.y(); ++j) {
        for (int i = low.x(); i <= high.x(); ++i) {
          const double w = std::max(0.0, ct.at(i, j, k) - kBaseHu);
          sum += w * Eigen::Vector3d(i, j, k);
          weight += w;
        }
      }
    }
    found.push_back({ct.patient_from_voxel * Eigen::Vector3d(sum / weight), weight});
  }
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.weight > b.weight; });
  std::vector<Eigen::Vector3d> centres;
  centres.reserve(found.size());
  for (const Found& f : found) centres.push_back(f.centre_mm);
  return centres;
}

}  // namespace birdseye::host
