#include "host/volume/import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/volume/decode.hpp"
#include "host/volume/image_file.hpp"

namespace birdseye::host {

Result<Volume> import_volume(const std::filesystem::path& path) {
  auto image = read_image(path, 1);
  if (!image) return image.error();
  Volume volume;
  volume.size = image->size;
  volume.spacing_mm = image->spacing_mm;
  volume.patient_from_voxel.linear() = image->axes * image->spacing_mm.asDiagonal();
  volume.patient_from_voxel.translation() = image->origin_mm;
  constexpr float kLeast = std::numeric_limits<std::int16_t>::min(), kMost = std::numeric_limits<std::int16_t>::max();
  for (const float value : image->values) {
    if (value >= kLeast && value <= kMost) continue;
    if (!std::isfinite(value))
      return refused(Errc::bad_value, path, "has voxels that are not finite numbers; export it again");
    return refused(Errc::bad_value, path,
                   fmt::format("has a value of {:g}, which is no Hounsfield unit; is it a CT?", value));
  }
  volume.hu.resize(image->values.size());
  std::transform(image->values.begin(), image->values.end(), volume.hu.begin(), [](float value) {
    return static_cast<std::int16_t>(value + std::copysign(0.5F, value));  // halves away from 0, as lround
  });
  return volume;
}

}  // namespace birdseye::host
