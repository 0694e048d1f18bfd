#pragma once

#include <itkImage.h>

#include <algorithm>
#include <span>

#include "hw-sim/phantom/grid.hpp"

namespace birdseye::hw_sim {

/// An image on a grid of the patient, for ITK to write.
template <typename Pixel>
typename itk::Image<Pixel, 3>::Pointer image_of(const Grid& grid, std::span<const Pixel> values) {
  using Image = itk::Image<Pixel, 3>;
  const auto image = Image::New();
  typename Image::SizeType size;
  typename Image::PointType origin;
  typename Image::SpacingType spacing;
  for (unsigned axis = 0; axis < 3; ++axis) {
    size[axis] = static_cast<itk::SizeValueType>(grid.size[axis]);
    origin[axis] = grid.origin_mm[axis];
    spacing[axis] = grid.spacing_mm[axis];
  }
  image->SetRegions(size);
  image->SetOrigin(origin);
  image->SetSpacing(spacing);
  image->Allocate();
  std::copy(values.begin(), values.end(), image->GetBufferPointer());
  return image;
}

}  // namespace birdseye::hw_sim
