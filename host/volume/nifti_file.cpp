#include "host/volume/nifti_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "host/volume/volume.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

using Map = Eigen::Matrix<double, 3, 4>;

bool read(const fs::path& path, std::size_t offset, char* to, std::size_t bytes) {
  const gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) return false;
  const bool whole = gzseek(file, static_cast<z_off_t>(offset), SEEK_SET) >= 0 &&
                     gzread(file, to, static_cast<unsigned>(bytes)) == static_cast<int>(bytes);
  gzclose_r(file);
  return whole;
}

fs::path image_of(fs::path header) {
  const bool zipped = header.extension() == ".gz";
  if (zipped) header.replace_extension();
  header.replace_extension(zipped ? ".img.gz" : ".img");
  return header;
}

std::string letters_of(const VoxelPlace& place) {
  Eigen::Affine3d axes = Eigen::Affine3d::Identity();
  axes.linear() = place.axes;
  return orientation_letters(axes);
}

}  // namespace

std::optional<NiftiFile> NiftiFile::open(const fs::path& path) {
  NiftiFile file;
  if (!read(path, 0, file.header_.data(), file.header_.size())) return std::nullopt;
  const auto size = file.number<std::int32_t>(0);
  file.swapped_ = size != kHeaderBytes;
  if (file.number<std::int32_t>(0) != kHeaderBytes) return std::nullopt;
  const bool single = std::memcmp(file.header_.data() + 344, "n+1", 3) == 0;
  file.voxels_ = single ? path : image_of(path);
  const float offset = file.number<float>(108);
  file.offset_ = single ? 352 : 0;
  if (offset > static_cast<float>(file.offset_) && offset < 1e9F) file.offset_ = static_cast<std::size_t>(offset);
  file.offset_is_sound_ = offset >= 0 && offset < 1e9F;
  return file;
}

bool NiftiFile::header_is_sound() const {
  // pixdim, vox_offset, scl_slope, scl_inter, quaternion and offsets, the three rows of the affine map.
  constexpr float kFurthest = 1e6F;
  for (const auto& [begin, end, most] :
       {std::tuple{76UL, 108UL, kFurthest}, {108UL, 120UL, INFINITY}, {256UL, 328UL, kFurthest}}) {
    if (begin == 256 && !is_nifti()) continue;
    for (std::size_t at = begin; at < end; at += 4) {
      if (!std::isfinite(number<float>(at)) || std::abs(number<float>(at)) > most) return false;
    }
  }
  return true;
}

bool NiftiFile::is_nifti() const {
  return std::memcmp(header_.data() + 344, "n+1", 3) == 0 || std::memcmp(header_.data() + 344, "ni1", 3) == 0;
}

bool NiftiFile::says_a_place() const {
  return is_nifti() && (number<std::int16_t>(252) > 0 || number<std::int16_t>(254) > 0);
}

GeometryGaps NiftiFile::gaps() const {
  GeometryGaps gaps;
  const Eigen::Vector3d apart = spacing();
  if (!(apart.minCoeff() > 0)) gaps.spacing = "does not say how far apart its voxels are (a pixdim is not above 0)";
  if (!says_a_place()) {
    gaps.orientation = fmt::format("does not say which way its axes point ({})",
                                   is_nifti() ? "neither its qform nor its sform is set" : "it is an Analyze file");
    return gaps;
  }
  if (number<std::int16_t>(254) <= 0) return gaps;
  const Map matrix = matrix_map();
  const Eigen::Vector3d lengths = matrix.leftCols<3>().colwise().norm();
  const Eigen::Matrix3d axes = matrix.leftCols<3>() * lengths.cwiseInverse().asDiagonal();
  if (!(lengths.minCoeff() > 0) || !(axes.transpose() * axes).isIdentity(1e-2)) {
    gaps.beyond = "its axes are sheared or have no length; resample it first";
    return gaps;
  }
  const double allowed = 0.5 * lengths.minCoeff();
  Map by_spacing = matrix;
  by_spacing.leftCols<3>() = axes * apart.asDiagonal();
  if (gaps.spacing.empty() && corners_apart(matrix, by_spacing) > allowed) {
    gaps.spacing = fmt::format(
        "says two spacings of its voxels: {:.4g} x {:.4g} x {:.4g} by its pixdim, {:.4g} x {:.4g} x {:.4g} by its "
        "sform",
        apart.x(), apart.y(), apart.z(), lengths.x(), lengths.y(), lengths.z());
  }
  if (number<std::int16_t>(252) <= 0) return gaps;
  Map turned = quaternion_map();
  // Of the two spacings another line tells.
  if (!gaps.spacing.empty()) turned.leftCols<3>() = turned.leftCols<3>().colwise().normalized() * lengths.asDiagonal();
  const double places_apart = corners_apart(turned, matrix);
  if (places_apart <= allowed) return gaps;
  const std::string first = letters_of(in_patient(turned)), second = letters_of(in_patient(matrix));
  const std::string told = fmt::format(
      "says two places for its voxels, {:.1f} mm apart: its qform and its sform differ", unit_mm() * places_apart);
  if (first == second) {
    gaps.beyond = fmt::format("{}; keep the one that is right (as by fslorient -copysform2qform)", told);
  } else {
    gaps.orientation = fmt::format("{} ({} and {})", told, first, second);
  }
  return gaps;
}

std::optional<VoxelPlace> NiftiFile::place_by(const std::string& letters) const {
  const VoxelPlace first = in_patient(quaternion_map()), second = in_patient(matrix_map());
  const bool by_first = letters_of(first) == letters, by_second = letters_of(second) == letters;
  if (by_first == by_second) return std::nullopt;
  return by_first ? first : second;
}

std::size_t NiftiFile::bytes_of(std::size_t count) const {
  return count * static_cast<std::size_t>(std::max<std::int16_t>(8, number<std::int16_t>(72))) / 8;
}

std::string NiftiFile::fault(std::size_t image_bytes) const {
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

VoxelPlace NiftiFile::in_patient(const Map& map) const {
  const Eigen::Vector3d lps(-1, -1, 1);
  return {lps.asDiagonal() * map.leftCols<3>().colwise().normalized(), unit_mm() * lps.cwiseProduct(map.col(3))};
}

double NiftiFile::unit_mm() const {
  const int unit = header_[123] & 7;
  return unit == 1 ? 1000 : unit == 3 ? 0.001 : 1;
}

Map NiftiFile::matrix_map() const {
  Map map;
  for (int k = 0; k < 12; ++k) map(k / 4, k % 4) = number<float>(280 + 4 * static_cast<std::size_t>(k));
  return map;
}

Map NiftiFile::quaternion_map() const {
  const double b = number<float>(256), c = number<float>(260), d = number<float>(264);
  const double a = std::sqrt(std::max(0.0, 1 - b * b - c * c - d * d));
  const double handedness = number<float>(76) < 0 ? -1 : 1;
  const Eigen::Vector3d apart = spacing();
  Map map;
  map.leftCols<3>() = Eigen::Quaterniond(a, b, c, d).normalized().toRotationMatrix() *
                      Eigen::Vector3d(apart.x(), apart.y(), handedness * apart.z()).asDiagonal();
  map.col(3) = Eigen::Vector3d(number<float>(268), number<float>(272), number<float>(276));
  return map;
}

Eigen::Vector3d NiftiFile::spacing() const {
  return {number<float>(80), number<float>(84), number<float>(88)};
}

std::array<int, 3> NiftiFile::size() const {
  return {number<std::int16_t>(42), number<std::int16_t>(44), number<std::int16_t>(46)};
}

double NiftiFile::corners_apart(const Map& a, const Map& b) const {
  double apart = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector4d voxel((corner & 1) * (size()[0] - 1), (corner >> 1 & 1) * (size()[1] - 1),
                                (corner >> 2) * (size()[2] - 1), 1);
    apart = std::max(apart, ((a - b) * voxel).norm());
  }
  return apart;
}

}  // namespace birdseye::host
