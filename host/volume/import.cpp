#include "host/volume/import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "host/dicom/refused.hpp"
#include "host/volume/image_file.hpp"

namespace birdseye::host {

namespace {

constexpr std::int16_t kLeastBody_hu = -700;  // a lung's tissue is denser

/// The longest side of the box that holds all that is no air; 0 where there is nothing but air.
double body_reach_mm(const Volume& ct) {
  Eigen::Array3i low(ct.size[0], ct.size[1], ct.size[2]), high(-1, -1, -1);
  const auto is_body = [](std::int16_t hu) { return hu >= kLeastBody_hu; };
  const auto columns = static_cast<std::ptrdiff_t>(ct.size[0]);
  auto row = ct.hu.begin();
  for (int k = 0; k < ct.size[2]; ++k) {
    for (int j = 0; j < ct.size[1]; ++j, row += columns) {
      const auto first = std::find_if(row, row + columns, is_body);
      if (first == row + columns) continue;
      auto last = row + columns - 1;
      while (!is_body(*last)) --last;
      low = low.min(Eigen::Array3i(static_cast<int>(first - row), j, k));
      high = high.max(Eigen::Array3i(static_cast<int>(last - row), j, k));
    }
  }
  if (high[0] < 0) return 0;
  return ((high - low + 1).cast<double>() * ct.spacing_mm.array()).maxCoeff();
}

}  // namespace

Result<ImportedVolume> import_with_notes(const VolumeSource& source, const std::stop_token& stop) {
  auto image = read_image(source, 1, stop);
  if (!image) return image.error();
  ImportedVolume imported;
  Volume& volume = imported.volume;
  volume.size = image->size;
  volume.spacing_mm = image->spacing_mm;
  volume.patient_from_voxel.linear() = image->axes * image->spacing_mm.asDiagonal();
  volume.patient_from_voxel.translation() = image->origin_mm;
  volume.frame = {image->patient.id, std::move(image->frame_of_reference_uid), std::move(image->series_uid),
                  image->patient.name};
  volume.hu = std::move(image->hu);
  imported.patient = std::move(image->patient);
  imported.notes = std::move(image->notes);
  imported.label_names = std::move(image->label_names);
  return imported;
}

Result<ImportedVolume> import_body(const VolumeSource& source, const std::stop_token& stop) {
  auto imported = import_with_notes(source, stop);
  if (!imported) return imported.error();
  constexpr double kLeast_mm = 20, kMost_mm = 3000;
  const Volume& ct = imported->volume;
  if (ct.size[2] < 2) return refused(Errc::bad_value, source.path, "is one slice; give the whole series");
  const auto [low, high] = std::minmax_element(ct.hu.begin(), ct.hu.end());
  if (*low == *high && *low >= kLeastBody_hu) {
    return refused(Errc::bad_value, source.path,
                   fmt::format("holds nothing: all of its voxels are {} HU; export it again; is it the CT?", *low));
  }
  const double reach_mm = body_reach_mm(ct);
  if (reach_mm == 0) return refused(Errc::bad_value, source.path, "holds nothing but air; is it the CT?");
  if (reach_mm < kLeast_mm || reach_mm > kMost_mm) {
    return refused(
        Errc::bad_value, source.path,
        fmt::format("holds a body of {:.0f} mm, and a body has {:.0f} to {:.0f} mm: its voxels are {:.4g} x {:.4g} x "
                    "{:.4g} mm, which cannot be; export it in mm, or see whether its spacing is right",
                    reach_mm, kLeast_mm, kMost_mm, ct.spacing_mm.x(), ct.spacing_mm.y(), ct.spacing_mm.z()));
  }
  return imported;
}

Result<Volume> import_volume(const VolumeSource& source, const std::stop_token& stop) {
  auto imported = import_with_notes(source, stop);
  if (!imported) return imported.error();
  return std::move(imported->volume);
}

}  // namespace birdseye::host
