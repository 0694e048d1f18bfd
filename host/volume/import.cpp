#include "host/volume/import.hpp"

#include <utility>

#include "host/volume/image_file.hpp"

namespace birdseye::host {

Result<ImportedVolume> import_with_notes(const VolumeSource& source, const std::stop_token& stop) {
  auto image = read_image(source, 1, stop);
  if (!image) return image.error();
  ImportedVolume imported;
  Volume& volume = imported.volume;
  volume.size = image->size;
  volume.spacing_mm = image->spacing_mm;
  volume.patient_from_voxel.linear() = image->axes * image->spacing_mm.asDiagonal();
  volume.patient_from_voxel.translation() = image->origin_mm;
  volume.frame = {image->patient.id, std::move(image->frame_of_reference_uid)};
  volume.hu = std::move(image->hu);
  imported.patient = std::move(image->patient);
  imported.notes = std::move(image->notes);
  imported.label_names = std::move(image->label_names);
  return imported;
}

Result<Volume> import_volume(const VolumeSource& source, const std::stop_token& stop) {
  auto imported = import_with_notes(source, stop);
  if (!imported) return imported.error();
  return std::move(imported->volume);
}

}  // namespace birdseye::host
