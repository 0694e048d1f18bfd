#include <fmt/format.h>
#include <itkBinaryThresholdImageFilter.h>
#include <itkConnectedComponentImageFilter.h>
#include <itkGDCMImageIO.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkImageRegionIterator.h>
#include <itkImageSeriesReader.h>
#include <itkLinearInterpolateImageFunction.h>
#include <itkMetaImageIOFactory.h>
#include <itkNearestNeighborInterpolateImageFunction.h>
#include <itkNiftiImageIOFactory.h>
#include <itkNrrdImageIOFactory.h>
#include <itkRelabelComponentImageFilter.h>
#include <itkResampleImageFilter.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>
#include <itkSmoothingRecursiveGaussianImageFilter.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "drivers/system/whole_file.hpp"
#include "hw-sim/phantom/body.hpp"

namespace birdseye::hw_sim {

namespace {

using Image = itk::Image<float, 3>;
using Mask = itk::Image<unsigned char, 3>;
using Components = itk::Image<unsigned int, 3>;

/// A folder of one straight, even DICOM series (the host refuses others before it comes here), ordered by place.
Image::Pointer read_series(const std::filesystem::path& folder) {
  std::vector<std::pair<double, std::string>> slices;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const auto io = itk::GDCMImageIO::New();
    if (!entry.is_regular_file() || !io->CanReadFile(entry.path().c_str())) continue;
    io->SetFileName(entry.path().string());
    io->ReadImageInformation();
    const auto row = io->GetDirection(0);
    const auto column = io->GetDirection(1);
    const Eigen::Vector3d normal =
        Eigen::Vector3d(row[0], row[1], row[2]).cross(Eigen::Vector3d(column[0], column[1], column[2]));
    slices.emplace_back(normal.dot(Eigen::Vector3d(io->GetOrigin(0), io->GetOrigin(1), io->GetOrigin(2))),
                        entry.path().string());
  }
  std::sort(slices.begin(), slices.end());
  itk::ImageSeriesReader<Image>::FileNamesContainer names;
  for (const auto& [along, name] : slices) names.push_back(name);
  const auto reader = itk::ImageSeriesReader<Image>::New();
  reader->SetImageIO(itk::GDCMImageIO::New());
  reader->SetFileNames(names);
  reader->ForceOrthogonalDirectionOff();
  reader->Update();
  return reader->GetOutput();
}

Image::Pointer read(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) return read_series(path);
  const auto reader = itk::ImageFileReader<Image>::New();
  reader->SetFileName(path.string());
  reader->Update();
  return reader->GetOutput();
}

/// The box that an image with any axes fills, along the patient's axes.
Grid patient_grid(const Image& image, double finest_mm) {
  const auto size = image.GetLargestPossibleRegion().GetSize();
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
  Eigen::Vector3d high = -low;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Image::IndexType index;
    for (unsigned axis = 0; axis < 3; ++axis) {
      index[axis] = (corner >> axis & 1U) != 0 ? static_cast<itk::IndexValueType>(size[axis]) - 1 : 0;
    }
    const auto at = image.TransformIndexToPhysicalPoint<double>(index);
    for (unsigned axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], at[axis]);
      high[axis] = std::max(high[axis], at[axis]);
    }
  }
  const double spacing = std::min({finest_mm, image.GetSpacing()[0], image.GetSpacing()[1], image.GetSpacing()[2]});
  Grid grid = Grid::around(low, high, std::max(1.2, spacing));
  for (int& n : grid.size) n -= 1;  // stay inside: no voxel is made up beyond the scan
  return grid;
}

template <typename Interpolator>
Image::Pointer resample(const Image::Pointer& image, const Grid& grid, float outside) {
  const auto filter = itk::ResampleImageFilter<Image, Image>::New();
  filter->SetInput(image);
  filter->SetInterpolator(Interpolator::New());
  filter->SetDefaultPixelValue(outside);
  Image::SizeType size;
  Image::PointType origin;
  Image::SpacingType spacing;
  for (unsigned axis = 0; axis < 3; ++axis) {
    size[axis] = static_cast<itk::SizeValueType>(grid.size[axis]);
    origin[axis] = grid.origin_mm[axis];
    spacing[axis] = grid.spacing_mm[axis];
  }
  filter->SetSize(size);
  filter->SetOutputOrigin(origin);
  filter->SetOutputSpacing(spacing);
  filter->Update();
  return filter->GetOutput();
}

Mask::Pointer threshold(const Image::Pointer& image, float low, float high) {
  const auto filter = itk::BinaryThresholdImageFilter<Image, Mask>::New();
  filter->SetInput(image);
  filter->SetLowerThreshold(low);
  filter->SetUpperThreshold(high);
  filter->SetInsideValue(1);
  filter->SetOutsideValue(0);
  filter->Update();
  return filter->GetOutput();
}

/// Signed distance to the mask's border, mm, negative inside.
Image::Pointer distance_map(const Mask::Pointer& mask) {
  const auto filter = itk::SignedMaurerDistanceMapImageFilter<Mask, Image>::New();
  filter->SetInput(mask);
  filter->SetSquaredDistance(false);
  filter->SetUseImageSpacing(true);
  filter->SetInsideIsPositive(false);
  filter->Update();
  return filter->GetOutput();
}

Mask::Pointer largest_component(const Mask::Pointer& mask) {
  const auto label = itk::ConnectedComponentImageFilter<Mask, Components>::New();
  label->SetInput(mask);
  const auto order = itk::RelabelComponentImageFilter<Components, Components>::New();
  order->SetInput(label->GetOutput());
  const auto first = itk::BinaryThresholdImageFilter<Components, Mask>::New();
  first->SetInput(order->GetOutput());
  first->SetLowerThreshold(1);
  first->SetUpperThreshold(1);
  first->SetInsideValue(1);
  first->SetOutsideValue(0);
  first->Update();
  return first->GetOutput();
}

Image::Pointer smooth(const Image::Pointer& image, double sigma_mm) {
  const auto filter = itk::SmoothingRecursiveGaussianImageFilter<Image, Image>::New();
  filter->SetInput(image);
  filter->SetSigma(sigma_mm);
  filter->Update();
  return filter->GetOutput();
}

/// Erosion and dilation by a ball, by way of distances: the largest thick region of liver-like tissue on the right.
Mask::Pointer find_liver(const Image::Pointer& ct, const Grid& grid) {
  constexpr float kLowHu = 5, kHighHu = 190, kErodeMm = 10;
  const Mask::Pointer tissue = threshold(smooth(ct, 2.5), kLowHu, kHighHu);
  Mask::Pointer core = threshold(distance_map(tissue), -1e6F, -kErodeMm);
  for (itk::ImageRegionIterator<Mask> it(core, core->GetLargestPossibleRegion()); !it.IsAtEnd(); ++it) {
    if (it.GetIndex()[0] > grid.size[0] * 55 / 100) it.Set(0);
  }
  core = largest_component(core);
  Mask::Pointer grown = threshold(distance_map(core), -1e6F, kErodeMm);
  itk::ImageRegionIterator<Mask> inside(tissue, tissue->GetLargestPossibleRegion());
  for (itk::ImageRegionIterator<Mask> it(grown, grown->GetLargestPossibleRegion()); !it.IsAtEnd(); ++it, ++inside) {
    if (inside.Get() == 0) it.Set(0);
  }
  return largest_component(grown);
}

/// A signed distance over the whole patient from one on grid. A scan cuts organs off at its faces: so does this.
Field field_of(const Image::Pointer& image, const Grid& grid) {
  const auto scalars = std::make_shared<ScalarGrid>();
  scalars->grid = grid;
  scalars->values.assign(image->GetBufferPointer(), image->GetBufferPointer() + grid.voxels());
  const Eigen::Vector3d low = grid.origin_mm;
  const Eigen::Vector3d high = grid.last_mm();
  return [=](const Eigen::Vector3d& p) {
    return std::max(scalars->at(p), std::max((low - p).maxCoeff(), (p - high).maxCoeff()));
  };
}

}  // namespace

Result<Body> body_from_ct(const std::filesystem::path& ct, const std::filesystem::path& labels, int liver_label) {
  for (const std::filesystem::path& path : {ct, labels}) {
    std::error_code ignored;
    if (path.empty() || std::filesystem::is_directory(path, ignored)) continue;
    if (const auto file = open_file(path); !file) return file.error();  // the library would wait for a pipe
  }
  std::filesystem::path at_work = ct;
  try {
    itk::NiftiImageIOFactory::RegisterOneFactory();
    itk::NrrdImageIOFactory::RegisterOneFactory();
    itk::MetaImageIOFactory::RegisterOneFactory();
    const Image::Pointer source = read(ct);
    Body body;
    body.grid = patient_grid(*source, 2.0);
    const Image::Pointer image = resample<itk::LinearInterpolateImageFunction<Image, double>>(source, body.grid, -1024);
    const float* hu = image->GetBufferPointer();
    body.hu.resize(body.grid.voxels());
    for (std::size_t i = 0; i < body.hu.size(); ++i) {
      body.hu[i] = static_cast<std::int16_t>(std::lround(std::clamp(hu[i], -1024.0F, 3071.0F)));
    }
    const Mask::Pointer skin = largest_component(threshold(smooth(image, 1.5), -300, 1e6F));
    body.skin_mm = field_of(smooth(distance_map(skin), 2.0), body.grid);

    Mask::Pointer liver;
    if (labels.empty()) {
      liver = find_liver(image, body.grid);
    } else {
      at_work = labels;
      const auto wanted = static_cast<float>(liver_label);
      liver = largest_component(
          threshold(resample<itk::NearestNeighborInterpolateImageFunction<Image, double>>(read(labels), body.grid, 0),
                    wanted - 0.5F, wanted + 0.5F));
    }
    body.liver_mm = field_of(smooth(distance_map(liver), 2.5), body.grid);
    return body;
  } catch (const std::exception&) {
    // ITK's own message is many lines of its source places; the file and the remedy are what a user needs.
    return Error{Errc::unreadable,
                 fmt::format("{}: cannot be read as a CT; give a DICOM folder, NIfTI, NRRD or MHA", at_work.string())};
  }
}

}  // namespace birdseye::hw_sim
