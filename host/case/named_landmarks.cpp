#include "host/case/named_landmarks.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/registration/geometry/landmark_rays.hpp"

namespace birdseye::host {

bool lies_in(const Volume& ct, const Eigen::Vector3d& place_mm) {
  const Eigen::Vector3d voxel = ct.patient_from_voxel.inverse() * place_mm;
  const Eigen::Vector3d last(ct.size[0] - 1, ct.size[1] - 1, ct.size[2] - 1);
  return (voxel.array() >= 0).all() && (voxel.array() <= last.array()).all();
}

Result<NamedMatch> match_of(const LandmarkEntry& entry, const Volume& ct, const std::vector<VideoView>& views,
                            const std::vector<NamedMatch>& others) {
  for (const NamedMatch& other : others) {
    if (other.name == entry.name)
      return Error{Errc::bad_value, fmt::format("name: {} is another landmark's too; name each once", entry.name)};
  }
  if (!lies_in(ct, entry.place_mm))
    return Error{Errc::bad_value, "place_mm: lies outside the CT; give mm in the patient's frame, LPS"};
  std::vector<LandmarkPixel> pixels;
  for (const LandmarkEntry::Seen& seen : entry.seen) {
    const auto view = std::find_if(views.begin(), views.end(), [&](const auto& one) { return one.name == seen.view; });
    if (view == views.end()) {
      return Error{Errc::bad_value,
                   fmt::format("seen: view {} is none of the [[view]]s; name one by its image", seen.view)};
    }
    for (const LandmarkPixel& other : pixels) {
      if (other.view == seen.view)
        return Error{Errc::bad_value, fmt::format("seen: view {} is named twice; leave one out", seen.view)};
    }
    pixels.push_back({view->name, view->camera, view->camera_from_patient, seen.pixel_px, seen.sigma_px});
  }
  const auto matched = matched_by_rays(entry.place_mm, entry.sigma_mm, pixels);
  if (!matched) return matched.error().with_context("seen");
  return NamedMatch{entry.name, pixels.size(), *matched};
}

}  // namespace birdseye::host
