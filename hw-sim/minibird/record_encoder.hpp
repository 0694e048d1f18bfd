#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace birdseye::hw_sim {

/// The pose of one bird: tracker_from_sensor, mm.
struct BirdPose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
};

/// The output formats, by their number in the status word.
enum class OutputFormat : std::uint8_t {
  position = 1,
  angles = 2,
  matrix = 3,
  position_angles = 4,
  position_matrix = 5,
  quaternion = 7,
  position_quaternion = 8,
};

/// The words of one miniBIRD record in the order in which they are sent. Written from the unit's manual, independently
/// of the driver's decoder, so that a misreading in one shows against the other. full_scale_mm: what the word 0x8000
/// stands for.
std::vector<std::int16_t> record_words(OutputFormat format, const BirdPose& pose, double full_scale_mm);

/// Words -> wire: each as two 7-bit bytes, low part first, its two low bits lost; bit 7 marks the first byte.
std::vector<std::uint8_t> phased_bytes(const std::vector<std::int16_t>& words);

}  // namespace birdseye::hw_sim
