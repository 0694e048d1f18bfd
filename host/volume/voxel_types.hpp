#pragma once

#include <fmt/format.h>
#include <itkImageIOBase.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <vector>

#include "host/dicom/refused.hpp"

namespace birdseye::host {

/// Calls f(T()) with the type T of a file's values; false where they are no numbers.
template <typename F>
bool with_type(itk::IOComponentEnum type, const F& f) {
  using Type = itk::IOComponentEnum;
  switch (type) {
    case Type::UCHAR:
      return f(static_cast<unsigned char>(0)), true;
    case Type::CHAR:
      return f(static_cast<signed char>(0)), true;
    case Type::USHORT:
      return f(static_cast<unsigned short>(0)), true;
    case Type::SHORT:
      return f(static_cast<short>(0)), true;
    case Type::UINT:
      return f(0U), true;
    case Type::INT:
      return f(0), true;
    case Type::ULONG:
      return f(0UL), true;
    case Type::LONG:
      return f(0L), true;
    case Type::FLOAT:
      return f(0.0F), true;
    case Type::DOUBLE:
      return f(0.0), true;
    default:
      return false;
  }
}

/// Rounds values of this type, halves away from 0, and appends them to hu. path: named by the error.
template <typename T>
Result<void> append_hu(const std::filesystem::path& path, const std::vector<char>& bytes,
                       std::vector<std::int16_t>& hu) {
  constexpr float kLeast = std::numeric_limits<std::int16_t>::min(), kMost = std::numeric_limits<std::int16_t>::max();
  const auto value_at = [&bytes](std::size_t i) {
    T value;
    std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
    return static_cast<float>(value);
  };
  const std::size_t had = hu.size(), count = bytes.size() / sizeof(T);
  hu.resize(had + count);
  bool sound = true;
  for (std::size_t i = 0; i < count; ++i) {
    const float value = value_at(i);
    const bool fits = value >= kLeast && value <= kMost;
    sound = sound && fits;
    hu[had + i] = static_cast<std::int16_t>(fits ? value + std::copysign(0.5F, value) : 0);
  }
  for (std::size_t i = 0; i < count && !sound; ++i) {
    const float value = value_at(i);
    if (value >= kLeast && value <= kMost) continue;
    if (!std::isfinite(value))
      return refused(Errc::bad_value, path, "has voxels that are not finite numbers; export it again");
    return refused(Errc::bad_value, path,
                   fmt::format("has a value of {:g}, which is no Hounsfield unit; is it a CT?", value));
  }
  return {};
}

}  // namespace birdseye::host
