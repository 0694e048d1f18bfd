#include <fmt/format.h>
#include <itkImageIOBase.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/volume/decode.hpp"

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

  [[nodiscard]] bool header_is_finite() const {
    // pixdim, vox_offset, scl_slope, scl_inter, quaternion and offsets, the three rows of the affine map.
    for (const auto& [begin, end] : {std::pair{76UL, 120UL}, {256UL, 328UL}}) {
      for (std::size_t at = begin; at < end; at += 4) {
        if (!std::isfinite(number<float>(at))) return false;
      }
    }
    return true;
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

template <typename T>
void convert(const std::vector<char>& bytes, std::vector<float>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    T value;
    std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
    values[i] = static_cast<float>(value);
  }
}

/// False for types that hold no numbers.
bool convert(itk::IOComponentEnum type, const std::vector<char>& bytes, std::vector<float>& values) {
  using Type = itk::IOComponentEnum;
  constexpr std::pair<Type, void (*)(const std::vector<char>&, std::vector<float>&)> kTypes[] = {
      {Type::UCHAR, convert<unsigned char>},   {Type::CHAR, convert<signed char>},
      {Type::USHORT, convert<unsigned short>}, {Type::SHORT, convert<short>},
      {Type::UINT, convert<unsigned>},         {Type::INT, convert<int>},
      {Type::ULONG, convert<unsigned long>},   {Type::LONG, convert<long>},
      {Type::FLOAT, convert<float>},           {Type::DOUBLE, convert<double>}};
  for (const auto& [known, converter] : kTypes) {
    if (known != type) continue;
    converter(bytes, values);
    return true;
  }
  return false;
}

/// All of the image is to be read, or written.
void take_whole(itk::ImageIOBase& io) {
  itk::ImageIORegion whole(io.GetNumberOfDimensions());
  for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis) whole.SetSize(axis, io.GetDimensions(axis));
  io.SetIORegion(whole);
}

/// The voxels as the file has them. The readers leave what a damaged or missing file does not give as it was, and some
/// say nothing: what differs after two readings over two fillings was never read.
std::optional<std::vector<char>> read_voxels(itk::ImageIOBase& io) {
  take_whole(io);
  std::vector<char> first(static_cast<std::size_t>(io.GetImageSizeInBytes()), '\x55');
  io.Read(first.data());
  std::vector<char> second(first.size(), '\xAA');
  io.Read(second.data());
  if (first != second) return std::nullopt;
  return first;
}

}  // namespace

Result<ImageFile> decode_image_file(const fs::path& path, int components) {
  const itk::ImageIOBase::Pointer io = image_io(path, false);
  if (io == nullptr) {
    return refused(Errc::bad_format, path, "is no image that can be read; give DICOM, NIfTI, NRRD, MHA or MHD");
  }
  const std::string cut = "is cut short or damaged; export it again";
  try {
    const auto nifti = std::string(io->GetNameOfClass()) == "NiftiImageIO" ? NiftiFile::open(path) : std::nullopt;
    if (nifti && !nifti->header_is_finite()) {
      return refused(Errc::bad_value, path, "has numbers in its header that are not finite; export it again");
    }
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
      image.origin_mm[axis] = io->GetOrigin(axis);
      for (unsigned row = 0; row < 3; ++row) image.axes(row, axis) = io->GetDirection(axis)[row];
    }
    const auto bytes_expected = static_cast<std::size_t>(io->GetImageSizeInBytes());
    if (nifti) {
      // By the file's own type: a slope makes the reader give floats where the file holds integers.
      const std::string fault = nifti->fault(nifti->bytes_of(count));
      if (!fault.empty()) return refused(Errc::bad_format, path, fault);
    }
    const auto bytes = read_voxels(*io);
    if (!bytes || bytes->size() != bytes_expected) return refused(Errc::bad_format, path, cut);
    image.values.resize(count);
    if (!convert(io->GetComponentType(), *bytes, image.values)) {
      return refused(Errc::unsupported, path, "holds no plain numbers; export it as 16-bit integers");
    }
    return image;
  } catch (const std::bad_alloc&) {
    return refused(Errc::io, path, "needs more memory than there is; close other programs, or resample it");
  } catch (const std::exception&) {
    return refused(Errc::unreadable, path, cut);
  }
}

Result<void> write_image(const fs::path& path, const ImageFile& image, StoredAs stored) {
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
      const std::vector<std::int16_t> whole(image.values.begin(), image.values.end());
      io->Write(whole.data());
    } else {
      io->SetComponentType(itk::IOComponentEnum::UCHAR);
      const std::vector<std::uint8_t> bytes(image.values.begin(), image.values.end());
      io->Write(bytes.data());
    }
    return {};
  } catch (const std::exception&) {
    return refused(Errc::unreadable, path, "cannot be written; check the folder and its permissions");
  }
}

}  // namespace birdseye::host
