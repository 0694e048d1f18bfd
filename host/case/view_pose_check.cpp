#include "host/case/view_pose_check.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>

#include "calibration/geometry/camera_model.hpp"

namespace birdseye::host {

namespace {

/// Another convention that poses may follow, and how theirs become camera_from_patient in mm.
struct Convention {
  bool inverted = false, opengl = false, metres = false, ras = false;

  [[nodiscard]] Eigen::Matrix4d right(Eigen::Matrix4d given) const {
    if (metres) given.topRightCorner<3, 1>() *= 1000;
    if (inverted) given = given.inverse().eval();
    if (opengl) given = Eigen::Vector4d(1, -1, -1, 1).asDiagonal() * given;
    if (ras) given = given * Eigen::Vector4d(-1, -1, 1, 1).asDiagonal();
    return given;
  }
  [[nodiscard]] int faults() const { return int{inverted} + int{opengl} + int{metres} + int{ras}; }
  [[nodiscard]] std::string words() const {
    std::string out;
    const auto add = [&out](bool is, const char* what) {
      if (is) out += fmt::format("{}{}", out.empty() ? "" : ", and ", what);
    };
    add(inverted, "to be inverted (patient_from_camera): invert them");
    add(opengl, "to have OpenGL's camera axes (y up, z back): turn the signs of their second and third rows");
    add(metres, "to be in metres: multiply their translations by 1000");
    add(ras, "to be of a patient frame in RAS: turn the signs of their first and second columns");
    return out;
  }
};

/// Some voxels of the organ, evenly.
std::vector<Eigen::Vector3d> places_of(const Volume& ct, const std::vector<std::uint8_t>& tissue) {
  constexpr std::size_t kSome = 2000;
  const auto count = static_cast<std::size_t>(std::count(tissue.begin(), tissue.end(), std::uint8_t{1}));
  const std::size_t each = count / kSome + 1;
  std::vector<Eigen::Vector3d> places_mm;
  places_mm.reserve(kSome);
  std::size_t n = 0, voxel = 0;
  for (int k = 0; k < ct.size[2]; ++k) {
    for (int j = 0; j < ct.size[1]; ++j) {
      for (int i = 0; i < ct.size[0]; ++i, ++voxel) {
        if (tissue[voxel] != 0 && n++ % each == 0)
          places_mm.emplace_back(ct.patient_from_voxel * Eigen::Vector3d(i, j, k));
      }
    }
  }
  return places_mm;
}

/// How much of the organ a view shows from where a laparoscope looks at it.
double share_seen(const CameraModel& camera, const Eigen::Matrix4d& camera_from_patient,
                  const std::vector<Eigen::Vector3d>& places_mm) {
  constexpr double kNearest_mm = 5, kFarthest_mm = 600, kWidest = 2;  // the tangent of 63 degrees off the axis
  const Eigen::Isometry3d pose(camera_from_patient);
  const auto seen = std::ranges::count_if(places_mm, [&](const Eigen::Vector3d& place_mm) {
    const Eigen::Vector3d there = pose * place_mm;
    if (there.z() < kNearest_mm || there.z() > kFarthest_mm || there.head<2>().norm() > kWidest * there.z())
      return false;
    const auto pixel = project(camera, there);
    return pixel && pixel->x() > 0 && pixel->y() > 0 && pixel->x() < camera.width_px && pixel->y() < camera.height_px;
  });
  return static_cast<double>(seen) / static_cast<double>(std::max<std::size_t>(places_mm.size(), 1));
}

/// How many of the views see the organ.
std::size_t views_that_see(std::span<const VideoView> views, const Convention& by,
                           const std::vector<Eigen::Vector3d>& places_mm) {
  constexpr double kLeastSeen = 0.005;
  return static_cast<std::size_t>(std::ranges::count_if(views, [&](const VideoView& view) {
    return share_seen(view.camera, by.right(view.camera_from_patient.matrix()), places_mm) > kLeastSeen;
  }));
}

/// How many of the views have the organ in the middle of their picture.
std::size_t views_that_look_at(std::span<const VideoView> views, const Convention& by,
                               const std::vector<Eigen::Vector3d>& places_mm) {
  constexpr double kOffAxis = 0.1, kBetweenPlaces_mm = 5;
  return static_cast<std::size_t>(std::ranges::count_if(views, [&](const VideoView& view) {
    const Eigen::Isometry3d pose(by.right(view.camera_from_patient.matrix()));
    return std::ranges::any_of(places_mm, [&pose](const Eigen::Vector3d& place_mm) {
      const Eigen::Vector3d there = pose * place_mm;
      return there.z() > 0 && there.head<2>().norm() < kOffAxis * there.z() + kBetweenPlaces_mm;
    });
  }));
}

/// Whether all eyes are where the patient frame's origin is, to 2 mm: no scope looks from there, but a translation in
/// metres says so.
bool at_origin(std::span<const VideoView> views) {
  constexpr double kAtOrigin_mm = 2;
  return std::ranges::all_of(
      views, [](const VideoView& view) { return view.camera_from_patient.translation().norm() < kAtOrigin_mm; });
}

}  // namespace

std::string fault_of_poses(std::span<const VideoView> views, const Volume& ct,
                           const std::vector<std::uint8_t>& tissue) {
  const std::vector<Eigen::Vector3d> places_mm = places_of(ct, tissue);
  const bool tiny = at_origin(views);
  const std::size_t as_given = views_that_see(views, {}, places_mm);
  // A single view that looks away is a matter of that view. By chance all may see the organ by wrong poses too, at the
  // rim of their pictures.
  const bool none_see = 2 * as_given <= views.size(), none_look = views_that_look_at(views, {}, places_mm) == 0;
  if (!tiny && !none_see && !none_look) return {};
  std::vector<Convention> others;
  for (unsigned bits = 1; bits < 16; ++bits) {
    const Convention by{(bits & 1U) != 0, (bits & 2U) != 0, (bits & 4U) != 0, (bits & 8U) != 0};
    if (by.metres != tiny || views_that_see(views, by, places_mm) != views.size()) continue;
    if (tiny || none_see || 2 * views_that_look_at(views, by, places_mm) > views.size()) others.push_back(by);
  }
  if (others.empty()) return {};
  const int fewest = std::ranges::min_element(others, {}, &Convention::faults)->faults();
  std::erase_if(others, [fewest](const Convention& by) { return by.faults() > fewest; });
  std::string words = others.front().words();
  for (std::size_t i = 1; i < others.size(); ++i) words += fmt::format("; or {}", others[i].words());
  return fmt::format("{} by the poses as they are given; they seem {}",
                     tiny       ? "all views look from the origin of the patient's frame"
                     : none_see ? fmt::format("{} of {} views see the organ", as_given, views.size())
                                : "no view has the organ in its middle",
                     words);
}

}  // namespace birdseye::host
