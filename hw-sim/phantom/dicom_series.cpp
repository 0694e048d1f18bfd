#include "hw-sim/phantom/dicom_series.hpp"

#include <fmt/format.h>
#include <itkGDCMImageIO.h>
#include <itkImage.h>
#include <itkImageFileWriter.h>
#include <itkImportImageFilter.h>
#include <itkMetaDataObject.h>
#include <itkNiftiImageIO.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace birdseye::hw_sim {

namespace {

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

}  // namespace

Result<void> write_dicom_series(const std::filesystem::path& folder, const Grid& grid, std::span<const std::int16_t> hu,
                                std::uint64_t seed, double gantry_tilt_deg) {
  std::error_code error;
  std::filesystem::remove_all(folder, error);
  std::filesystem::create_directories(folder, error);
  if (error) return Error{Errc::unreadable, fmt::format("{}: cannot be made; choose another --out", folder.string())};
  using Slice = itk::Image<std::int16_t, 3>;
  // The root 2.25 is for identifiers made of a number of one's own (ITU-T X.667).
  const std::string study = fmt::format("2.25.7711{}", seed);
  try {
    for (int k = 0; k < grid.size[2]; ++k) {
      Grid one = grid;
      one.size[2] = 1;
      one.origin_mm = grid.point(0, 0, k);
      one.origin_mm.y() += std::tan(gantry_tilt_deg * std::numbers::pi / 180) * k * grid.spacing_mm.z();
      const auto slice = image_of<std::int16_t>(one, hu.subspan(grid.index(0, 0, k), one.voxels()));
      itk::MetaDataDictionary& tags = slice->GetMetaDataDictionary();
      const auto put = [&](const char* tag, const std::string& value) {
        itk::EncapsulateMetaData<std::string>(tags, tag, value);
      };
      const Eigen::Vector3d& at = one.origin_mm;
      put("0008|0016", "1.2.840.10008.5.1.4.1.1.2");  // CT Image Storage
      put("0008|0018", fmt::format("{}.3.{}", study, k + 1));
      put("0008|0008", "DERIVED\\SECONDARY\\AXIAL");
      put("0008|0020", "20200101");
      put("0008|0021", "20200101");
      put("0008|0023", "20200101");
      put("0008|0030", "120000");
      put("0008|0060", "CT");
      put("0008|0064", "SYN");
      put("0008|0070", "Birdseye simulator");
      put("0010|0010", "Phantom^Abdomen");
      put("0010|0020", fmt::format("SIM{}", seed));
      put("0018|0050", fmt::format("{:g}", grid.spacing_mm.z()));
      put("0018|5100", "HFS");
      put("0020|000d", study + ".1");
      put("0020|000e", study + ".2");
      put("0020|0052", study + ".4");
      put("0020|0011", "1");
      put("0020|0013", fmt::format("{}", k + 1));
      put("0020|0032", fmt::format("{:.6g}\\{:.6g}\\{:.6g}", at.x(), at.y(), at.z()));
      put("0020|0037", "1\\0\\0\\0\\1\\0");
      put("0020|1041", fmt::format("{:.6g}", at.z()));
      put("0028|0004", "MONOCHROME2");
      put("0028|1052", "0");
      put("0028|1053", "1");
      const auto io = itk::GDCMImageIO::New();
      io->KeepOriginalUIDOn();
      const auto writer = itk::ImageFileWriter<Slice>::New();
      writer->SetInput(slice);
      writer->SetImageIO(io);
      writer->SetFileName((folder / fmt::format("{:04}.dcm", k + 1)).string());
      writer->Update();
    }
  } catch (const std::exception&) {
    return Error{Errc::unreadable, fmt::format("{}: cannot be written; is the disk full?", folder.string())};
  }
  return {};
}

Result<void> write_labels(const std::filesystem::path& path, const Grid& grid, std::span<const std::uint8_t> labels) {
  using Labels = itk::Image<std::uint8_t, 3>;
  try {
    const auto writer = itk::ImageFileWriter<Labels>::New();
    writer->SetInput(image_of<std::uint8_t>(grid, labels));
    writer->SetImageIO(itk::NiftiImageIO::New());
    writer->SetFileName(path.string());
    writer->UseCompressionOn();
    writer->Update();
  } catch (const std::exception&) {
    return Error{Errc::unreadable, fmt::format("{}: cannot be written; is the disk full?", path.string())};
  }
  return {};
}

}  // namespace birdseye::hw_sim
