#include "host/files/camera_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <opencv2/core.hpp>
#include <vector>

#include "calibration/base/nesting.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/files/record_file.hpp"
#include "host/files/stored_matrix.hpp"
#include "host/files/text_files.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Numbers = std::vector<double>;

constexpr std::size_t kMostBytes = 10'000'000;
constexpr double kMmPerM = 1000;  // Kalibr's lengths are metres
constexpr const char* kAnotherModel = "; calibrate with plumb_bob (radtan) distortion, k1 k2 p1 p2 k3";

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

/// The matrix, row by row, of a camera without skew.
Result<void> set_matrix(const Numbers& k, CameraModel& camera) {
  if (k.size() != 9) return Error{Errc::bad_format, "lacks camera_matrix, 3x3"};
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    return Error{Errc::unsupported, "camera_matrix has a skew, or a last row other than 0 0 1"};
  camera.fx_px = k[0];
  camera.cx_px = k[2];
  camera.fy_px = k[4];
  camera.cy_px = k[5];
  return {};
}

/// k1 k2 p1 p2 k3 and what else OpenCV orders behind them, which may be 0 only.
Result<void> set_distortion(const Numbers& terms, CameraModel& camera) {
  const std::size_t count = terms.size();
  if (count != 0 && count != 4 && count != 5 && count != 8 && count != 12 && count != 14) {
    return Error{Errc::unsupported,
                 fmt::format("has {} distortion_coefficients; 4 or 5 are read (k1 k2 p1 p2 k3)", count)};
  }
  std::array<double*, 5> known{&camera.k1, &camera.k2, &camera.p1, &camera.p2, &camera.k3};
  for (std::size_t i = 0; i < count; ++i) {
    if (i < known.size()) {
      *known.at(i) = terms[i];
    } else if (terms[i] != 0) {
      return Error{Errc::unsupported,
                   fmt::format("its distortion coefficient {} of {} is {:g}, and a lens here has five "
                               "(k1 k2 p1 p2 k3){}",
                               i + 1, count, terms[i], kAnotherModel)};
    }
  }
  return {};
}

Error unknown_model(const char* key, const std::string& model) {
  return {Errc::unsupported, fmt::format("{} {} cannot be said by a lens here{}", key, model, kAnotherModel)};
}

Result<CameraModel> opencv_camera(const fs::path& path) {
  CameraModel camera;
  cv::Mat matrix, distortion;
  try {
    const cv::FileStorage file(path.string(), cv::FileStorage::READ);
    if (!file["image_width"].isInt() || !file["image_height"].isInt())
      return Error{Errc::bad_format, "lacks image_width and image_height; add the size the lens was calibrated at"};
    camera.width_px = static_cast<int>(file["image_width"]);
    camera.height_px = static_cast<int>(file["image_height"]);
    matrix = stored_matrix(file["camera_matrix"]);
    distortion = stored_matrix(file["distortion_coefficients"]);
  } catch (const cv::Exception&) {
    return Error{Errc::bad_format, "is no camera file in OpenCV's YAML"};
  }
  const auto numbers = [](const cv::Mat& of) { return of.empty() ? Numbers{} : Numbers(of.reshape(1, 1)); };
  if (const auto sound = set_matrix(numbers(matrix), camera); !sound) return sound.error();
  if (const auto sound = set_distortion(numbers(distortion), camera); !sound) return sound.error();
  return camera;
}

/// Numbers under the first of the keys that is there; of a matrix, its data.
Numbers numbers_under(const YAML::Node& node, std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    const YAML::Node found = node[key];
    if (!found) continue;
    return (found.IsMap() ? found["data"] : found).as<Numbers>();
  }
  return {};
}

Result<CameraModel> ros_camera(const YAML::Node& node) {
  CameraModel camera;
  const YAML::Node width = node["image_width"] ? node["image_width"] : node["width"];
  const YAML::Node height = node["image_height"] ? node["image_height"] : node["height"];
  if (!width || !height)
    return Error{Errc::bad_format, "lacks image_width and image_height; add the size the lens was calibrated at"};
  camera.width_px = width.as<int>();
  camera.height_px = height.as<int>();
  const auto model = node["distortion_model"] ? node["distortion_model"].as<std::string>() : std::string("plumb_bob");
  if (model != "plumb_bob" && model != "rational_polynomial" && !model.empty())
    return unknown_model("its distortion_model", model);
  for (const char* binning : {"binning_x", "binning_y"}) {
    if (node[binning] && node[binning].as<int>() > 1)
      return Error{Errc::unsupported,
                   fmt::format("its {} is over 1: give the lens of the pictures as they are, all lengths of them in "
                               "px divided by it",
                               binning)};
  }
  // Width and K are the whole sensor's; of the pictures they hold only where the region of interest is all of it.
  if (const YAML::Node roi = node["roi"]) {
    const auto of_roi = [&roi](const char* key) { return roi[key] ? roi[key].as<int>() : 0; };
    const int x = of_roi("x_offset"), y = of_roi("y_offset"), wide = of_roi("width"), high = of_roi("height");
    if (x != 0 || y != 0 || (wide != 0 && wide != camera.width_px) || (high != 0 && high != camera.height_px)) {
      return Error{
          Errc::unsupported,
          fmt::format("its roi is a part of the picture ({}x{} px from {}, {}): give the lens of the pictures as "
                      "they are: the roi's width and height, cx less {} and cy less {}, and no roi",
                      wide, high, x, y, x, y)};
    }
  }
  if (const auto sound = set_matrix(numbers_under(node, {"camera_matrix", "K", "k"}), camera); !sound)
    return sound.error();
  if (const auto sound = set_distortion(numbers_under(node, {"distortion_coefficients", "D", "d"}), camera); !sound)
    return sound.error();
  return camera;
}

Result<CameraModel> kalibr_camera(const YAML::Node& node) {
  const auto model = node["camera_model"].as<std::string>();
  if (model != "pinhole") return unknown_model("its camera_model", model);
  const auto distortion = node["distortion_model"] ? node["distortion_model"].as<std::string>() : std::string("none");
  if (distortion != "radtan" && distortion != "none") return unknown_model("its distortion_model", distortion);
  const auto size = node["resolution"].as<std::vector<int>>();
  const Numbers f = node["intrinsics"].as<Numbers>();
  const Numbers d = distortion == "none" ? Numbers{} : node["distortion_coeffs"].as<Numbers>();
  if (size.size() != 2 || f.size() != 4 || (distortion == "radtan" && d.size() != 4))
    return Error{Errc::bad_format, "has not 2 numbers of resolution, 4 of intrinsics and 4 of distortion_coeffs"};
  CameraModel camera{size[0], size[1], f[0], f[1], f[2], f[3]};
  if (const auto sound = set_distortion(d, camera); !sound) return sound.error();
  return camera;
}

bool is_kalibr(const YAML::Node& root) {
  return root.IsMap() && std::any_of(root.begin(), root.end(), [](const auto& item) {
           return item.second.IsMap() && item.second["camera_model"] && item.second["intrinsics"];
         });
}

/// The camera of a camchain that is meant: the one that is named, or the only one.
Result<YAML::Node> kalibr_node(const YAML::Node& root, const std::string& name) {
  std::vector<std::string> names;
  for (const auto& item : root) {
    if (item.second.IsMap() && item.second["camera_model"]) names.push_back(item.first.as<std::string>());
  }
  if (std::find(names.begin(), names.end(), name) != names.end()) return root[name];
  if (name.empty() && names.size() == 1) return root[names.front()];
  return Error{Errc::bad_value, fmt::format("{}; it holds {}: name one behind the path, as camchain.yaml:{}",
                                            name.empty() ? "say which of its cameras" : "has no camera " + name,
                                            fmt::join(names, ", "), names.empty() ? "cam0" : names.front())};
}

/// The name of the one camera that tells where it is against the one before; empty where there is no such, or several.
std::string only_related(const YAML::Node& root) {
  std::vector<std::string> names;
  for (const auto& item : root) {
    if (item.second.IsMap() && item.second["T_cn_cnm1"]) names.push_back(item.first.as<std::string>());
  }
  return names.size() == 1 ? names.front() : std::string();
}

/// Reads the file as plain YAML; what parse makes of it may throw what yaml-cpp throws.
template <typename Parse>
auto of_yaml(const fs::path& path, const Parse& parse) -> decltype(parse(YAML::Node())) {
  try {
    return parse(YAML::LoadFile(path.string()));
  } catch (const YAML::Exception& error) {
    return Error{Errc::bad_format, fmt::format("is no camera file of OpenCV, ROS or Kalibr: {}", error.what())};
  }
}

Result<CameraModel> plain_camera(const CameraPath& path) {
  return of_yaml(path.file, [&](const YAML::Node& root) -> Result<CameraModel> {
    if (is_kalibr(root)) {
      const auto node = kalibr_node(root, path.camera);
      if (!node) return node.error();
      return kalibr_camera(*node);
    }
    if (!root.IsMap()) return Error{Errc::bad_format, "is no camera file of OpenCV, ROS or Kalibr"};
    if (!path.camera.empty())
      return Error{Errc::bad_value, fmt::format("holds one camera: leave :{} out", path.camera)};
    return ros_camera(root);
  });
}

/// Whether the file is one that OpenCV wrote, by its first bytes.
bool is_opencv(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string first(5, '\0');
  in.read(first.data(), static_cast<std::streamsize>(first.size()));
  return first == "%YAML" || first == "<?xml" || first.starts_with("{");
}

Result<void> check_file(const fs::path& path) {
  const auto text = read_whole_file(path, kMostBytes);
  if (!text && text.error().code == Errc::unsupported)
    return Error{Errc::bad_format, fmt::format("{}: is no camera file: it is larger than 10 MB", path.string())};
  if (!text) return text.error();
  if (nests_too_deeply(*text, Notation::yaml_or_xml))
    return Error{Errc::bad_format,
                 fmt::format("{}: is no camera file: it nests lists deeper than any; write it anew", path.string())};
  return {};
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
  if (const auto there = check_file(which.file); !there) return there.error();
  if (read_signed_record(which.file)) {
    return Error{Errc::bad_format,
                 fmt::format("{}: is a calibration record; `birdseye export lens --record {} --as opencv --out "
                             "camera.yaml` writes its lens",
                             which.file.string(), which.file.string())};
  }
  if (is_opencv(which.file) && !which.camera.empty())
    return Error{Errc::bad_value,
                 fmt::format("{}: holds one camera: leave :{} out", which.file.string(), which.camera)};
  auto camera = is_opencv(which.file) ? opencv_camera(which.file) : plain_camera(which);
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
  if (const auto there = check_file(which.file); !there) return there.error();
  const auto rows = of_yaml(which.file, [&](const YAML::Node& root) -> Result<std::vector<Numbers>> {
    if (!is_kalibr(root)) return Error{Errc::bad_format, "is no camchain of Kalibr, which would hold T_cn_cnm1"};
    const auto node = kalibr_node(root, which.camera.empty() ? only_related(root) : which.camera);
    if (!node) return node.error();
    if (!(*node)["T_cn_cnm1"])
      return Error{Errc::bad_format, "lacks T_cn_cnm1 of this camera: name the one that has it, as camchain.yaml:cam1"};
    return (*node)["T_cn_cnm1"].as<std::vector<Numbers>>();
  });
  if (!rows) return rows.error().with_context(which.file.string());
  Eigen::Matrix4d m;
  for (std::size_t i = 0; i < 16; ++i) {
    if (rows->size() != 4 || (*rows)[i / 4].size() != 4)
      return Error{Errc::bad_format, which.file.string() + ": its T_cn_cnm1 is no 4x4 matrix"};
    m(static_cast<int>(i / 4), static_cast<int>(i % 4)) = (*rows)[i / 4][i % 4];
  }
  m.topRightCorner<3, 1>() *= kMmPerM;
  return check_rigid(m, which.file.string());
}

}  // namespace birdseye::host
