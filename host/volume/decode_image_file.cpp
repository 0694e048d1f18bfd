#include <fmt/format.h>
#include <itkImageIOBase.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "drivers/system/process_copy.hpp"
#include "host/volume/decode.hpp"
#include "host/volume/stated_geometry.hpp"
#include "host/volume/voxel_types.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// The parts of a NIfTI-1 header that the toolkit believes unseen: it turns voxels that are not finite into zeros, and
/// ends a file that is cut short in zeros too.
class NiftiFile {
 public:
  /// Empty where the file is no single-file or paired NIfTI-1.
  static std::optional<NiftiFile> open(const fs::path& path) {
    NiftiFile file;
    if (!read(path, 0, file.header_.data(), file.header_.size())) return std::nullopt;
    const auto size = file.number<std::int32_t>(0);
    file.swapped_ = size != kHeaderBytes;
    if (file.number<std::int32_t>(0) != kHeaderBytes) return std::nullopt;
    const bool pair = std::memcmp(file.header_.data() + 344, "ni1", 3) == 0;
    file.voxels_ = path;
    if (pair) file.voxels_ = image_of(path);
    const float offset = file.number<float>(108);
    file.offset_ = pair ? 0 : 352;
    if (offset > static_cast<float>(file.offset_) && offset < 1e9F) file.offset_ = static_cast<std::size_t>(offset);
    file.offset_is_sound_ = offset >= 0 && offset < 1e9F;
    return file;
  }

  /// Whether its numbers are finite, and those of places no further off than a patient may lie: the reader takes for
  /// ever over 1e38 mm.
  [[nodiscard]] bool header_is_sound() const {
    // pixdim, vox_offset, scl_slope, scl_inter, quaternion and offsets, the three rows of the affine map.
    constexpr float kFurthest = 1e6F;
    for (const auto& [begin, end, most] :
         {std::tuple{76UL, 108UL, kFurthest}, {108UL, 120UL, INFINITY}, {256UL, 328UL, kFurthest}}) {
      for (std::size_t at = begin; at < end; at += 4) {
        if (!std::isfinite(number<float>(at)) || std::abs(number<float>(at)) > most) return false;
      }
    }
    return true;
  }

  /// What is wrong with what the header says of where the voxels lie; empty where it says so, and once.
  [[nodiscard]] std::string geometry_fault(const std::array<int, 3>& size) const {
    const bool by_quaternion = number<std::int16_t>(252) > 0, by_matrix = number<std::int16_t>(254) > 0;
    if (!by_quaternion && !by_matrix)
      return "does not say where its voxels lie (neither its qform nor its sform is set); save it again by the "
             "program that made it, or convert the DICOM series anew";
    if (!by_quaternion || !by_matrix) return {};
    double apart_mm = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector4d voxel((corner & 1) * (size[0] - 1), (corner >> 1 & 1) * (size[1] - 1),
                                  (corner >> 2) * (size[2] - 1), 1);
      apart_mm = std::max(apart_mm, ((quaternion_map() - matrix_map()) * voxel).norm());
    }
    const double least_mm = std::min({number<float>(80), number<float>(84), number<float>(88)});
    if (apart_mm <= 0.5 * least_mm) return {};
    return fmt::format(
        "says two places for its voxels, {:.1f} mm apart: its qform and its sform differ; keep the one "
        "that is right (as by fslorient -copysform2qform)",
        apart_mm);
  }

  /// Of so many numbers, by bitpix.
  [[nodiscard]] std::size_t bytes_of(std::size_t count) const {
    return count * static_cast<std::size_t>(std::max<std::int16_t>(8, number<std::int16_t>(72))) / 8;
  }

  /// What is wrong with the voxels, of so many bytes; empty where they are whole and finite.
  [[nodiscard]] std::string fault(std::size_t image_bytes) const {
    if (!offset_is_sound_) return "is damaged in its header; export it again";
    const gzFile file = gzopen(voxels_.c_str(), "rb");
    if (file == nullptr) return "lacks the file of its voxels; copy both";
    const auto type = number<std::int16_t>(70);
    const std::size_t step = type == 16 ? 4 : type == 64 ? 8 : 0;
    std::vector<char> chunk(1U << 18U);
    std::size_t count = 0;
    bool finite = true;
    int got = 0;
    if (gzseek(file, static_cast<z_off_t>(offset_), SEEK_SET) >= 0) {
      while ((got = gzread(file, chunk.data(), static_cast<unsigned>(chunk.size()))) > 0) {
        count += static_cast<std::size_t>(got);
        for (std::size_t at = 0; step != 0 && at + step <= static_cast<std::size_t>(got) && finite; at += step) {
          finite = step == 4 ? std::isfinite(ordered<float>(chunk.data() + at))
                             : std::isfinite(ordered<double>(chunk.data() + at));
        }
      }
    }
    const bool sound = gzclose_r(file) == Z_OK && got == 0;
    if (!sound || count < image_bytes) return "is cut short or damaged; export it again";
    if (!finite) return "has voxels that are not finite numbers; export it again";
    return {};
  }

 private:
  static constexpr std::int32_t kHeaderBytes = 348;
  using Map = Eigen::Matrix<double, 3, 4>;  // from voxel indices to mm, RAS

  [[nodiscard]] Map matrix_map() const {
    Map map;
    for (int k = 0; k < 12; ++k) map(k / 4, k % 4) = number<float>(280 + 4 * static_cast<std::size_t>(k));
    return map;
  }
  [[nodiscard]] Map quaternion_map() const {
    const double b = number<float>(256), c = number<float>(260), d = number<float>(264);
    const double a = std::sqrt(std::max(0.0, 1 - b * b - c * c - d * d));
    const double handedness = number<float>(76) < 0 ? -1 : 1;
    Map map;
    map.leftCols<3>() =
        Eigen::Quaterniond(a, b, c, d).normalized().toRotationMatrix() *
        Eigen::Vector3d(number<float>(80), number<float>(84), handedness * number<float>(88)).asDiagonal();
    map.col(3) = Eigen::Vector3d(number<float>(268), number<float>(272), number<float>(276));
    return map;
  }

  static bool read(const fs::path& path, std::size_t offset, char* to, std::size_t bytes) {
    const gzFile file = gzopen(path.c_str(), "rb");
    if (file == nullptr) return false;
    const bool whole = gzseek(file, static_cast<z_off_t>(offset), SEEK_SET) >= 0 &&
                       gzread(file, to, static_cast<unsigned>(bytes)) == static_cast<int>(bytes);
    gzclose_r(file);
    return whole;
  }
  static fs::path image_of(fs::path header) {
    const bool zipped = header.extension() == ".gz";
    if (zipped) header.replace_extension();
    header.replace_extension(zipped ? ".img.gz" : ".img");
    return header;
  }
  template <typename T>
  [[nodiscard]] T ordered(const char* at) const {
    std::array<char, sizeof(T)> bytes{};
    std::memcpy(bytes.data(), at, sizeof(T));
    if (swapped_) std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
  }
  template <typename T>
  [[nodiscard]] T number(std::size_t at) const {
    return ordered<T>(header_.data() + at);
  }

  std::array<char, kHeaderBytes> header_{};
  bool swapped_ = false, offset_is_sound_ = true;
  std::size_t offset_ = 0;
  fs::path voxels_;
};

/// What reads the file, or would write it; null for nothing.
itk::ImageIOBase::Pointer image_io(const fs::path& path, bool writing) {
  for (const itk::ImageIOBase::Pointer& io :
       {itk::ImageIOBase::Pointer(itk::NiftiImageIO::New()), itk::ImageIOBase::Pointer(itk::NrrdImageIO::New()),
        itk::ImageIOBase::Pointer(itk::MetaImageIO::New())}) {
    if (writing ? io->CanWriteFile(path.c_str()) : io->CanReadFile(path.c_str())) return io;
  }
  return nullptr;
}

/// All of the image is to be read, or written.
void take_whole(itk::ImageIOBase& io) {
  itk::ImageIORegion whole(io.GetNumberOfDimensions());
  for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis) whole.SetSize(axis, io.GetDimensions(axis));
  io.SetIORegion(whole);
}

constexpr double kLeastSpacingMm = 0.01;

constexpr char kFilling = '\xA5';  // as 16 bits no Hounsfield unit of a patient, so that it shows

/// Whether there is a value that is all filling, or one that ends in it at the end, where a file may be cut.
template <typename Bits>
bool shows_filling(std::span<const char> bytes) {
  Bits filling;
  std::memset(&filling, kFilling, sizeof filling);
  std::size_t left = 0;
  for (std::size_t at = 0; at + sizeof(Bits) <= bytes.size(); at += sizeof(Bits)) {
    Bits value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    left += value == filling ? 1 : 0;  // counted to the end: that is many times faster than stopping
  }
  return left > 0 || bytes.back() == kFilling;
}

bool shows_filling(std::span<const char> bytes, std::size_t value_bytes) {
  switch (value_bytes) {
    case 2:
      return shows_filling<std::uint16_t>(bytes);
    case 4:
      return shows_filling<std::uint32_t>(bytes);
    case 8:
      return shows_filling<std::uint64_t>(bytes);
    default:
      return shows_filling<std::uint8_t>(bytes);
  }
}

/// The voxels as the file has them, over kFilling. The readers leave what a damaged or missing file does not give as it
/// was, and some say nothing: where the filling shows, a second reading over another one tells what was never read.
bool read_voxels(itk::ImageIOBase& io, std::span<char> filled) {
  take_whole(io);
  io.Read(filled.data());
  if (!shows_filling(filled, io.GetComponentSize())) return true;
  std::vector<char> second(filled.size(), '\x5A');
  io.Read(second.data());
  return std::equal(filled.begin(), filled.end(), second.begin());
}

/// Where one value a voxel is what is due. cut: why to refuse a file that does not give all voxels.
Result<void> read_hu(const fs::path& path, itk::ImageIOBase& io, const Error& cut, std::vector<std::int16_t>& hu) {
  const auto bytes = static_cast<std::size_t>(io.GetImageSizeInBytes());
  if (io.GetComponentType() == itk::IOComponentEnum::SHORT) {
    std::int16_t filling = 0;
    std::memset(&filling, kFilling, sizeof filling);
    hu.assign(bytes / sizeof filling, filling);
    if (!read_voxels(io, {reinterpret_cast<char*>(hu.data()), bytes})) return cut;
    return {};
  }
  std::vector<char> values(bytes, kFilling);
  if (!read_voxels(io, values)) return cut;
  Result<void> read;
  const bool numbers =
      with_type(io.GetComponentType(), [&](auto type) { read = append_hu<decltype(type)>(path, values, hu); });
  if (!numbers) return refused(Errc::unsupported, path, "holds no plain numbers; export it as 16-bit integers");
  return read;
}

Result<void> read_values(const fs::path& path, itk::ImageIOBase& io, const Error& cut, std::vector<float>& values) {
  std::vector<char> bytes(static_cast<std::size_t>(io.GetImageSizeInBytes()), kFilling);
  if (!read_voxels(io, bytes)) return cut;
  const bool numbers = with_type(io.GetComponentType(), [&](auto value) {
    for (std::size_t at = 0; at + sizeof value <= bytes.size(); at += sizeof value) {
      std::memcpy(&value, bytes.data() + at, sizeof value);
      values.push_back(static_cast<float>(value));
    }
  });
  if (!numbers) return refused(Errc::unsupported, path, "holds no plain numbers; export it as 16-bit integers");
  return {};
}

}  // namespace

Result<ImageFile> decode_image_file(const fs::path& path, int components) {
  const itk::ImageIOBase::Pointer io = image_io(path, false);
  if (io == nullptr) {
    return refused(Errc::bad_format, path, "is no image that can be read; give DICOM, NIfTI, NRRD, MHA or MHD");
  }
  const std::string why_cut = "is cut short or damaged; export it again";
  try {
    const auto nifti = std::string(io->GetNameOfClass()) == "NiftiImageIO" ? NiftiFile::open(path) : std::nullopt;
    if (nifti && !nifti->header_is_sound()) {
      return refused(Errc::bad_value, path,
                     "has numbers in its header that are not finite or no place of a patient; export it again");
    }
    if (const std::string unstated = unstated_geometry(path); !unstated.empty())
      return refused(Errc::bad_format, path, unstated);
    io->SetFileName(path.string());
    io->ReadImageInformation();
    for (unsigned axis = 3; axis < io->GetNumberOfDimensions(); ++axis) {
      if (io->GetDimensions(axis) > 1)
        return refused(Errc::unsupported, path, "has more than three dimensions; give one volume of it");
    }
    if (io->GetNumberOfDimensions() < 3 || io->GetDimensions(2) < 2) {
      return refused(Errc::unsupported, path, "is a picture, not a volume; give the whole stack");
    }
    if (static_cast<int>(io->GetNumberOfComponents()) != components) {
      return refused(Errc::unsupported, path,
                     fmt::format("has {} values a voxel where {} is due; give {}", io->GetNumberOfComponents(),
                                 components, components == 1 ? "a CT" : "a displacement field"));
    }
    ImageFile image;
    image.components = components;
    std::size_t count = static_cast<std::size_t>(components);
    for (unsigned axis = 0; axis < 3; ++axis) {
      if (io->GetDimensions(axis) > 65535) return refused(Errc::bad_value, path, "is too large to be a scan");
      image.size[axis] = static_cast<int>(io->GetDimensions(axis));
      count *= io->GetDimensions(axis);
      image.spacing_mm[axis] = io->GetSpacing(axis);
      if (image.spacing_mm[axis] < kLeastSpacingMm) {
        return refused(
            Errc::bad_value, path,
            fmt::format("has voxels {:.4g} mm apart; is it in metres? Export it in mm", io->GetSpacing(axis)));
      }
      image.origin_mm[axis] = io->GetOrigin(axis);
      for (unsigned row = 0; row < 3; ++row) image.axes(row, axis) = io->GetDirection(axis)[row];
    }
    if (nifti) {
      if (const std::string fault = nifti->geometry_fault(image.size); !fault.empty())
        return refused(Errc::bad_value, path, fault);
      // By the file's own type: a slope makes the reader give floats where the file holds integers.
      const std::string fault = nifti->fault(nifti->bytes_of(count));
      if (!fault.empty()) return refused(Errc::bad_format, path, fault);
    }
    const Error cut = refused(Errc::bad_format, path, why_cut);
    auto read = components == 1 ? read_hu(path, *io, cut, image.hu) : read_values(path, *io, cut, image.values);
    if (!read) return read.error();
    if (image.hu.size() + image.values.size() != count) return cut;
    return image;
  } catch (const std::bad_alloc&) {
    return refused(Errc::io, path, "needs more memory than there is; close other programs, or resample it");
  } catch (const std::exception&) {
    return refused(Errc::unreadable, path, why_cut);
  }
}

Result<void> write_image(const fs::path& path, const ImageFile& image, StoredAs stored) {
  const CopiesHeldOff held;
  const itk::ImageIOBase::Pointer io = image_io(path, true);
  if (io == nullptr) return refused(Errc::bad_value, path, "name it .nii.gz, .nrrd or .mha");
  try {
    io->SetFileName(path.string());
    io->SetNumberOfDimensions(3);
    for (unsigned axis = 0; axis < 3; ++axis) {
      io->SetDimensions(axis, static_cast<itk::SizeValueType>(image.size[axis]));
      io->SetSpacing(axis, image.spacing_mm[axis]);
      io->SetOrigin(axis, image.origin_mm[axis]);
      const Eigen::Vector3d direction = image.axes.col(axis);
      io->SetDirection(axis, std::vector<double>(direction.begin(), direction.end()));
    }
    io->SetNumberOfComponents(static_cast<unsigned>(image.components));
    io->SetPixelType(image.components == 1 ? itk::IOPixelEnum::SCALAR : itk::IOPixelEnum::VECTOR);
    io->UseCompressionOn();
    take_whole(*io);
    if (stored == StoredAs::float32) {
      io->SetComponentType(itk::IOComponentEnum::FLOAT);
      io->Write(image.values.data());
    } else if (stored == StoredAs::int16) {
      io->SetComponentType(itk::IOComponentEnum::SHORT);
      io->Write(image.hu.data());
    } else {
      io->SetComponentType(itk::IOComponentEnum::UCHAR);
      const std::vector<std::uint8_t> bytes(image.hu.begin(), image.hu.end());
      io->Write(bytes.data());
    }
    return {};
  } catch (const std::exception&) {
    return refused(Errc::unreadable, path, "cannot be written; check the folder and its permissions");
  }
}

}  // namespace birdseye::host
