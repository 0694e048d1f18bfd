#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

/// The bytes of the Ascension miniBIRD's serial protocol (the Flock of Birds command set): no I/O, no state.
namespace birdseye::drivers::minibird {

/// Output formats, by their code in the status word; 0x55 + code is the command that selects one. 6 is the factory's.
enum class RecordFormat : std::uint8_t {
  position = 1,
  angles = 2,
  matrix = 3,
  position_angles = 4,
  position_matrix = 5,
  quaternion = 7,
  position_quaternion = 8,
};

std::optional<RecordFormat> record_format_of(std::string_view name);  ///< "position_matrix" and so on
std::size_t word_count(RecordFormat format);
bool has_position(RecordFormat format);
bool has_orientation(RecordFormat format);

/// Two 7-bit bytes, low part first -> the signed word. Its two low bits were not sent and are 0; the phase bit is
/// ignored.
std::int16_t decode_word(std::uint8_t low, std::uint8_t high);

/// Millimetres per count of a position word.
inline constexpr double kMmPerCount36Inch = 914.4 / 32768.0;
inline constexpr double kMmPerCount72Inch = 1828.8 / 32768.0;
inline constexpr double kDegPerCount = 180.0 / 32768.0;

/// What a miniBIRD record says: tracker_from_sensor, as far as the record's format carries it.
struct RecordPose {
  std::optional<Eigen::Vector3d> position_mm;
  std::optional<Eigen::Matrix3d> rotation;
};

/// Words in wire order -> pose. Matrices are made orthonormal (their words are rounded). Refuses what no pose can give:
/// a matrix that is far from orthonormal or all zero (a saturated sensor), a quaternion whose norm is not 1 within
/// 0.01, an elevation outside 90 degrees, a wrong number of words.
Result<RecordPose> decode_pose(RecordFormat format, std::span<const std::int16_t> words, double mm_per_count);

/// R = Rz(azimuth) Ry(elevation) Rx(roll), rad: sensor vectors -> transmitter vectors.
Eigen::Matrix3d rotation_from_angles(double azimuth_rad, double elevation_rad, double roll_rad);

enum class Hemisphere { forward, aft, right, left, lower, upper };
std::optional<Hemisphere> hemisphere_of(std::string_view name);
Eigen::Vector3d into(
    Hemisphere hemisphere);  ///< unit vector from the transmitter into it, along the transmitter's axes

/// Commands that carry data; those that are one byte are below.
using Bytes = std::vector<std::uint8_t>;
Bytes select_format(RecordFormat format);
Bytes select_hemisphere(Hemisphere hemisphere);
Bytes examine(std::uint8_t parameter);
Bytes change(std::uint8_t parameter, std::span<const std::uint8_t> value);
Bytes change_word(std::uint8_t parameter, std::uint16_t value);  ///< little endian
Bytes set_rate_hz(double rate_hz);                               ///< parameter 7: rate * 256
Bytes set_rate_count(double rate_hz, double crystal_mhz);        ///< parameter 6, for older firmware
double rate_of_count(std::uint16_t count, double crystal_mhz);
Bytes report_rate_command(int every);  ///< Q, R, S or T for 1, 2, 8 or 32; empty for anything else
Bytes set_group_mode(bool on);
Bytes auto_configure(std::uint8_t units);
/// q and r: rotations given as azimuth, elevation, roll in degrees, within 180.
Bytes angle_align_deg(double azimuth, double elevation, double roll);
Bytes reference_frame_deg(double azimuth, double elevation, double roll);
/// Puts the prefix that sends command to one unit of a flock: F0 + address up to 14, A0 address up to 126.
Bytes to_unit(std::uint8_t address, const Bytes& command);

inline constexpr std::uint8_t kPoint = 'B', kStream = '@', kRun = 'F', kBusReset = '/', kXon = 0x11;

/// Parameters of EXAMINE and CHANGE that the driver uses.
enum Parameter : std::uint8_t {
  kStatus = 0x00,
  kRevision = 0x01,
  kCrystal = 0x02,
  kScale = 0x03,
  kFilters = 0x04,
  kAlphaMin = 0x05,
  kRateCount = 0x06,
  kRate = 0x07,
  kDataReady = 0x08,
  kErrorCode = 0x0A,
  kVmTable = 0x0C,
  kAlphaMax = 0x0D,
  kSuddenChangeLock = 0x0E,
  kModel = 0x0F,
  kExpandedError = 0x10,
  kFrameTurnsPosition = 0x11,
  kLineFrequency = 0x14,
  kHemisphere = 0x16,
  kAngleAlign = 0x17,
  kReferenceFrame = 0x18,
  kUnitSerial = 0x19,
  kSensorSerial = 0x1A,
  kTransmitterSerial = 0x1B,
  kGroupMode = 0x23,
  kSystemStatus = 0x24,
  kAutoConfigure = 0x32,
};
/// Bytes of the reply to EXAMINE in normal addressing; empty for a parameter that has none.
std::optional<std::size_t> examine_bytes(std::uint8_t parameter);

}  // namespace birdseye::drivers::minibird
