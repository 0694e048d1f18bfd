#include "hw-sim/case/case_files.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "hw-sim/phantom/image_files.hpp"
#include "hw-sim/phantom/json_file.hpp"

namespace birdseye::hw_sim {

Result<void> write_camera(const std::filesystem::path& path, const CameraModel& c) {
  cv::FileStorage file(".yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  file << "image_width" << c.width_px << "image_height" << c.height_px;
  file << "camera_matrix" << cv::Mat(cv::Matx33d(c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1));
  file << "distortion_coefficients" << cv::Mat(cv::Matx<double, 1, 5>(c.k1, c.k2, c.p1, c.p2, c.k3));
  return write_text(path, file.releaseAndGetString());
}

Result<void> write_pose(const std::filesystem::path& path, const Transform<Camera, Patient>& camera_from_patient) {
  const Eigen::Matrix4d m = camera_from_patient.matrix();
  std::string text;
  for (int i = 0; i < 4; ++i)
    text += fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}\n", m(i, 0), m(i, 1), m(i, 2), m(i, 3));
  return write_text(path, text);
}

Result<void> write_picture(const std::filesystem::path& path, std::span<const std::uint8_t> pixels,
                           const CameraModel& camera) {
  const auto count = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  std::vector<std::uint8_t> bgr(pixels.begin(), pixels.end());
  const bool colour = pixels.size() == 3 * count;
  if (colour) {
    for (std::size_t i = 0; i < bgr.size(); i += 3) std::swap(bgr[i], bgr[i + 2]);
  }
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", cv::Mat(camera.height_px, camera.width_px, colour ? CV_8UC3 : CV_8UC1, bgr.data()), bytes);
  return write_text(path, std::string(bytes.begin(), bytes.end()));
}

Result<void> write_landmarks(const std::filesystem::path& path, const std::vector<TrueLandmark>& landmarks) {
  std::string csv = "name,rest_x_mm,rest_y_mm,rest_z_mm,deformed_x_mm,deformed_y_mm,deformed_z_mm\n";
  for (const TrueLandmark& landmark : landmarks) {
    const Eigen::Vector3d& r = landmark.rest_mm;
    const Eigen::Vector3d& d = landmark.deformed_mm;
    csv += fmt::format("{},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f},{:.9f}\n", landmark.name, r.x(), r.y(), r.z(), d.x(),
                       d.y(), d.z());
  }
  return write_text(path, csv);
}

Result<void> write_surface_points(const std::filesystem::path& path, const std::vector<Eigen::Vector3d>& points_mm,
                                  double sigma_mm) {
  std::string csv = "x_mm,y_mm,z_mm,sigma_mm\n";
  for (const Eigen::Vector3d& p : points_mm)
    csv += fmt::format("{:.6f},{:.6f},{:.6f},{:g}\n", p.x(), p.y(), p.z(), sigma_mm);
  return write_text(path, csv);
}

Result<void> write_map_field(const std::filesystem::path& path, const TissueMap& map) {
  constexpr int kPoints = 65;  // trilinear between them, the field is within 0.05 mm of a map of 10 mm
  Grid lattice;
  lattice.size = {kPoints, kPoints, kPoints};
  lattice.origin_mm = map.low_mm();
  lattice.spacing_mm = (map.high_mm() - map.low_mm()) / (kPoints - 1);
  std::vector<Eigen::Vector3f> displacement_mm(lattice.voxels(), Eigen::Vector3f::Zero());
  constexpr double kStill_mm = 1e-9;  // where nothing moves but by rounding, as on the surface of a patch's box
  tbb::parallel_for(0, kPoints, [&](int k) {
    for (int j = 0; j < kPoints; ++j) {
      for (int i = 0; i < kPoints; ++i) {
        const Eigen::Vector3d u = map.displacement_mm(lattice.point(i, j, k));
        if (u.norm() > kStill_mm) displacement_mm[lattice.index(i, j, k)] = u.cast<float>();
      }
    }
  });
  return write_field(path, lattice, displacement_mm);
}

Result<void> write_control_points(const std::filesystem::path& path, const BezierMap& map) {
  nlohmann::json json;
  json["frame"] = "patient LPS, mm";
  json["direction"] = "rest = deformed + u(deformed)";
  json["box_low_mm"] = json_of(map.low_mm());
  json["box_high_mm"] = json_of(map.high_mm());
  json["degree"] = {map.inner()[0] + 1, map.inner()[1] + 1, map.inner()[2] + 1};
  json["inner_control_points"] = map.inner();
  json["order"] = "x fastest, inner control points only; those on the box's surface are zero";
  json["displacement_mm"] = nlohmann::json::array();
  for (const Eigen::Vector3d& d : map.control_mm()) json["displacement_mm"].push_back(json_of(d));
  return write_json(path, json);
}

}  // namespace birdseye::hw_sim
