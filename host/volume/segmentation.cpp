#include "host/volume/segmentation.hpp"

#include <fmt/format.h>
#include <itkBinaryThresholdImageFilter.h>
#include <itkConnectedComponentImageFilter.h>
#include <itkConnectedThresholdImageFilter.h>
#include <itkImage.h>
#include <itkRelabelComponentImageFilter.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "host/volume/image_file.hpp"

namespace birdseye::host {

namespace {

using Scan = itk::Image<std::int16_t, 3>;
using Labels = itk::Image<std::uint8_t, 3>;

/// Without its place in the patient, which no filter here looks at.
Scan::Pointer image_of(const Volume& volume) {
  const auto image = Scan::New();
  Scan::SizeType size;
  for (unsigned axis = 0; axis < 3; ++axis) size[axis] = static_cast<itk::SizeValueType>(volume.size[axis]);
  image->SetRegions(size);
  image->Allocate();
  std::copy(volume.hu.begin(), volume.hu.end(), image->GetBufferPointer());
  return image;
}

/// The voxels with a value of the range, or those of them that a seed reaches.
Labels::Pointer in_range(const Volume& ct, const SegmentationSettings& settings,
                         const std::optional<Scan::IndexType>& seed) {
  const auto low = static_cast<std::int16_t>(std::clamp(settings.low_hu, -32768, 32767));
  const auto high = static_cast<std::int16_t>(std::clamp(settings.high_hu, -32768, 32767));
  const auto scan = image_of(ct);
  if (seed) {
    const auto grow = itk::ConnectedThresholdImageFilter<Scan, Labels>::New();
    grow->SetInput(scan);
    grow->SetLower(low);
    grow->SetUpper(high);
    grow->SetReplaceValue(1);
    grow->SetSeed(*seed);
    grow->Update();
    return grow->GetOutput();
  }
  const auto threshold = itk::BinaryThresholdImageFilter<Scan, Labels>::New();
  threshold->SetInput(scan);
  threshold->SetLowerThreshold(low);
  threshold->SetUpperThreshold(high);
  threshold->SetInsideValue(1);
  threshold->SetOutsideValue(0);
  threshold->Update();
  return threshold->GetOutput();
}

}  // namespace

Result<Volume> segment(const Volume& ct, const SegmentationSettings& settings) {
  if (settings.low_hu > settings.high_hu) {
    return Error{Errc::bad_value, fmt::format("the range {} to {} HU is empty; give the lower bound first",
                                              settings.low_hu, settings.high_hu)};
  }
  std::optional<Scan::IndexType> seed;
  if (settings.seed_in_patient_mm) {
    const Eigen::Vector3d voxel = ct.patient_from_voxel.inverse() * *settings.seed_in_patient_mm;
    seed.emplace();
    for (unsigned axis = 0; axis < 3; ++axis) {
      const double at = std::round(voxel[axis]);
      if (!(at >= 0 && at < ct.size[axis])) {
        return Error{Errc::bad_value, "the seed lies outside of the volume; it is a point of the patient, LPS, mm"};
      }
      (*seed)[axis] = static_cast<itk::IndexValueType>(at);
    }
    const int hu = ct.at(static_cast<int>((*seed)[0]), static_cast<int>((*seed)[1]), static_cast<int>((*seed)[2]));
    if (hu < settings.low_hu || hu > settings.high_hu) {
      return Error{Errc::bad_value, fmt::format("the seed has {} HU, outside of the range {} to {}", hu,
                                                settings.low_hu, settings.high_hu)};
    }
  }
  Labels::Pointer labels = in_range(ct, settings, seed);
  if (settings.largest) {
    using Parts = itk::Image<std::uint32_t, 3>;
    const auto parts = itk::ConnectedComponentImageFilter<Labels, Parts>::New();
    parts->SetInput(labels);
    const auto sorted = itk::RelabelComponentImageFilter<Parts, Parts>::New();
    sorted->SetInput(parts->GetOutput());
    const auto first = itk::BinaryThresholdImageFilter<Parts, Labels>::New();
    first->SetInput(sorted->GetOutput());
    first->SetLowerThreshold(1);
    first->SetUpperThreshold(1);
    first->SetInsideValue(1);
    first->SetOutsideValue(0);
    first->Update();
    labels = first->GetOutput();
  }
  Volume out = ct;
  std::copy_n(labels->GetBufferPointer(), out.hu.size(), out.hu.begin());
  if (std::none_of(out.hu.begin(), out.hu.end(), [](std::int16_t label) { return label != 0; })) {
    return Error{Errc::not_found,
                 fmt::format("no voxel has {} to {} HU; widen the range", settings.low_hu, settings.high_hu)};
  }
  return out;
}

Result<void> write_labels(const std::filesystem::path& path, const Volume& labels) {
  ImageFile image;
  image.size = labels.size;
  image.spacing_mm = labels.spacing_mm;
  image.origin_mm = labels.patient_from_voxel.translation();
  image.axes = labels.patient_from_voxel.linear().colwise().normalized();
  image.hu = labels.hu;
  return write_image(path, image, StoredAs::uint8);
}

}  // namespace birdseye::host
