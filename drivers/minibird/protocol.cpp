#include "drivers/minibird/protocol.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::drivers::minibird {

namespace {

constexpr double kPerFullScale = 1.0 / 32768.0;

struct FormatRow {
  RecordFormat format;
  std::string_view name;
  std::size_t words;
};
constexpr FormatRow kFormats[] = {
    {RecordFormat::position, "position", 3},
    {RecordFormat::angles, "angles", 3},
    {RecordFormat::matrix, "matrix", 9},
    {RecordFormat::position_angles, "position_angles", 6},
    {RecordFormat::position_matrix, "position_matrix", 12},
    {RecordFormat::quaternion, "quaternion", 4},
    {RecordFormat::position_quaternion, "position_quaternion", 7},
};

struct HemisphereRow {
  std::string_view name;
  Hemisphere hemisphere;
  std::uint8_t axis, sign;
};
constexpr HemisphereRow kHemispheres[] = {
    {"forward", Hemisphere::forward, 0x00, 0}, {"aft", Hemisphere::aft, 0x00, 1},
    {"right", Hemisphere::right, 0x06, 0},     {"left", Hemisphere::left, 0x06, 1},
    {"lower", Hemisphere::lower, 0x0C, 0},     {"upper", Hemisphere::upper, 0x0C, 1},
};

void put_word(Bytes& bytes, std::int32_t word) {
  const auto w = static_cast<std::uint16_t>(word);
  bytes.push_back(static_cast<std::uint8_t>(w & 0xFFU));
  bytes.push_back(static_cast<std::uint8_t>(w >> 8U));
}

/// Angles in a command: 180 degrees are 32768 counts.
Bytes angle_words(std::uint8_t command, double azimuth, double elevation, double roll) {
  Bytes bytes{command};
  for (const double angle : {azimuth, elevation, roll}) {
    put_word(bytes, std::clamp(static_cast<std::int32_t>(std::trunc(angle / kDegPerCount)), -32768, 32767));
  }
  return bytes;
}

Result<Eigen::Matrix3d> rotation_from_matrix_words(std::span<const std::int16_t> words) {
  // The unit sends M (transmitter to sensor) column by column, so the words in order fill R = M^T row by row.
  Eigen::Matrix3d r;
  for (int i = 0; i < 9; ++i) r(i / 3, i % 3) = words[static_cast<std::size_t>(i)] * kPerFullScale;
  const double off = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (off > 0.01 || r.determinant() < 0) {
    return Error{Errc::bad_value, "miniBIRD: a matrix that is no rotation; the sensor may be saturated or too close"};
  }
  return nearest_rotation(r);
}

Result<Eigen::Matrix3d> rotation_from_quaternion_words(std::span<const std::int16_t> words) {
  // The wire carries the quaternion of M; the pose's is its conjugate.
  const Eigen::Quaterniond q(words[0] * kPerFullScale, -words[1] * kPerFullScale, -words[2] * kPerFullScale,
                             -words[3] * kPerFullScale);
  if (std::abs(q.norm() - 1) > 0.01) {
    return Error{Errc::bad_value,
                 "miniBIRD: a quaternion whose norm is not 1; the sensor may be saturated or too close"};
  }
  return Eigen::Matrix3d(q.normalized().toRotationMatrix());
}

Result<Eigen::Matrix3d> rotation_from_angle_words(std::span<const std::int16_t> words) {
  const double elevation = words[1] * kDegPerCount;
  if (std::abs(elevation) > 90.1) return Error{Errc::bad_value, "miniBIRD: an elevation beyond 90 degrees"};
  return rotation_from_angles(words[0] * kDegPerCount * kRadPerDeg, elevation * kRadPerDeg,
                              words[2] * kDegPerCount * kRadPerDeg);
}

}  // namespace

std::optional<RecordFormat> record_format_of(std::string_view name) {
  for (const FormatRow& row : kFormats) {
    if (row.name == name) return row.format;
  }
  return std::nullopt;
}

std::size_t word_count(RecordFormat format) {
  for (const FormatRow& row : kFormats) {
    if (row.format == format) return row.words;
  }
  return 0;
}

bool has_position(RecordFormat format) {
  return format == RecordFormat::position || format == RecordFormat::position_angles ||
         format == RecordFormat::position_matrix || format == RecordFormat::position_quaternion;
}

bool has_orientation(RecordFormat format) {
  return format != RecordFormat::position;
}

std::int16_t decode_word(std::uint8_t low, std::uint8_t high) {
  const unsigned word = (static_cast<unsigned>(low & 0x7FU) << 2U) | (static_cast<unsigned>(high & 0x7FU) << 9U);
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(word));
}

Eigen::Matrix3d rotation_from_angles(double azimuth_rad, double elevation_rad, double roll_rad) {
  return (Eigen::AngleAxisd(azimuth_rad, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(elevation_rad, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Result<RecordPose> decode_pose(RecordFormat format, std::span<const std::int16_t> words, double mm_per_count) {
  if (words.size() != word_count(format)) return Error{Errc::bad_format, "miniBIRD: a record of the wrong length"};
  RecordPose pose;
  if (has_position(format)) {
    pose.position_mm = Eigen::Vector3d(words[0], words[1], words[2]) * mm_per_count;
    words = words.subspan(3);
  }
  if (!has_orientation(format)) return pose;
  Result<Eigen::Matrix3d> rotation = words.size() == 9   ? rotation_from_matrix_words(words)
                                     : words.size() == 4 ? rotation_from_quaternion_words(words)
                                                         : rotation_from_angle_words(words);
  if (!rotation) return rotation.error();
  pose.rotation = *rotation;
  return pose;
}

std::optional<Hemisphere> hemisphere_of(std::string_view name) {
  for (const HemisphereRow& row : kHemispheres) {
    if (row.name == name) return row.hemisphere;
  }
  return std::nullopt;
}

Eigen::Vector3d into(Hemisphere hemisphere) {
  for (const HemisphereRow& row : kHemispheres) {
    if (row.hemisphere == hemisphere) return Eigen::Vector3d::Unit(row.axis / 6) * (row.sign == 0 ? 1 : -1);
  }
  return Eigen::Vector3d::UnitX();
}

Bytes select_format(RecordFormat format) {
  return {static_cast<std::uint8_t>(0x55 + static_cast<unsigned>(format))};
}

Bytes select_hemisphere(Hemisphere hemisphere) {
  for (const HemisphereRow& row : kHemispheres) {
    if (row.hemisphere == hemisphere) return {'L', row.axis, row.sign};
  }
  return {};
}

Bytes examine(std::uint8_t parameter) {
  return {'O', parameter};
}

Bytes change(std::uint8_t parameter, std::span<const std::uint8_t> value) {
  Bytes bytes{'P', parameter};
  bytes.reserve(value.size() + 2);
  for (const std::uint8_t byte : value) bytes.push_back(byte);
  return bytes;
}

Bytes change_word(std::uint8_t parameter, std::uint16_t value) {
  Bytes bytes{'P', parameter};
  put_word(bytes, value);
  return bytes;
}

Bytes set_rate_hz(double rate_hz) {
  return change_word(kRate, static_cast<std::uint16_t>(rate_hz * 256.0));
}

Bytes set_rate_count(double rate_hz, double crystal_mhz) {
  const double count = crystal_mhz / 8.0 * 1000.0 * ((1000.0 / rate_hz - 0.3) / 4.0);
  return change_word(kRateCount, static_cast<std::uint16_t>(std::clamp(count, 0.0, 65535.0)));
}

double rate_of_count(std::uint16_t count, double crystal_mhz) {
  return 1000.0 / (4.0 * count * (8.0 / crystal_mhz) / 1000.0 + 0.3);
}

Bytes report_rate_command(int every) {
  switch (every) {
    case 1:
      return {'Q'};
    case 2:
      return {'R'};
    case 8:
      return {'S'};
    case 32:
      return {'T'};
    default:
      return {};
  }
}

Bytes set_group_mode(bool on) {
  return {'P', kGroupMode, static_cast<std::uint8_t>(on ? 1 : 0)};
}

Bytes auto_configure(std::uint8_t units) {
  return {'P', kAutoConfigure, units};
}

Bytes angle_align_deg(double azimuth, double elevation, double roll) {
  return angle_words('q', azimuth, elevation, roll);
}
Bytes reference_frame_deg(double azimuth, double elevation, double roll) {
  return angle_words('r', azimuth, elevation, roll);
}

Bytes to_unit(std::uint8_t address, const Bytes& command) {
  Bytes bytes;
  bytes.reserve(command.size() + 2);
  if (address <= 14) {
    bytes.push_back(static_cast<std::uint8_t>(0xF0U | address));
  } else {
    bytes.push_back(0xA0);
    bytes.push_back(address);
  }
  for (const std::uint8_t byte : command) bytes.push_back(byte);
  return bytes;
}

std::optional<std::size_t> examine_bytes(std::uint8_t parameter) {
  switch (parameter) {
    case 0:
    case 1:
    case 2:
    case 3:
    case 4:
    case 6:
    case 7:
    case 16:
    case 22:
    case 25:
    case 26:
    case 27:
    case 32:
      return 2;
    case 8:
    case 9:
    case 10:
    case 11:
    case 14:
    case 17:
    case 18:
    case 19:
    case 20:
    case 21:
    case 35:
      return 1;
    case 5:
    case 12:
    case 13:
    case 34:
    case 36:
      return 14;
    case 15:
      return 10;
    case 23:
    case 24:
      return 6;
    case 33:
    case 50:
      return 5;
    default:
      return std::nullopt;
  }
}

}  // namespace birdseye::drivers::minibird
