#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>

#include "host/volume/stated_geometry.hpp"

namespace birdseye::host {

/// The parts of a NIfTI-1 header that the toolkit believes unseen: it turns voxels that are not finite into zeros, ends
/// a file that is cut short in zeros too, and takes one of two places that differ.
class NiftiFile {
 public:
  /// Empty where the file is no single-file or paired NIfTI-1, nor an Analyze file.
  static std::optional<NiftiFile> open(const std::filesystem::path& path);

  /// Whether its numbers are finite, and those of places no further off than a patient may lie: the reader takes for
  /// ever over 1e38 mm.
  [[nodiscard]] bool header_is_sound() const;

  /// Why its numbers are none that a CT or a field has, with the remedy; empty where they may be.
  [[nodiscard]] std::string type_fault() const;

  /// Why the reader would take other bytes for the voxels, or give them other values or lengths, than NIfTI says, with
  /// the remedy; empty where it would not.
  [[nodiscard]] std::string reading_fault() const;

  /// What the header lacks, or says twice differently, of where the voxels lie.
  [[nodiscard]] GeometryGaps gaps() const;

  /// Why the reader may not read where the voxels lie, though the file may say it, with the remedy: it has an sform
  /// alone, whose lengths are not quite those of pixdim. Empty where they are.
  [[nodiscard]] std::string unread_place() const;

  [[nodiscard]] bool says_a_place() const;

  /// Whether the file holds its voxels itself, and is no header of a pair.
  [[nodiscard]] bool holds_voxels() const { return std::memcmp(header_.data() + 344, "n+1", 3) == 0; }

  /// Of a header that says two orientations, the place of the voxels by the one that a person says is right. Empty
  /// where it does not say two, or not exactly one of the two has these letters.
  [[nodiscard]] std::optional<VoxelPlace> place_by(const std::string& letters) const;

  /// Of so many numbers, by bitpix.
  [[nodiscard]] std::size_t bytes_of(std::size_t count) const;

  /// What is wrong with the voxels, of so many bytes, and rows of so many; empty where they are whole and finite.
  [[nodiscard]] std::string fault(std::size_t image_bytes, std::size_t row_bytes) const;

 private:
  static constexpr std::int32_t kHeaderBytes = 348;
  static constexpr std::size_t kLeastOffset = 352;  ///< of the voxels in a file that holds its header too

  /// Not Analyze, which has texts where NIfTI says a place.
  [[nodiscard]] bool is_nifti() const;
  /// Codes of places, 0 where the header says none: of the scanner, aligned to it, or of an atlas.
  [[nodiscard]] std::int16_t quaternion_code() const { return number<std::int16_t>(252); }
  [[nodiscard]] std::int16_t matrix_code() const { return number<std::int16_t>(254); }
  /// Why these are no codes of a patient's CT, with the remedy; empty where they are.
  [[nodiscard]] std::string code_fault() const;
  /// Why the qform's quaternion is no rotation, with the remedy; empty where it is one, or does not count.
  [[nodiscard]] std::string quaternion_fault() const;
  [[nodiscard]] std::string two_spacings() const;
  [[nodiscard]] int unit_code() const { return header_[123] & 7; }
  [[nodiscard]] double unit_mm() const;
  /// Of a place in the header's own frame and unit.
  [[nodiscard]] VoxelPlace in_patient(const Eigen::Matrix<double, 3, 4>& map) const;
  [[nodiscard]] Eigen::Matrix<double, 3, 4> matrix_map() const;      ///< from voxel indices, RAS
  [[nodiscard]] Eigen::Matrix<double, 3, 4> quaternion_map() const;  ///< from voxel indices, RAS
  [[nodiscard]] Eigen::Vector3d spacing() const;
  [[nodiscard]] std::array<int, 3> size() const;
  /// How far the corner that moves most lies from itself by another map.
  [[nodiscard]] double corners_apart(const Eigen::Matrix<double, 3, 4>& a, const Eigen::Matrix<double, 3, 4>& b) const;

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
  std::filesystem::path voxels_;
};

}  // namespace birdseye::host
