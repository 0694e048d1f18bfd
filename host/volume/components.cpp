#include "host/volume/components.hpp"

#include <itkBinaryImageToLabelMapFilter.h>
#include <itkImage.h>

#include "drivers/system/process_copy.hpp"

namespace birdseye::host {

namespace {

using Mask = itk::Image<unsigned char, 3>;

void add_run(Component& c, const Mask::IndexType& first, int length) {
  for (int n = 0; n < length; ++n) {
    const Eigen::Array3i here(static_cast<int>(first[0]) + n, static_cast<int>(first[1]), static_cast<int>(first[2]));
    const Eigen::Vector3d p = here.cast<double>();
    c.low = c.low.min(here);
    c.high = c.high.max(here);
    c.sum += p;
    c.squares += p * p.transpose();
  }
  c.voxels += static_cast<std::size_t>(length);
}

}  // namespace

std::vector<Component> components_of(const Volume& ct, const std::function<void(unsigned char* mask)>& fill) {
  const CopiesHeldOff held;  // it runs while other files are read
  const auto mask = Mask::New();
  Mask::SizeType size;
  for (unsigned axis = 0; axis < 3; ++axis) size[axis] = static_cast<itk::SizeValueType>(ct.size[axis]);
  mask->SetRegions(size);
  mask->Allocate();
  fill(mask->GetBufferPointer());
  // As runs along x: an image of labels would take four times the mask, and as long to go through.
  const auto label = itk::BinaryImageToLabelMapFilter<Mask>::New();
  label->SetInput(mask);
  label->SetInputForegroundValue(1);
  label->FullyConnectedOn();
  label->Update();
  const auto* const map = label->GetOutput();
  std::vector<Component> components(map->GetNumberOfLabelObjects());
  for (std::size_t n = 0; n < components.size(); ++n) {
    const auto* const object = map->GetNthLabelObject(n);
    for (std::size_t line = 0; line < object->GetNumberOfLines(); ++line)
      add_run(components[n], object->GetLine(line).GetIndex(), static_cast<int>(object->GetLine(line).GetLength()));
  }
  return components;
}

}  // namespace birdseye::host
