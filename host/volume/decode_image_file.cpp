#include <fmt/format.h>
#include <itkImageIOBase.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/lower_case.hpp"
#include "drivers/system/part_file.hpp"
#include "drivers/system/process_copy.hpp"
#include "host/confine/allowance.hpp"
#include "host/volume/decode.hpp"
#include "host/volume/nifti_file.hpp"
#include "host/volume/stated_geometry.hpp"
#include "host/volume/unread_form.hpp"
#include "host/volume/voxel_bytes.hpp"
#include "host/volume/voxel_types.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

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

/// Reads the header. Why it cannot be read, where that is known; throws where it is not.
std::string read_information(itk::ImageIOBase& io, const std::optional<NiftiFile>& nifti) {
  try {
    io.ReadImageInformation();
    return {};
  } catch (const std::exception&) {
    std::string why = nifti ? nifti->unread_place() : std::string();
    if (why.empty()) throw;
    return why;
  }
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

Result<ImageFile> decode_image_file(const VolumeSource& source, int components, GeometryFrom from) {
  const fs::path& path = source.path;
  const itk::ImageIOBase::Pointer io = image_io(path, false);
  if (const std::string why = unread_form(path); !why.empty()) return refused(Errc::unsupported, path, why);
  if (io == nullptr)
    return refused(Errc::bad_format, path, "is no image that can be read; give DICOM, NIfTI, NRRD, MHA or MHD");
  const Error cut = refused(Errc::bad_format, path, "is cut short or damaged; export it again");
  try {
    const bool is_nifti = std::string(io->GetNameOfClass()) == "NiftiImageIO";
    const auto nifti = is_nifti ? NiftiFile::open(path) : std::nullopt;
    if (nifti && !nifti->header_is_sound()) {
      return refused(Errc::bad_value, path,
                     "has numbers in its header that are not finite or no place of a patient; export it again");
    }
    if (is_nifti && !nifti) {
      return refused(Errc::unsupported, path, "is no NIfTI-1 file by its header; save it as NIfTI-1");
    }
    if (nifti) {
      if (const std::string fault = nifti->type_fault(); !fault.empty()) return refused(Errc::unsupported, path, fault);
      if (const std::string fault = nifti->reading_fault(); !fault.empty())
        return refused(Errc::unsupported, path, fault);
      if (!nifti->holds_voxels() && !names_other_files(path)) {
        return refused(Errc::unsupported, path,
                       "keeps its voxels in another file, as only a header does: name it .hdr, beside its .img");
      }
    }
    const GeometryGaps gaps = nifti ? nifti->gaps() : text_header_gaps(path);
    if (auto stated = check_stated(source, from, gaps); !stated) return stated.error();
    const auto place =
        nifti && !source.stated.orientation.empty() ? nifti->place_by(source.stated.orientation) : std::nullopt;
    if (nifti && !source.stated.orientation.empty() && nifti->says_a_place() && !place) {
      return refused(Errc::bad_value, path,
                     fmt::format("{}; {} is neither of these: give --orientation as one of the two", gaps.orientation,
                                 source.stated.orientation));
    }
    io->SetFileName(path.string());
    if (const std::string why = read_information(*io, nifti); !why.empty())
      return refused(Errc::unsupported, path, why);
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
    if (const std::string misread = misread_geometry(path, image); !misread.empty())
      return refused(Errc::unsupported, path, misread);
    if (const std::string turned = components == 3 ? turned_vectors(path) : std::string(); !turned.empty())
      return refused(Errc::unsupported, path, turned);
    const std::size_t row = static_cast<std::size_t>(components) * io->GetDimensions(0);
    if (nifti) {
      // By the file's own type: a slope makes the reader give floats where the file holds integers.
      const std::string fault = nifti->fault(nifti->bytes_of(count), nifti->bytes_of(row));
      if (!fault.empty()) return refused(Errc::bad_format, path, fault);
    } else {
      const std::size_t said = count * io->GetComponentSize(), most = said + row * io->GetComponentSize();
      const auto held = voxel_bytes(path, most);
      if (held && *held >= most) return refused(Errc::bad_format, path, too_many(*held, said));
      if (held && *held < said) return refused(Errc::bad_format, path, "is cut short or damaged; export it again");
    }
    if (!gaps.place.empty() && source.stated.orientation.empty()) {
      // Of a field, and of nothing else, all numbers depend on it: a CT and its labels are compared voxel by voxel.
      if (components != 1) return refused(Errc::bad_format, path, fmt::format("{}; export it again", gaps.place));
      image.notes.push_back(fmt::format(
          "its file {}, which is taken to be the patient's origin: points of other programs, in mm, may be of "
          "another; take them from this file",
          gaps.place));
    }
    put_stated(source, place ? &*place : nullptr, image);
    auto read = components == 1 ? read_hu(path, *io, cut, image.hu) : read_values(path, *io, cut, image.values);
    if (!read) return read.error();
    if (image.hu.size() + image.values.size() != count) return cut;
    return image;
  } catch (const std::bad_alloc&) {
    return refused(
        Errc::io, path,
        "needs more memory than there is, or than a file of its size can need; close other programs, or resample it");
  } catch (const std::exception&) {
    return cut;
  }
}

namespace {

/// Writes it, and reads it again: the writers say nothing where the disk took less than it was given.
template <typename Value>
bool write_voxels(itk::ImageIOBase& io, itk::IOComponentEnum type, const std::vector<Value>& values) {
  io.SetComponentType(type);
  io.Write(values.data());
  const fs::path path = io.GetFileName();
  const itk::ImageIOBase::Pointer again = image_io(path, false);
  if (again == nullptr) return false;
  again->SetFileName(path.string());
  again->ReadImageInformation();
  const std::size_t bytes = values.size() * sizeof(Value);
  if (again->GetComponentType() != type || static_cast<std::size_t>(again->GetImageSizeInBytes()) != bytes)
    return false;
  std::vector<char> read(bytes, kFilling);
  return read_voxels(*again, read) && std::memcmp(read.data(), values.data(), bytes) == 0;
}

bool write_to(const fs::path& path, const ImageFile& image, StoredAs stored) {
  const itk::ImageIOBase::Pointer io = image_io(path, true);
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
  if (stored == StoredAs::float32) return write_voxels(*io, itk::IOComponentEnum::FLOAT, image.values);
  if (stored == StoredAs::int16) return write_voxels(*io, itk::IOComponentEnum::SHORT, image.hu);
  return write_voxels(*io, itk::IOComponentEnum::UCHAR, std::vector<std::uint8_t>(image.hu.begin(), image.hu.end()));
}

/// Of the two files that such a name stands for only one would come into its place.
bool keeps_voxels_apart(const fs::path& path) {
  const std::string name = lower_case(path.filename().string());
  return names_other_files(path) || name.ends_with(".img") || name.ends_with(".img.gz");
}

}  // namespace

Result<void> write_image(const fs::path& path, const ImageFile& image, StoredAs stored) {
  const CopiesHeldOff held;
  if (image_io(path, true) == nullptr) return refused(Errc::bad_value, path, "name it .nii.gz, .nrrd or .mha");
  if (keeps_voxels_apart(path)) {
    return refused(Errc::bad_value, path,
                   "would keep its voxels in another file beside it; name it .nii.gz, .nrrd or .mha");
  }
  auto part = PartFile::make(path);
  if (!part) return part.error();
  std::string fault;
  try {
    if (!write_to(part->path(), image, stored)) fault = "cannot be written whole; is the disk full?";
  } catch (const std::exception&) {
    fault = "cannot be written; check the folder and its permissions, and whether the disk is full";
  }
  if (fault.empty()) return part->put_durably();
  return refused(Errc::unreadable, path, fault);
}

}  // namespace birdseye::host
