#include "host/volume/nifti_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "host/volume/volume.hpp"
#include "host/volume/voxel_bytes.hpp"

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

constexpr std::int16_t kLastCode = 5;

constexpr int kLastUnit = 3;

/// Talairach's, the MNI152's, or another template's.
bool is_atlas(std::int16_t code) {
  return code >= 3 && code <= kLastCode;
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
  const bool single = file.holds_voxels();
  file.voxels_ = single ? path : image_of(path);
  const float offset = file.number<float>(108);
  file.offset_ = single ? kLeastOffset : 0;
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

std::string NiftiFile::type_fault() const {
  struct Type {
    std::int16_t code, bits;
    const char* unread;  ///< what its numbers are, where they are not read
  };
  static constexpr std::array<Type, 16> kTypes{{{2, 8, nullptr},
                                                {4, 16, nullptr},
                                                {8, 32, nullptr},
                                                {16, 32, nullptr},
                                                {64, 64, nullptr},
                                                {256, 8, nullptr},
                                                {512, 16, nullptr},
                                                {768, 32, nullptr},
                                                {1024, 64, nullptr},
                                                {1280, 64, nullptr},
                                                {1, 1, "single bits"},
                                                {32, 64, "complex numbers"},
                                                {1792, 128, "complex numbers"},
                                                {1536, 128, "floats of 128 bits"},
                                                {128, 24, "colours"},
                                                {2304, 32, "colours"}}};
  const auto code = number<std::int16_t>(70), bits = number<std::int16_t>(72);
  const auto* const type =
      std::find_if(kTypes.begin(), kTypes.end(), [code](const Type& known) { return known.code == code; });
  if (type == kTypes.end())
    return fmt::format("has voxels of the datatype {}, which is not read; save it as 16-bit integers", code);
  if (type->unread != nullptr)
    return fmt::format("has voxels of {} (datatype {}); give the CT, as 16-bit integers", type->unread, code);
  if (bits != type->bits) {
    return fmt::format("says two sizes of its voxels: {} bits by its datatype ({}), {} by its bitpix; export it again",
                       type->bits, code, bits);
  }
  return {};
}

std::string NiftiFile::reading_fault() const {
  if (!is_nifti()) return {};
  const float offset = number<float>(108), slope = number<float>(112), intercept = number<float>(116);
  if (holds_voxels() && offset < static_cast<float>(kLeastOffset)) {
    return fmt::format(
        "says that its voxels begin at byte {:g} (vox_offset), within its header, which takes {}; export it again by a "
        "program that writes where they begin",
        offset, kLeastOffset);
  }
  if (slope < 0) {
    return fmt::format(
        "has a scl_slope of {:g}, below 0, which turns bright to dark; export it again, with its values in Hounsfield "
        "units",
        slope);
  }
  if (slope == 0 && intercept != 0) {
    return fmt::format(
        "has a scl_slope of 0, by which NIfTI takes the values as they are stored, and a scl_inter of {:g}, by which "
        "some programs shift them; set scl_slope to 1 where they are to be shifted, or scl_inter to 0",
        intercept);
  }
  if (unit_code() > kLastUnit) {
    return fmt::format(
        "has its lengths in the unit {} (xyzt_units), which NIfTI does not know (1: m, 2: mm, 3: um); export it in mm",
        unit_code());
  }
  return {};
}

bool NiftiFile::is_nifti() const {
  return holds_voxels() || std::memcmp(header_.data() + 344, "ni1", 3) == 0;
}

bool NiftiFile::says_a_place() const {
  return is_nifti() && (quaternion_code() > 0 || matrix_code() > 0);
}

std::string NiftiFile::code_fault() const {
  const std::int16_t by_quaternion = quaternion_code(), by_matrix = matrix_code();
  for (const auto& [form, code, other] :
       {std::tuple{"qform", by_quaternion, by_matrix}, {"sform", by_matrix, by_quaternion}}) {
    if (code < 0 || code > kLastCode) {
      return fmt::format(
          "has the {0} code {1}, which NIfTI does not know (0 to {2}); export it again, or set the code: to 1 where "
          "its {0} is the scanner's, to 0 where it is not to count (as by fslorient -set{0}code 1)",
          form, code, kLastCode);
    }
    if (!is_atlas(code)) continue;
    const char* atlas = code == 3 ? "Talairach's atlas" : code == 4 ? "the MNI152 atlas" : "an atlas";
    // Of these the voxels may still lie as they were scanned.
    if (other > 0 && !is_atlas(other)) {
      return fmt::format(
          "says two places: its {0} is in the space of {1}, and only its {2} is of the scanner; give the CT as it was "
          "scanned, or, where its voxels never were resampled to the atlas, take the {0} away (as by fslorient "
          "-set{0}code 0)",
          form, atlas, form[0] == 'q' ? "sform" : "qform");
    }
    return fmt::format(
        "lies in the space of {1} ({0} code {2}), to which a body is turned and scaled: it is not this patient's; give "
        "the CT as it was scanned, or, where the code is wrong, set it to 1 (as by fslorient -set{0}code 1)",
        form, atlas, code);
  }
  return {};
}

std::string NiftiFile::quaternion_fault() const {
  if (quaternion_code() <= 0) return {};
  // b, c and d of a unit quaternion; its a is what they leave of 1. Readers cut longer ones to a half turn.
  const Eigen::Vector3d parts(number<float>(256), number<float>(260), number<float>(264));
  constexpr double kRounding = 1e-3;
  if (parts.squaredNorm() <= 1 + kRounding) return {};
  return fmt::format(
      "has a qform that is no rotation: its quaternion ({:.4g}, {:.4g}, {:.4g}) is longer than 1; export it again, or, "
      "where its sform is right, keep that alone (as by fslorient -copysform2qform)",
      parts.x(), parts.y(), parts.z());
}

GeometryGaps NiftiFile::gaps() const {
  GeometryGaps gaps;
  if (is_nifti()) gaps.beyond = code_fault();
  if (gaps.beyond.empty() && is_nifti()) gaps.beyond = quaternion_fault();
  if (!gaps.beyond.empty()) return gaps;
  const Eigen::Vector3d apart = spacing();
  if (!(apart.minCoeff() > 0)) gaps.spacing = "does not say how far apart its voxels are (a pixdim is not above 0)";
  if (!says_a_place()) {
    gaps.orientation = fmt::format("does not say which way its axes point ({})",
                                   is_nifti() ? "neither its qform nor its sform is set" : "it is an Analyze file");
    return gaps;
  }
  if (matrix_code() <= 0) return gaps;
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
  if (gaps.spacing.empty() && corners_apart(matrix, by_spacing) > allowed) gaps.spacing = two_spacings();
  if (quaternion_code() <= 0) {
    // Of a matrix alone the reader takes no other spacing than its own.
    if (const std::string two = unread_place(); !gaps.spacing.empty() && !two.empty()) gaps.beyond = two;
    return gaps;
  }
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

std::string NiftiFile::two_spacings() const {
  const Eigen::Vector3d apart = spacing(), lengths = matrix_map().leftCols<3>().colwise().norm();
  return fmt::format(
      "says two spacings of its voxels: {:.5g} x {:.5g} x {:.5g} by its pixdim, {:.5g} x {:.5g} x {:.5g} by its sform",
      apart.x(), apart.y(), apart.z(), lengths.x(), lengths.y(), lengths.z());
}

std::string NiftiFile::unread_place() const {
  constexpr double kRounding_mm = 1e-6;
  const Eigen::Vector3d apart = spacing(), lengths = matrix_map().leftCols<3>().colwise().norm();
  if (!is_nifti() || matrix_code() <= 0 || quaternion_code() > 0 || !(apart.minCoeff() > 0) ||
      (apart - lengths).cwiseAbs().maxCoeff() < kRounding_mm) {
    return {};
  }
  return two_spacings() + "; open and save it again by a program that writes them alike, as 3D Slicer";
}

std::optional<VoxelPlace> NiftiFile::place_by(const std::string& letters) const {
  // A matrix that no code says to be set may hold anything, such as the place of what the file was made from.
  if (!is_nifti() || quaternion_code() <= 0 || matrix_code() <= 0) return std::nullopt;
  const VoxelPlace first = in_patient(quaternion_map()), second = in_patient(matrix_map());
  const bool by_first = letters_of(first) == letters, by_second = letters_of(second) == letters;
  if (by_first == by_second) return std::nullopt;
  return by_first ? first : second;
}

std::size_t NiftiFile::bytes_of(std::size_t count) const {
  return count * static_cast<std::size_t>(std::max<std::int16_t>(8, number<std::int16_t>(72))) / 8;
}

std::string NiftiFile::fault(std::size_t image_bytes, std::size_t row_bytes) const {
  if (!offset_is_sound_) return "is damaged in its header; export it again";
  const gzFile file = gzopen(voxels_.c_str(), "rb");
  if (file == nullptr)
    return fmt::format("lacks the file of its voxels, {}; copy both into one folder", voxels_.filename().string());
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
  if (count >= image_bytes + row_bytes) return too_many(count, image_bytes);
  if (!finite) return "has voxels that are not finite numbers; export it again";
  return {};
}

VoxelPlace NiftiFile::in_patient(const Map& map) const {
  const Eigen::Vector3d lps(-1, -1, 1);
  return {lps.asDiagonal() * map.leftCols<3>().colwise().normalized(), unit_mm() * lps.cwiseProduct(map.col(3))};
}

double NiftiFile::unit_mm() const {
  const int unit = unit_code();
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
