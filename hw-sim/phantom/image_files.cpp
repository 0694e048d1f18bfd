#include "hw-sim/phantom/image_files.hpp"

#include <fmt/format.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkVector.h>

#include <vector>

#include "hw-sim/phantom/itk_image.hpp"

namespace birdseye::hw_sim {

namespace {

template <typename Io, typename Pixel>
Result<void> write(const std::filesystem::path& path, const Grid& grid, std::span<const Pixel> values) {
  try {
    const auto writer = itk::ImageFileWriter<itk::Image<Pixel, 3>>::New();
    writer->SetInput(image_of<Pixel>(grid, values));
    writer->SetImageIO(Io::New());
    writer->SetFileName(path.string());
    writer->UseCompressionOn();
    writer->Update();
  } catch (const std::exception&) {
    return Error{Errc::unreadable, fmt::format("{}: cannot be written; is the disk full?", path.string())};
  }
  return {};
}

}  // namespace

Result<void> write_volume(const std::filesystem::path& path, const Grid& grid, std::span<const std::int16_t> hu) {
  return write<itk::NiftiImageIO>(path, grid, hu);
}

Result<void> write_labels(const std::filesystem::path& path, const Grid& grid, std::span<const std::uint8_t> labels) {
  return write<itk::NiftiImageIO>(path, grid, labels);
}

Result<LabelVolume> read_labels(const std::filesystem::path& path) {
  using Image = itk::Image<std::uint8_t, 3>;
  try {
    const auto reader = itk::ImageFileReader<Image>::New();
    reader->SetImageIO(itk::NiftiImageIO::New());
    reader->SetFileName(path.string());
    reader->Update();
    const Image& image = *reader->GetOutput();
    const Image::RegionType region = image.GetLargestPossibleRegion();
    LabelVolume out;
    for (unsigned axis = 0; axis < 3; ++axis) {
      out.grid.size[axis] = static_cast<int>(region.GetSize()[axis]);
      out.grid.origin_mm[axis] = image.GetOrigin()[axis];
      out.grid.spacing_mm[axis] = image.GetSpacing()[axis];
    }
    out.labels.assign(image.GetBufferPointer(), image.GetBufferPointer() + region.GetNumberOfPixels());
    return out;
  } catch (const std::exception&) {
    return Error{Errc::unreadable, fmt::format("{}: no labels can be read from it; make the patient anew with "
                                               "`birdseye-sim phantom`",
                                               path.string())};
  }
}

Result<void> write_field(const std::filesystem::path& path, const Grid& grid,
                         std::span<const Eigen::Vector3f> displacement_mm) {
  using Displacement = itk::Vector<float, 3>;
  std::vector<Displacement> values;
  values.reserve(displacement_mm.size());
  for (const Eigen::Vector3f& u : displacement_mm) {
    Displacement v;
    for (unsigned axis = 0; axis < 3; ++axis) v[axis] = u[axis];
    values.push_back(v);
  }
  return write<itk::MetaImageIO>(path, grid, std::span<const Displacement>(values));
}

}  // namespace birdseye::hw_sim
