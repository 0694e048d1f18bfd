#include "hw-sim/phantom/dicom_series.hpp"

#include <fmt/format.h>
#include <itkGDCMImageIO.h>
#include <itkImage.h>
#include <itkImageFileWriter.h>
#include <itkMetaDataObject.h>

#include <charconv>
#include <cmath>
#include <fstream>
#include <string>
#include <system_error>

#include "calibration/base/units.hpp"
#include "hw-sim/phantom/itk_image.hpp"

namespace birdseye::hw_sim {

namespace {

namespace fs = std::filesystem;

/// 2.25 is for identifiers made of a number of one's own (ITU-T X.667).
constexpr const char* kUidRoot = "2.25.7711";

std::string name_of_slice(int number) {
  return fmt::format("{:04}.dcm", number);
}

bool has_name_of_slice(const fs::path& path) {
  const std::string name = path.filename().string();
  int number = 0;
  const auto [end, fault] = std::from_chars(name.data(), name.data() + name.size(), number);
  return fault == std::errc() && name == name_of_slice(number);
}

/// Files with other names may be anybody's.
void remove_slices(const fs::path& folder, std::error_code& error) {
  for (fs::directory_iterator at(folder, error); !error && at != fs::directory_iterator(); at.increment(error)) {
    if (has_name_of_slice(at->path())) fs::remove(at->path(), error);
    if (error) return;
  }
}

/// By its name, and by the identifiers that its head has. An empty one is where the writing was cut off.
bool is_slice_of_ours(const fs::directory_entry& file) {
  std::error_code ignored;
  if (!has_name_of_slice(file.path()) || file.is_symlink(ignored) || !file.is_regular_file(ignored)) return false;
  constexpr std::size_t kPreamble = 128;
  std::string head(4096, '\0');
  std::ifstream in(file.path(), std::ios::binary);
  if (!in) return false;
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(in.gcount()));
  if (head.empty()) return true;
  return head.size() > kPreamble && head.compare(kPreamble, 4, "DICM") == 0 && head.find(kUidRoot) != std::string::npos;
}

}  // namespace

bool only_slices_of_ours(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error); !error && at != fs::directory_iterator(); at.increment(error)) {
    if (!is_slice_of_ours(*at)) return false;
  }
  return !error;
}

Result<void> write_dicom_series(const std::filesystem::path& folder, const Grid& grid, std::span<const std::int16_t> hu,
                                std::uint64_t seed, double gantry_tilt_deg) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Error{Errc::unreadable, fmt::format("{}: cannot be made; choose another --out", folder.string())};
  remove_slices(folder, error);
  if (error) {
    return Error{Errc::unreadable,
                 fmt::format("{}: the former series cannot be removed; choose another --out", folder.string())};
  }
  using Slice = itk::Image<std::int16_t, 3>;
  const std::string study = fmt::format("{}{}", kUidRoot, seed);
  try {
    for (int k = 0; k < grid.size[2]; ++k) {
      Grid one = grid;
      one.size[2] = 1;
      one.origin_mm = grid.point(0, 0, k);
      one.origin_mm.y() += std::tan(gantry_tilt_deg * kRadPerDeg) * k * grid.spacing_mm.z();
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
      writer->SetFileName((folder / name_of_slice(k + 1)).string());
      writer->Update();
    }
  } catch (const std::exception&) {
    return Error{Errc::unreadable, fmt::format("{}: cannot be written; is the disk full?", folder.string())};
  }
  return {};
}

}  // namespace birdseye::hw_sim
