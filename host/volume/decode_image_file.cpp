#include <fmt/format.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "host/volume/decode.hpp"

namespace birdseye::host {

Error refused(Errc code, const std::filesystem::path& path, const std::string& why) {
  return {code, fmt::format("{}: {}", path.string(), why)};
}

/// Appends the voxels of an image to hu; refuses those that are no Hounsfield units.
Result<void> append_voxels(const std::filesystem::path& path, const double* voxels, std::size_t count,
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

namespace {

namespace fs = std::filesystem;
using Image = itk::Image<double, 3>;

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

}  // namespace

Result<Volume> decode_image_file(const fs::path& path, const Announce& announce) {
  announce(path);
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
    if (!volume.patient_from_voxel.translation().allFinite() || !volume.spacing_mm.allFinite()) {
      return refused(Errc::bad_value, path, "has no finite place in the patient; export it again");
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

}  // namespace birdseye::host
