#include "host/volume/mask_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>

#include "host/dicom/shared_values.hpp"
#include "host/volume/image_file.hpp"
#include "host/volume/label_grid.hpp"
#include "host/volume/totalsegmentator_names.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr int kFirstOther = 201;

/// What a mask is of: its file's name without its ending; empty where it is no NIfTI file.
std::string structure_of(const fs::path& path) {
  const std::string name = path.filename().string();
  for (const char* ending : {".nii.gz", ".nii"}) {
    if (name.size() > std::string_view(ending).size() && name.ends_with(ending))
      return name.substr(0, name.size() - std::string_view(ending).size());
  }
  return {};
}

/// By name, so that numbers are the same on every machine.
std::map<std::string, fs::path> masks_in(const fs::path& folder) {
  std::map<std::string, fs::path> masks;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (const std::string name = structure_of(at->path()); !name.empty() && at->is_regular_file(ignored))
      masks[name] = at->path();
  }
  return masks;
}

int number_of(const std::string& name, int& next_other) {
  const auto known = totalsegmentator_names();
  const auto found = std::find(known.begin(), known.end(), name);
  return found != known.end() ? static_cast<int>(found - known.begin()) + 1 : next_other++;
}

/// Adds a structure to what voxels belong to; false where too many of them share voxels.
bool add_mask(const Volume& mask, int number, SharedValues& values, Volume& labels) {
  for (std::size_t i = 0; i < mask.hu.size(); ++i) {
    if (mask.hu[i] == 0) continue;
    const auto value = values.with(labels.hu[i], number);
    if (!value) return false;
    labels.hu[i] = static_cast<std::int16_t>(*value);
  }
  return true;
}

}  // namespace

bool is_mask_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error) && !masks_in(path).empty();
}

std::vector<NamedLabel> mask_names(const fs::path& folder) {
  std::vector<NamedLabel> names;
  int next_other = kFirstOther;
  for (const auto& [name, path] : masks_in(folder)) names.push_back({number_of(name, next_other), name, {}});
  return names;
}

Result<LabelVolume> import_masks(const fs::path& folder, const Volume& ct, std::span<const LabelChoice> wanted,
                                 const std::stop_token& stop) {
  const auto masks = masks_in(folder);
  LabelVolume out;
  out.names = mask_names(folder);
  out.volume.size = ct.size;
  out.volume.spacing_mm = ct.spacing_mm;
  out.volume.patient_from_voxel = ct.patient_from_voxel;
  out.volume.hu.assign(grid_count(ct.size), 0);
  SharedValues values(kFirstOther + static_cast<int>(masks.size()));
  for (NamedLabel& label : out.names) {
    if (!wanted.empty() &&
        std::none_of(wanted.begin(), wanted.end(), [&label](const LabelChoice& one) { return is_chosen(one, label); }))
      continue;
    const fs::path& path = masks.at(label.name);
    const auto image = read_labels_file(path, stop);
    if (!image) return image.error();
    auto mask = labels_on_grid(ct, *image, path);
    if (!mask) return mask.error();
    out.notes.insert(out.notes.end(), mask->notes.begin(), mask->notes.end());
    if (!add_mask(mask->volume, label.number, values, out.volume)) {
      return Error{Errc::unsupported,
                   fmt::format("{}: too many masks share voxels; name fewer of them", folder.string())};
    }
    label.values = {label.number};
  }
  for (NamedLabel& label : out.names) {
    if (label.values.empty()) continue;  // not wanted
    const std::vector<int> shared = values.shared_by(label.number);
    label.values.insert(label.values.end(), shared.begin(), shared.end());
  }
  return out;
}

}  // namespace birdseye::host
