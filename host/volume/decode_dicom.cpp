#include <fmt/format.h>
#include <itkGDCMImageIO.h>
#include <itkMetaDataObject.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <new>
#include <numbers>
#include <sstream>

#include "host/volume/decode.hpp"
#include "host/volume/voxel_types.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// One DICOM slice's header.
struct Slice {
  fs::path path;
  std::string series;
  std::array<std::size_t, 2> size{};
  Eigen::Vector3d position_mm, row, column;
  Eigen::Vector2d spacing_mm;
  double thickness_mm = 0;
};

std::string text_of(const itk::GDCMImageIO& io, const char* tag) {
  std::string text;
  itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), tag, text);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.pop_back();
  return text;
}

/// GDCM fills pixels that the file no longer holds with zeros, and says nothing. Looks for the pixel data element
/// (DICOM PS3.5, 7.1 and A.4), the last of its tag since an icon may come before, and whether the file holds all of it.
/// Of what it does not find (deflated or big-endian files) it says nothing either.
bool is_cut(const fs::path& path, std::size_t pixel_bytes) {
  std::error_code error;
  std::string bytes(fs::file_size(path, error), '\0');
  std::ifstream(path, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  using namespace std::string_literals;
  const std::size_t element = bytes.rfind("\xE0\x7F\x10\x00"s);
  if (element == std::string::npos) return false;
  const std::string vr = bytes.substr(element + 4, 2);
  const bool is_explicit = vr == "OW" || vr == "OB" || vr == "UN";
  const std::size_t values = element + (is_explicit ? 12 : 8);
  if (values > bytes.size()) return true;
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + values - 4, sizeof length);
  constexpr std::uint32_t kEncapsulated = 0xFFFFFFFF;
  if (length == kEncapsulated) return bytes.find("\xFE\xFF\xDD\xE0"s, values) == std::string::npos;
  return bytes.size() - values < length || length < pixel_bytes;
}

/// The numbers of a tag, as "1\\0.5"; empty where one of them is none, or is not finite.
std::vector<double> numbers_of(const itk::GDCMImageIO& io, const char* tag) {
  std::vector<double> numbers;
  std::istringstream words(text_of(io, tag));
  for (std::string word; std::getline(words, word, '\\');) {
    char* end = nullptr;
    const double number = std::strtod(word.c_str(), &end);
    if (end == word.c_str() ||
        word.find_first_not_of(' ', static_cast<std::size_t>(end - word.c_str())) != std::string::npos ||
        !std::isfinite(number)) {
      return {};
    }
    numbers.push_back(number);
  }
  return numbers;
}

/// GDCM makes up what is missing or makes no sense: an origin of zero, axes of LPS, millimetres, no rescaling.
Result<void> check_tags(const fs::path& path, const itk::GDCMImageIO& io) {
  const auto spacing = numbers_of(io, "0028|0030");
  if (spacing.size() != 2 || !(spacing[0] > 0) || !(spacing[1] > 0)) {
    return refused(Errc::bad_value, path, "has no sound Pixel Spacing (0028,0030); export it again");
  }
  if (numbers_of(io, "0020|0032").size() != 3) {
    return refused(Errc::bad_value, path, "has no sound Image Position (0020,0032); export it again");
  }
  const auto axes = numbers_of(io, "0020|0037");
  if (axes.size() == 6) {
    const Eigen::Vector3d row(axes[0], axes[1], axes[2]), column(axes[3], axes[4], axes[5]);
    if (std::abs(row.norm() - 1) < 0.01 && std::abs(column.norm() - 1) < 0.01 && std::abs(row.dot(column)) < 0.01) {
      for (const char* tag : {"0028|1052", "0028|1053"}) {
        std::string text;
        const bool there = itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), tag, text);
        const auto numbers = numbers_of(io, tag);
        const bool slope = std::string(tag) == "0028|1053";
        if (there && (numbers.size() != 1 || (slope && !(numbers[0] > 0)))) {
          return refused(Errc::bad_value, path,
                         "has no sound Rescale Intercept and Slope (0028,1052); export it again");
        }
      }
      if (text_of(io, "0028|0004") != "MONOCHROME2") {
        return refused(Errc::unsupported, path, "is not MONOCHROME2, as a CT is; export it again");
      }
      return {};
    }
  }
  return refused(Errc::bad_value, path, "has no sound Image Orientation (0020,0037); export it again");
}

Result<Slice> read_slice_header(const fs::path& path, const Announce& announce) {
  announce(path);
  const auto io = itk::GDCMImageIO::New();
  try {
    io->SetFileName(path.string());
    io->ReadImageInformation();
  } catch (const std::exception&) {
    return refused(Errc::bad_format, path,
                   "is DICOM, and holds no image that can be read; copy it again, or remove it");
  }
  if (const std::string modality = text_of(*io, "0008|0060"); modality != "CT") {
    return refused(Errc::unsupported, path, fmt::format("is of modality '{}'; give a series of modality CT", modality));
  }
  if (io->GetNumberOfComponents() != 1) {
    return refused(Errc::unsupported, path, "is a colour picture; give the series that it was made from");
  }
  if (io->GetNumberOfDimensions() > 2 && io->GetDimensions(2) > 1) {
    return refused(Errc::unsupported, path, "holds several frames; give a series of one slice a file");
  }
  if (auto sound = check_tags(path, *io); !sound) return sound.error();
  const auto bits = numbers_of(*io, "0028|0100");
  const std::size_t pixel_bytes = bits.size() != 1 || bits[0] < 8 ? 0
                                                                  : io->GetDimensions(0) * io->GetDimensions(1) *
                                                                        static_cast<std::size_t>(bits[0]) / 8;
  if (is_cut(path, pixel_bytes)) return refused(Errc::bad_format, path, "is cut short; copy it again");
  Slice slice;
  slice.path = path;
  slice.series = text_of(*io, "0020|000e");
  slice.size = {io->GetDimensions(0), io->GetDimensions(1)};
  for (unsigned axis = 0; axis < 3; ++axis) {
    slice.position_mm[axis] = io->GetOrigin(axis);
    slice.row[axis] = io->GetDirection(0)[axis];
    slice.column[axis] = io->GetDirection(1)[axis];
  }
  slice.spacing_mm = {io->GetSpacing(0), io->GetSpacing(1)};
  slice.thickness_mm = io->GetSpacing(2);
  return slice;
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

Error tilted(const fs::path& folder, double sideways_mm, double forward_mm) {
  return refused(
      Errc::unsupported, folder,
      fmt::format("the gantry was tilted by {:.1f} degrees, so the slices do not stack straight; resample it "
                  "with a DICOM converter first",
                  std::atan2(sideways_mm, forward_mm) * 180 / std::numbers::pi));
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
  const Eigen::Vector3d whole = slices.back().position_mm - slices.front().position_mm;
  const double drift_mm = (whole - whole.dot(normal) * normal).norm();
  std::vector<double> steps;
  for (std::size_t i = 1; i < slices.size(); ++i) steps.push_back(along(i) - along(i - 1));
  const double step = (along(slices.size() - 1) - along(0)) / static_cast<double>(slices.size() - 1);
  for (std::size_t i = 1; i < slices.size(); ++i) {
    const Eigen::Vector3d move = slices[i].position_mm - slices[i - 1].position_mm;
    const double forward = move.dot(normal);
    const double sideways = (move - forward * normal).norm();
    if (sideways > 0.02 * forward + 0.01) return tilted(folder, sideways, forward);
  }
  // Against the median, which a hole does not move.
  std::vector<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double usual = sorted[sorted.size() / 2];
  const auto worst = std::max_element(steps.begin(), steps.end(),
                                      [&](double a, double b) { return std::abs(a - usual) < std::abs(b - usual); });
  if (std::abs(*worst - usual) > 0.02 * usual + 0.01) {
    const auto at = static_cast<std::size_t>(worst - steps.begin());
    return refused(
        Errc::unsupported, folder,
        fmt::format("the step from {} to {} is {:.2f} mm where {:.2f} is usual: slices are missing or "
                    "unevenly spaced; export the whole series",
                    slices[at].path.filename().string(), slices[at + 1].path.filename().string(), *worst, usual));
  }
  // Each step may look straight, and the far end still lie beside where a straight stack puts it.
  if (drift_mm > 0.5 * slices.front().spacing_mm.minCoeff()) return tilted(folder, drift_mm, whole.dot(normal));
  return step;
}

Result<ImageFile> stack(const fs::path& named, std::vector<Slice> slices, const Announce& announce) {
  if (auto same = check_same_stack(named, slices); !same) return same.error();
  const auto step = sort_and_check_steps(named, slices);
  if (!step) return step.error();
  const Slice& first = slices.front();
  ImageFile image;
  image.size = {static_cast<int>(first.size[0]), static_cast<int>(first.size[1]), static_cast<int>(slices.size())};
  image.spacing_mm = {first.spacing_mm.x(), first.spacing_mm.y(), *step};
  image.origin_mm = first.position_mm;
  image.axes << first.row, first.column, first.row.cross(first.column).normalized();
  image.hu.reserve(first.size[0] * first.size[1] * slices.size());
  for (const Slice& slice : slices) {
    announce(slice.path);
    try {
      const auto io = itk::GDCMImageIO::New();
      io->SetFileName(slice.path.string());
      io->ReadImageInformation();
      std::vector<char> pixels(static_cast<std::size_t>(io->GetImageSizeInBytes()));
      io->Read(pixels.data());
      Result<void> read;
      with_type(io->GetComponentType(), [&](auto type) { read = append_hu<decltype(type)>(named, pixels, image.hu); });
      if (!read) return read.error();
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception&) {
      return refused(Errc::unreadable, slice.path, "its pixels cannot be decoded; export it again, uncompressed");
    }
  }
  if (image.hu.size() != first.size[0] * first.size[1] * slices.size())
    return refused(Errc::bad_format, named, "changed while it was read; read it again");
  return image;
}

/// Files that lie beside the slices of many series and are none.
bool is_bystander(const fs::path& path) {
  const std::string name = path.filename().string();
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array kExtensions{".txt", ".md",   ".json", ".xml", ".csv", ".pdf", ".png", ".jpg", ".jpeg",
                                   ".gif", ".html", ".htm",  ".zip", ".exe", ".inf", ".ini", ".db",  ".log"};
  return name.starts_with('.') || name == "DICOMDIR" || name == "LICENSE" || name == "README" ||
         std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

}  // namespace

bool is_dicom(const fs::path& path) {
  return itk::GDCMImageIO::New()->CanReadFile(path.c_str());
}

Result<ImageFile> decode_dicom_folder(const fs::path& folder, const Announce& announce) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.is_regular_file() && !is_bystander(entry.path())) files.push_back(entry.path());
  }
  if (error) return refused(Errc::unreadable, folder, "cannot be listed; check its permissions");
  if (files.empty()) {
    return refused(Errc::not_found, folder, "is empty or holds no DICOM file; give the folder that holds the series");
  }
  std::sort(files.begin(), files.end());
  std::vector<Slice> slices;
  for (const fs::path& file : files) {
    announce(file);
    // A slice that is left out unseen may hold the tumour, so that no file is passed over.
    if (!is_dicom(file)) {
      return refused(Errc::bad_format, file,
                     "is empty, damaged or no DICOM; copy the series again, or remove the file");
    }
    auto slice = read_slice_header(file, announce);
    if (!slice) return slice.error();
    slices.push_back(*std::move(slice));
  }
  return stack(folder, std::move(slices), announce);
}

Result<ImageFile> decode_dicom_file(const fs::path& path, const Announce& announce) {
  auto slice = read_slice_header(path, announce);
  if (!slice) return slice.error();
  return stack(path, {*std::move(slice)}, announce);
}

}  // namespace birdseye::host
