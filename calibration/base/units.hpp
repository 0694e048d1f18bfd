#pragma once

#include <numbers>

namespace birdseye {

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;
inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;
inline constexpr double kMmPerInch = 25.4;
inline constexpr double kNsPerSecond = 1e9;
inline constexpr double kNsPerMs = 1e6;

}  // namespace birdseye
