#include "host/volume/import.hpp"

#include <fmt/format.h>
#include <itkGDCMImageIO.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Image = itk::Image<double, 3>;

Error refused(Errc code, const fs::path& path, const std::string& why) {
  return {code, fmt::format("{}: {}", path.string(), why)};
}

/// Appends the voxels of an image to hu; refuses those that are no Hounsfield units.
Result<void> append_voxels(const fs::path& path, const double* voxels, std::size_t count,
                           std::vector<std::int16_t>& hu) {
  for (std::size_t i = 0; i < count; ++i) {
    const double value = voxels[i];
    if (!std::isfinite(value)) {
      return refused(Errc::bad_value, path, "has voxels that are not finite numbers; export it again");
    }
    if (value < std::numeric_limits<std::int16_t>::min() || value > std::numeric_limits<std::int16_t>::max()) {
      return refused(Errc::bad_value, path,
                     fmt::format("has a value of {:g}, which is no Hounsfield unit; is it a CT?", value));
    }
    hu.push_back(static_cast<std::int16_t>(std::lround(value)));
  }
  return {};
}

/// One DICOM slice's header.
struct Slice {
  fs::path path;
  std::string series;
  std::array<std::size_t, 2> size{};
  Eigen::Vector3d position_mm, row, column;
  Eigen::Vector2d spacing_mm;
  double thickness_mm = 0;
};

bool is_dicom(const fs::path& path) {
  const auto io = itk::GDCMImageIO::New();
  return io->CanReadFile(path.c_str());
}

std::optional<Slice> read_slice_header(const fs::path& path) {
  try {
    const auto io = itk::GDCMImageIO::New();
    if (!io->CanReadFile(path.c_str())) return std::nullopt;
    io->SetFileName(path.string());
    io->ReadImageInformation();
    Slice slice;
    slice.path = path;
    itk::ExposeMetaData<std::string>(io->GetMetaDataDictionary(), "0020|000e", slice.series);
    slice.size = {io->GetDimensions(0), io->GetDimensions(1)};
    for (unsigned axis = 0; axis < 3; ++axis) {
      slice.position_mm[axis] = io->GetOrigin(axis);
      slice.row[axis] = io->GetDirection(0)[axis];
      slice.column[axis] = io->GetDirection(1)[axis];
    }
    slice.spacing_mm = {io->GetSpacing(0), io->GetSpacing(1)};
    slice.thickness_mm = io->GetSpacing(2);
    return slice;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

/// All slices must be of one stack before they may be put on one another.
Result<void> check_same_stack(const fs::path& folder, const std::vector<Slice>& slices) {
  std::map<std::string, int> series;
  for (const Slice& s : slices) ++series[s.series];
  if (series.size() > 1) {
    return refused(Errc::unsupported, folder,
                   fmt::format("holds {} series; give a folder that holds one", series.size()));
  }
  const Slice& first = slices.front();
  for (const Slice& s : slices) {
    if (s.size != first.size || (s.spacing_mm - first.spacing_mm).norm() > 1e-4) {
      return refused(Errc::unsupported, folder,
                     fmt::format("{} has another size or pixel spacing than {}; give a folder "
                                 "that holds one series",
                                 s.path.filename().string(), first.path.filename().string()));
    }
    if ((s.row - first.row).norm() > 1e-3 || (s.column - first.column).norm() > 1e-3) {
      return refused(Errc::unsupported, folder,
                     fmt::format("{} is turned against {}; give a folder that holds one series",
                                 s.path.filename().string(), first.path.filename().string()));
    }
  }
  return {};
}

/// Sorts the slices along their normal and returns the step between them.
Result<double> sort_and_check_steps(const fs::path& folder, std::vector<Slice>& slices) {
  const Eigen::Vector3d normal = slices.front().row.cross(slices.front().column).normalized();
  std::sort(slices.begin(), slices.end(),
            [&](const Slice& a, const Slice& b) { return a.position_mm.dot(normal) < b.position_mm.dot(normal); });
  if (slices.size() == 1) {
    return slices.front().thickness_mm > 0 ? slices.front().thickness_mm : 1.0;
  }
  const auto along = [&](std::size_t i) { return slices[i].position_mm.dot(normal); };
  for (std::size_t i = 1; i < slices.size(); ++i) {
    if (along(i) - along(i - 1) < 0.01) {
      return refused(Errc::unsupported, folder,
                     fmt::format("{} and {} lie at the same place; remove the doubled slices",
                                 slices[i - 1].path.filename().string(), slices[i].path.filename().string()));
    }
  }
  const double step = (along(slices.size() - 1) - along(0)) / static_cast<double>(slices.size() - 1);
  for (std::size_t i = 1; i < slices.size(); ++i) {
    const std::string here = slices[i].path.filename().string();
    const std::string before = slices[i - 1].path.filename().string();
    const Eigen::Vector3d move = slices[i].position_mm - slices[i - 1].position_mm;
    const double forward = move.dot(normal);
    const double sideways = (move - forward * normal).norm();
    if (sideways > 0.02 * forward + 0.01) {
      const double tilt_deg = std::atan2(sideways, forward) * 180 / std::numbers::pi;
      return refused(Errc::unsupported, folder,
                     fmt::format("the gantry was tilted by {:.1f} degrees, so the slices do not "
                                 "stack straight; resample it with a DICOM converter first",
                                 tilt_deg));
    }
    if (std::abs(forward - step) > 0.02 * step + 0.01) {
      return refused(Errc::unsupported, folder,
                     fmt::format("the step from {} to {} is {:.2f} mm where the mean is {:.2f}: "
                                 "slices are missing or unevenly spaced; export the whole series",
                                 before, here, forward, step));
    }
  }
  return step;
}

Result<Volume> stack(const fs::path& named, std::vector<Slice> slices) {
  if (auto same = check_same_stack(named, slices); !same) return same.error();
  const auto step = sort_and_check_steps(named, slices);
  if (!step) return step.error();
  const Slice& first = slices.front();
  Volume volume;
  volume.size = {static_cast<int>(first.size[0]), static_cast<int>(first.size[1]), static_cast<int>(slices.size())};
  volume.spacing_mm = {first.spacing_mm.x(), first.spacing_mm.y(), *step};
  Eigen::Matrix3d axes;
  axes << first.row, first.column, first.row.cross(first.column).normalized();
  volume.patient_from_voxel.linear() = axes * volume.spacing_mm.asDiagonal();
  volume.patient_from_voxel.translation() = first.position_mm;
  volume.hu.reserve(first.size[0] * first.size[1] * slices.size());
  for (const Slice& slice : slices) {
    try {
      const auto reader = itk::ImageFileReader<Image>::New();
      reader->SetImageIO(itk::GDCMImageIO::New());
      reader->SetFileName(slice.path.string());
      reader->Update();
      const auto region = reader->GetOutput()->GetLargestPossibleRegion().GetSize();
      if (region[0] != first.size[0] || region[1] != first.size[1] || region[2] != 1) {
        return refused(Errc::unsupported, slice.path, "holds several frames; give a series of one slice a file");
      }
      if (auto done =
              append_voxels(slice.path, reader->GetOutput()->GetBufferPointer(), region[0] * region[1], volume.hu);
          !done) {
        return done.error();
      }
    } catch (const std::exception&) {
      return refused(Errc::unreadable, slice.path, "its pixels cannot be decoded; export it again, uncompressed");
    }
  }
  return volume;
}

Result<Volume> import_dicom_folder(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!entry.is_regular_file()) continue;
    if (entry.file_size() == 0) {
      return refused(Errc::unreadable, entry.path(), "is an empty file in the series; copy the series again");
    }
    files.push_back(entry.path());
  }
  if (error) return refused(Errc::unreadable, folder, "cannot be listed; check its permissions");
  if (files.empty()) return refused(Errc::not_found, folder, "is empty; give the folder that holds the DICOM files");
  std::sort(files.begin(), files.end());
  std::vector<Slice> slices;
  for (const fs::path& file : files) {
    if (auto slice = read_slice_header(file)) slices.push_back(*std::move(slice));
  }
  if (slices.empty())
    return refused(Errc::bad_format, folder, "holds no DICOM image; give the folder that holds the series");
  return stack(folder, std::move(slices));
}

/// MetaImage's reader takes a file that is cut short for one that ends in zeros. Uncompressed voxels need their bytes.
bool meta_image_is_cut(const fs::path& path, std::uint64_t image_bytes) {
  std::ifstream in(path, std::ios::binary);
  std::string line;
  fs::path voxels = path;
  while (std::getline(in, line) && line.size() < 4096) {
    if (line.find("CompressedData = True") != std::string::npos) return false;
    const auto at = line.find("ElementDataFile = ");
    if (at == std::string::npos) continue;
    const std::string name = line.substr(at + 18);
    if (name != "LOCAL") voxels = path.parent_path() / name;
    break;
  }
  const std::uint64_t header_bytes = voxels == path ? static_cast<std::uint64_t>(in.tellg()) : 0;
  std::error_code error;
  const std::uint64_t file_bytes = fs::file_size(voxels, error);
  return !error && file_bytes < header_bytes + image_bytes;
}

/// The NIfTI reader does too. zlib counts what is there, compressed or not.
bool nifti_is_cut(const fs::path& path, std::uint64_t image_bytes) {
  const gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) return true;
  std::vector<char> chunk(1U << 18U);
  std::uint64_t count = 0;
  int got = 0;
  while ((got = gzread(file, chunk.data(), static_cast<unsigned>(chunk.size()))) > 0)
    count += static_cast<std::uint64_t>(got);
  const bool sound = gzclose_r(file) == Z_OK;
  constexpr std::uint64_t kLeastHeader = 348;
  return !sound || got < 0 || count < kLeastHeader + image_bytes;
}

/// Its reader turns what is not finite into zeros, so the file's own floating-point voxels are looked at.
bool nifti_has_non_finite(const fs::path& path) {
  const gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) return false;
  std::array<char, 348> header{};
  bool found = false;
  if (gzread(file, header.data(), header.size()) == static_cast<int>(header.size())) {
    std::int32_t header_size = 0;
    std::int16_t type = 0;
    float offset = 0;
    std::memcpy(&header_size, header.data(), sizeof header_size);
    std::memcpy(&type, header.data() + 70, sizeof type);
    std::memcpy(&offset, header.data() + 108, sizeof offset);
    // Files of the other byte order are rare; theirs are left to the check after reading.
    const bool ours = header_size == 348 && offset >= 348 && offset < 1e6F;
    const int bytes = ours && type == 16 ? 4 : ours && type == 64 ? 8 : 0;
    if (bytes != 0 && gzseek(file, static_cast<z_off_t>(offset), SEEK_SET) >= 0) {
      std::vector<char> chunk(1U << 18U);
      int got = 0;
      while (!found && (got = gzread(file, chunk.data(), static_cast<unsigned>(chunk.size()))) > 0) {
        for (int at = 0; at + bytes <= got && !found; at += bytes) {
          float single = 0;
          double twice = 0;
          if (bytes == 4) {
            std::memcpy(&single, chunk.data() + at, sizeof single);
          } else {
            std::memcpy(&twice, chunk.data() + at, sizeof twice);
          }
          found = !std::isfinite(single) || !std::isfinite(twice);
        }
      }
    }
  }
  gzclose_r(file);
  return found;
}

itk::ImageIOBase::Pointer reader_for(const fs::path& path) {
  const std::string name = path.string();
  for (const itk::ImageIOBase::Pointer& io :
       {itk::ImageIOBase::Pointer(itk::NiftiImageIO::New()), itk::ImageIOBase::Pointer(itk::NrrdImageIO::New()),
        itk::ImageIOBase::Pointer(itk::MetaImageIO::New())}) {
    if (io->CanReadFile(name.c_str())) return io;
  }
  return nullptr;
}

Result<Volume> import_image_file(const fs::path& path) {
  const itk::ImageIOBase::Pointer io = reader_for(path);
  if (io == nullptr) {
    return refused(Errc::bad_format, path, "is no image that can be read; give DICOM, NIfTI, NRRD, MHA or MHD");
  }
  try {
    io->SetFileName(path.string());
    io->ReadImageInformation();
    for (unsigned axis = 3; axis < io->GetNumberOfDimensions(); ++axis) {
      if (io->GetDimensions(axis) > 1)
        return refused(Errc::unsupported, path, "has more than three dimensions; give one volume of it");
    }
    if (io->GetNumberOfDimensions() < 3 || io->GetDimensions(2) < 2) {
      return refused(Errc::unsupported, path, "is a picture, not a volume; give the whole stack");
    }
    if (io->GetNumberOfComponents() != 1)
      return refused(Errc::unsupported, path, "has several values a voxel; give a CT");
    const std::string kind = io->GetNameOfClass();
    const auto image_bytes = static_cast<std::uint64_t>(io->GetImageSizeInBytes());
    const bool single_nifti = kind == "NiftiImageIO" && path.extension() != ".hdr" && path.extension() != ".img";
    if ((kind == "MetaImageIO" && meta_image_is_cut(path, image_bytes)) ||
        (single_nifti && nifti_is_cut(path, image_bytes))) {
      return refused(Errc::bad_format, path, "is cut short or damaged; export it again");
    }
    if (single_nifti && nifti_has_non_finite(path)) {
      return refused(Errc::bad_value, path, "has voxels that are not finite numbers; export it again");
    }
    const auto reader = itk::ImageFileReader<Image>::New();
    reader->SetImageIO(io);
    reader->SetFileName(path.string());
    reader->Update();
    const Image& image = *reader->GetOutput();
    Volume volume;
    const auto size = image.GetLargestPossibleRegion().GetSize();
    Eigen::Matrix3d axes;
    for (unsigned row = 0; row < 3; ++row) {
      volume.size[row] = static_cast<int>(size[row]);
      volume.spacing_mm[row] = image.GetSpacing()[row];
      volume.patient_from_voxel.translation()[row] = image.GetOrigin()[row];
      for (unsigned column = 0; column < 3; ++column) axes(row, column) = image.GetDirection()(row, column);
    }
    if (!(volume.spacing_mm.minCoeff() > 0) || !axes.allFinite() || !(axes.transpose() * axes).isIdentity(1e-3)) {
      return refused(Errc::unsupported, path, "its axes are sheared or have no length; resample it first");
    }
    volume.patient_from_voxel.linear() = axes * volume.spacing_mm.asDiagonal();
    const std::size_t voxels = size[0] * size[1] * size[2];
    volume.hu.reserve(voxels);
    if (auto done = append_voxels(path, image.GetBufferPointer(), voxels, volume.hu); !done) return done.error();
    return volume;
  } catch (const std::exception&) {
    return refused(Errc::unreadable, path, "is cut short or damaged; export it again");
  }
}

}  // namespace

Result<Volume> import_volume(const fs::path& path) {
  // Warnings of the toolkits go to standard error from inside; what matters comes back as an Error.
  itk::Object::GlobalWarningDisplayOff();
  std::error_code error;
  if (!fs::exists(path, error)) return refused(Errc::not_found, path, "no such file or folder");
  if (fs::is_directory(path, error)) return import_dicom_folder(path);
  if (!std::ifstream(path)) return refused(Errc::unreadable, path, "cannot be opened; check its permissions");
  if (is_dicom(path)) {
    auto slice = read_slice_header(path);
    if (!slice) return refused(Errc::bad_format, path, "is DICOM, and holds no image");
    return stack(path, {*std::move(slice)});
  }
  return import_image_file(path);
}

}  // namespace birdseye::host
