#include "host/volume/import.hpp"

#include <utility>

#include "host/volume/image_file.hpp"

namespace birdseye::host {

Result<Volume> import_volume(const std::filesystem::path& path, const std::stop_token& stop) {
  auto image = read_image(path, 1, stop);
  if (!image) return image.error();
  Volume volume;
  volume.size = image->size;
  volume.spacing_mm = image->spacing_mm;
  volume.patient_from_voxel.linear() = image->axes * image->spacing_mm.asDiagonal();
  volume.patient_from_voxel.translation() = image->origin_mm;
  volume.hu = std::move(image->hu);
  return volume;
}

}  // namespace birdseye::host
