#include "host/files/camera_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/emitter.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "calibration/base/nesting.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/confine/confined_result.hpp"
#include "host/files/camera_text.hpp"
#include "host/files/record_file.hpp"
#include "host/files/text_files.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = 10'000'000;
constexpr double kMmPerM = 1000;  // Kalibr's lengths are metres

/// A path, and which of the file's cameras is meant.
struct CameraPath {
  fs::path file;
  std::string camera;  ///< as "cam1"; empty where none is named
};

CameraPath camera_path(const fs::path& path) {
  std::error_code ignored;
  const std::string text = path.string();
  const auto colon = text.rfind(':');
  if (fs::exists(path, ignored) || colon == std::string::npos) return {path, {}};
  return {text.substr(0, colon), text.substr(colon + 1)};
}

Result<std::string> text_of(const fs::path& path) {
  auto text = read_whole_file(path, kMostBytes);
  if (!text && text.error().code == Errc::unsupported)
    return Error{Errc::bad_format, fmt::format("{}: is no camera file: it is larger than 10 MB", path.string())};
  if (text && nests_too_deeply(*text, Notation::yaml_or_xml))
    return Error{Errc::bad_format,
                 fmt::format("{}: is no camera file: it nests lists deeper than any; write it anew", path.string())};
  return text;
}

/// For a confined process: a camera's name, which has no zero byte in it, and the text behind one.
std::string named_text(const std::string& name, const std::string& text) {
  return name + '\0' + text;
}
std::pair<std::string, std::string> name_and_text(std::string_view named) {
  const auto zero = std::min(named.find('\0'), named.size() - 1);
  return {std::string(named.substr(0, zero)), std::string(named.substr(zero + 1))};
}

Result<CameraModel> camera_of(std::string_view named) {
  const auto [name, text] = name_and_text(named);
  return parse_camera(text, name);
}
Result<StoredCovariance> covariance_of(std::string_view text) {
  return parse_camera_covariance(std::string(text));
}
Result<std::array<double, 16>> relation_of(std::string_view named) {
  const auto [name, text] = name_and_text(named);
  return parse_camera_relation(text, name);
}

std::string kalibr_entry(const CameraModel& c, int number, const std::string& relation) {
  return fmt::format(
      "cam{}:\n{}  camera_model: pinhole\n  intrinsics: [{:.17g}, {:.17g}, {:.17g}, {:.17g}]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [{:.17g}, {:.17g}, {:.17g}, {:.17g}]\n"
      "  resolution: [{}, {}]\n",
      number, relation, c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.k1, c.k2, c.p1, c.p2, c.width_px, c.height_px);
}

Result<void> has_no_k3(const CameraModel& camera) {
  if (camera.k3 == 0) return {};
  return Error{Errc::unsupported,
               fmt::format("the lens has k3 = {:g}, which Kalibr's radtan has not: calibrate it with --model "
                           "radial2_tangential2",
                           camera.k3)};
}

}  // namespace

Result<CameraModel> read_camera(const fs::path& path) {
  const CameraPath which = camera_path(path);
  const auto text = text_of(which.file);
  if (!text) return text.error();
  if (read_signed_record(which.file)) {
    return Error{Errc::bad_format,
                 fmt::format("{}: is a calibration record; `birdseye export lens --record {} --as opencv --out "
                             "camera.yaml` writes its lens",
                             which.file.string(), which.file.string())};
  }
  auto camera = result_of_confined<camera_of>(named_text(which.camera, *text));
  if (!camera) return camera.error().with_context(which.file.string());
  if (const auto sound = check(*camera); !sound) return sound.error().with_context(which.file.string());
  return camera;
}

std::string camera_text(const CameraModel& c) {
  return fmt::format(
      "%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ {:.17g}, 0., {:.17g}, 0., {:.17g}, {:.17g}, 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
      "   data: [ {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g} ]\n",
      c.width_px, c.height_px, c.fx_px, c.cx_px, c.fy_px, c.cy_px, c.k1, c.k2, c.p1, c.p2, c.k3);
}

std::string ros_camera_text(const CameraModel& c, const std::string& name) {
  YAML::Emitter quoted;
  quoted << name;
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_name: {}\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{:.17g}, 0, {:.17g}, 0, {:.17g}, {:.17g}, 0, 0, 1]\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n"
      "  data: [{:.17g}, 0, {:.17g}, 0, 0, {:.17g}, {:.17g}, 0, 0, 0, 1, 0]\n",
      c.width_px, c.height_px, quoted.c_str(), c.fx_px, c.cx_px, c.fy_px, c.cy_px, c.k1, c.k2, c.p1, c.p2, c.k3,
      c.fx_px, c.cx_px, c.fy_px, c.cy_px);
}

Result<std::string> kalibr_text(const CameraModel& camera) {
  if (const auto can = has_no_k3(camera); !can) return can.error();
  return kalibr_entry(camera, 0, {});
}

Result<std::string> kalibr_text(const CameraModel& left, const CameraModel& right,
                                const Transform<RightCamera, Camera>& right_from_left) {
  for (const CameraModel* camera : {&left, &right}) {
    if (const auto can = has_no_k3(*camera); !can) return can.error();
  }
  Eigen::Matrix4d m = right_from_left.matrix();
  m.topRightCorner<3, 1>() /= kMmPerM;
  std::string relation = "  T_cn_cnm1:\n";
  for (int i = 0; i < 4; ++i)
    relation += fmt::format("  - [{:.17g}, {:.17g}, {:.17g}, {:.17g}]\n", m(i, 0), m(i, 1), m(i, 2), m(i, 3));
  return kalibr_entry(left, 0, {}) + kalibr_entry(right, 1, relation);
}

Result<Eigen::Matrix4d> read_camera_relation(const fs::path& path) {
  const CameraPath which = camera_path(path);
  const std::string ending = which.file.extension().string();
  if (ending != ".yaml" && ending != ".yml") return read_pose(path);
  const auto text = text_of(which.file);
  if (!text) return text.error();
  const auto by_rows = result_of_confined<relation_of>(named_text(which.camera, *text));
  if (!by_rows) return by_rows.error().with_context(which.file.string());
  Eigen::Matrix4d m = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>(by_rows->data());
  m.topRightCorner<3, 1>() *= kMmPerM;
  return check_rigid(m, which.file.string());
}

Result<std::optional<CameraMatrix>> read_camera_covariance(const fs::path& path) {
  // One camera of several, as "kalibr.yaml:cam0" names it, has none.
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return std::optional<CameraMatrix>();
  const auto text = text_of(path);
  if (!text) return text.error();
  const auto stored = result_of_confined<covariance_of>(*text);
  if (!stored) return stored.error().with_context(path.string());
  if (stored->count == 0) return std::optional<CameraMatrix>();
  const CameraMatrix out(stored->by_rows.data());  // as its transpose, where it is none
  if (!is_covariance(out))
    return Error{Errc::bad_value,
                 fmt::format("{}: camera_covariance is no covariance; take it out to work without", path.string())};
  return std::optional(out);
}

std::string camera_covariance_text(const CameraMatrix& covariance) {
  std::vector<double> numbers(covariance.data(), covariance.data() + covariance.size());
  return fmt::format("camera_covariance: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {:.17g} ]\n",
                     covariance.rows(), covariance.cols(), fmt::join(numbers, ", "));
}

}  // namespace birdseye::host
