#include "host/files/camera_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <vector>

#include "calibration/base/lower_case.hpp"
#include "host/files/opencv_numbers.hpp"
#include "host/files/stored_matrix.hpp"

namespace birdseye::host {

namespace {

using Numbers = std::vector<double>;

constexpr int kInMemory = cv::FileStorage::READ | cv::FileStorage::MEMORY;
constexpr const char* kAnotherModel = "; calibrate with plumb_bob (radtan) distortion, k1 k2 p1 p2 k3";

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

/// Without them a lens that bends would be taken for one that does not.
Error lacks_distortion(const char* key) {
  return {Errc::bad_format,
          fmt::format("lacks {}; write the lens again with it, or with zeros where the lens has no distortion", key)};
}

/// Of such a key one reader takes the first value, another the last.
Error stands_twice(const std::string& key) {
  return {Errc::bad_format, fmt::format("has {} twice; take out the one that is not meant", key)};
}

Error unknown_model(const char* key, const std::string& model) {
  return {Errc::unsupported, fmt::format("its {} {} cannot be said by a lens here{}", key, model, kAnotherModel)};
}

/// Refuses by name a file whose numbers are meant for another model than a lens here has, whatever their count. said:
/// what the file has under a key, as text; none where the file lacks the key.
template <typename Said>
Result<void> refuse_other_models(const Said& said) {
  const std::string fisheye = lower_case(said("fisheye_model").value_or("0"));
  if (fisheye != "0" && fisheye != "false") return unknown_model("fisheye_model", fisheye);
  if (const auto xi = said("xi")) return unknown_model("xi (of an omnidirectional camera)", *xi);
  for (const char* key : {"distortion_model", "camera_model"}) {
    const std::string model = said(key).value_or(""), word = lower_case(model);
    if (!word.empty() && word != "plumb_bob" && word != "radtan" && word != "rational_polynomial" &&
        word != "pinhole" && word != "none") {
      return unknown_model(key, model);
    }
  }
  return {};
}

/// What the node holds, as text; none where there is no node.
std::optional<std::string> words_of(const cv::FileNode& node) {
  if (node.empty()) return std::nullopt;
  if (node.isString()) return static_cast<std::string>(node);
  if (node.isInt() || node.isReal()) return fmt::format("{:g}", static_cast<double>(node));
  return "[..]";
}

/// A key that stands twice in the map, or in one of the maps right in it. Empty where there is none.
std::string twice_in(const cv::FileNode& map, int deeper = 1) {
  if (!map.isMap()) return {};
  std::set<std::string> keys;
  for (const cv::FileNode item : map) {
    if (!keys.insert(item.name()).second) return item.name();
    if (deeper == 0) continue;
    if (std::string twice = twice_in(item, deeper - 1); !twice.empty()) return twice;
  }
  return {};
}

Result<CameraModel> opencv_camera(const std::string& text) {
  if (const std::string number = octal_size(text); !number.empty())
    return Error{Errc::bad_value,
                 fmt::format("has a picture of {} px; write the number without the 0 before it", number.substr(0, 40))};
  if (const std::string number = beyond_int(text); !number.empty()) {
    return Error{Errc::bad_value,
                 fmt::format("has the whole number {}, which OpenCV takes for another; mend it, or put it in quotes "
                             "where it is a name",
                             number.substr(0, 40))};
  }
  CameraModel camera;
  cv::Mat matrix, distortion;
  try {
    const cv::FileStorage file(text, kInMemory);
    if (const std::string twice = twice_in(file.root()); !twice.empty()) return stands_twice(twice);
    if (const auto sound = refuse_other_models([&file](const char* key) { return words_of(file[key]); }); !sound)
      return sound.error();
    if (!file["image_width"].isInt() || !file["image_height"].isInt())
      return Error{Errc::bad_format, "lacks image_width and image_height; add the size the lens was calibrated at"};
    camera.width_px = static_cast<int>(file["image_width"]);
    camera.height_px = static_cast<int>(file["image_height"]);
    matrix = stored_matrix(file["camera_matrix"]);
    if (file["distortion_coefficients"].empty()) return lacks_distortion("distortion_coefficients");
    distortion = stored_matrix(file["distortion_coefficients"]);
  } catch (const cv::Exception&) {
    return Error{Errc::bad_format, "is no camera file in OpenCV's YAML"};
  }
  const auto numbers = [](const cv::Mat& of) { return of.empty() ? Numbers{} : Numbers(of.reshape(1, 1)); };
  if (const auto sound = set_matrix(numbers(matrix), camera); !sound) return sound.error();
  if (const auto sound = set_distortion(numbers(distortion), camera); !sound) return sound.error();
  return camera;
}

/// A decimal whole number: yaml-cpp itself takes 064 for 52.
int whole_of(const YAML::Node& node) {
  const std::string& text = node.Scalar();
  int value = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, failed] = std::from_chars(text.data() + (text.starts_with('+') ? 1 : 0), end, value);
  if (failed != std::errc() || rest != end)
    throw YAML::RepresentationException(node.Mark(), "a whole decimal number belongs there");
  return value;
}

/// Numbers of a list; of a matrix, its data; of a word, the whole number that it is.
Numbers numbers_of(const YAML::Node& node) {
  if (node.IsScalar()) return {static_cast<double>(whole_of(node))};
  return (node.IsMap() ? node["data"] : node).as<Numbers>();
}

/// What the node holds, as text; none where there is no node.
std::optional<std::string> words_of(const YAML::Node& node) {
  if (!node) return std::nullopt;
  return node.IsScalar() ? node.Scalar() : "[..]";
}

/// Numbers under the first of the keys that is there. Nothing where none is there.
std::optional<Numbers> numbers_under(const YAML::Node& node, std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    if (const YAML::Node found = node[key]) return numbers_of(found);
  }
  return std::nullopt;
}

/// Two of these names of one thing that are both there, with different numbers; empty where no two are.
std::string two_differ(const YAML::Node& node, std::initializer_list<const char*> keys) {
  const char* first = nullptr;
  for (const char* key : keys) {
    const YAML::Node found = node[key];
    if (!found) continue;
    if (first == nullptr) {
      first = key;
      continue;
    }
    if (numbers_of(node[first]) != numbers_of(found)) return fmt::format("{} and {}", first, key);
  }
  return {};
}

constexpr std::initializer_list<const char*> kWidthKeys = {"image_width", "width"},
                                             kHeightKeys = {"image_height", "height"},
                                             kMatrixKeys = {"camera_matrix", "K", "k"},
                                             kDistortionKeys = {"distortion_coefficients", "D", "d"};

Result<CameraModel> ros_camera(const YAML::Node& node) {
  CameraModel camera;
  for (const auto& keys : {kWidthKeys, kHeightKeys, kMatrixKeys, kDistortionKeys}) {
    if (const std::string two = two_differ(node, keys); !two.empty()) {
      return Error{Errc::bad_format,
                   fmt::format("says one thing twice, differently: {}; take out the one that is not meant", two)};
    }
  }
  const YAML::Node width = node["image_width"] ? node["image_width"] : node["width"];
  const YAML::Node height = node["image_height"] ? node["image_height"] : node["height"];
  if (!width || !height)
    return Error{Errc::bad_format, "lacks image_width and image_height; add the size the lens was calibrated at"};
  camera.width_px = whole_of(width);
  camera.height_px = whole_of(height);
  if (!node["distortion_model"]) return lacks_distortion("distortion_model");
  if (const auto sound = refuse_other_models([&node](const char* key) { return words_of(node[key]); }); !sound)
    return sound.error();
  for (const char* binning : {"binning_x", "binning_y"}) {
    if (node[binning] && whole_of(node[binning]) > 1)
      return Error{Errc::unsupported,
                   fmt::format("its {} is over 1: give the lens of the pictures as they are, all lengths of them in "
                               "px divided by it",
                               binning)};
  }
  // Width and K are the whole sensor's; of the pictures they hold only where the region of interest is all of it.
  if (const YAML::Node roi = node["roi"]) {
    const auto of_roi = [&roi](const char* key) { return roi[key] ? whole_of(roi[key]) : 0; };
    const int x = of_roi("x_offset"), y = of_roi("y_offset"), wide = of_roi("width"), high = of_roi("height");
    if (x != 0 || y != 0 || (wide != 0 && wide != camera.width_px) || (high != 0 && high != camera.height_px)) {
      return Error{
          Errc::unsupported,
          fmt::format("its roi is a part of the picture ({}x{} px from {}, {}): give the lens of the pictures as "
                      "they are: the roi's width and height, cx less {} and cy less {}, and no roi",
                      wide, high, x, y, x, y)};
    }
  }
  const auto matrix = numbers_under(node, kMatrixKeys);
  if (const auto sound = set_matrix(matrix.value_or(Numbers()), camera); !sound) return sound.error();
  const auto distortion = numbers_under(node, kDistortionKeys);
  if (!distortion) return lacks_distortion("distortion_coefficients");
  if (const auto sound = set_distortion(*distortion, camera); !sound) return sound.error();
  return camera;
}

Result<CameraModel> kalibr_camera(const YAML::Node& node) {
  const auto model = node["camera_model"].as<std::string>();
  if (model != "pinhole") return unknown_model("camera_model", model);
  if (!node["distortion_model"]) return lacks_distortion("distortion_model");
  const auto distortion = node["distortion_model"].as<std::string>();
  if (distortion != "radtan" && distortion != "none") return unknown_model("distortion_model", distortion);
  if (distortion == "radtan" && !node["distortion_coeffs"]) return lacks_distortion("distortion_coeffs");
  const auto size = node["resolution"].as<std::vector<YAML::Node>>();
  const Numbers f = node["intrinsics"].as<Numbers>();
  const Numbers d = distortion == "none" ? Numbers{} : node["distortion_coeffs"].as<Numbers>();
  if (size.size() != 2 || f.size() != 4 || (distortion == "radtan" && d.size() != 4))
    return Error{Errc::bad_format, "has not 2 numbers of resolution, 4 of intrinsics and 4 of distortion_coeffs"};
  CameraModel camera{whole_of(size[0]), whole_of(size[1]), f[0], f[1], f[2], f[3]};
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

/// A key that stands twice in the map, or in one of the maps right in it. Empty where there is none.
std::string twice_in(const YAML::Node& map, int deeper = 1) {
  if (!map.IsMap()) return {};
  std::set<std::string> keys;
  for (const auto& item : map) {
    auto key = item.first.as<std::string>();
    if (!keys.insert(key).second) return key;
    if (deeper == 0) continue;
    if (std::string twice = twice_in(item.second, deeper - 1); !twice.empty()) return twice;
  }
  return {};
}

/// Makes nothing of what is read.
struct Heedless final : YAML::EventHandler {
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// Whether a text has more documents than anybody means. Of some damaged texts yaml-cpp reads the same piece for ever,
/// as one document after another, and would keep each.
bool has_no_end_of_documents(const std::string& text) {
  constexpr int kMost = 16;
  std::istringstream in(text);
  YAML::Parser parser(in);
  Heedless heedless;
  int documents = 0;
  while (documents <= kMost && parser.HandleNextDocument(heedless)) ++documents;
  return documents > kMost;
}

/// The text as plain YAML; what parse makes of it may throw what yaml-cpp throws.
template <typename Parse>
auto of_yaml(const std::string& text, const Parse& parse) -> decltype(parse(YAML::Node())) {
  const Error several{Errc::bad_format, "holds several documents (---); keep the one that is meant"};
  try {
    if (has_no_end_of_documents(text)) return several;
    std::vector<YAML::Node> documents = YAML::LoadAll(text);
    // ROS prints "---" behind each message, behind which there may be none.
    std::erase_if(documents, [](const YAML::Node& document) { return document.IsNull(); });
    if (documents.size() > 1) return several;
    const YAML::Node root = documents.empty() ? YAML::Node() : documents.front();
    if (const std::string twice = twice_in(root); !twice.empty()) return stands_twice(twice);
    return parse(root);
  } catch (const YAML::Exception& error) {
    return Error{Errc::bad_format, fmt::format("is no camera file of OpenCV, ROS or Kalibr: {}", error.what())};
  }
}

Result<CameraModel> plain_camera(const std::string& text, const std::string& name) {
  return of_yaml(text, [&](const YAML::Node& root) -> Result<CameraModel> {
    if (is_kalibr(root)) {
      const auto node = kalibr_node(root, name);
      if (!node) return node.error();
      return kalibr_camera(*node);
    }
    if (!root.IsMap()) return Error{Errc::bad_format, "is no camera file of OpenCV, ROS or Kalibr"};
    if (!name.empty()) return Error{Errc::bad_value, fmt::format("holds one camera: leave :{} out", name)};
    return ros_camera(root);
  });
}

/// Whether OpenCV wrote it, by its first bytes.
bool is_opencv(const std::string& text) {
  return text.starts_with("%YAML") || text.starts_with("<?xml") || text.starts_with("{");
}

}  // namespace

Result<CameraModel> parse_camera(const std::string& text, const std::string& name) {
  if (!is_opencv(text)) return plain_camera(text, name);
  if (!name.empty()) return Error{Errc::bad_value, fmt::format("holds one camera: leave :{} out", name)};
  return opencv_camera(text);
}

Result<std::array<double, 16>> parse_camera_relation(const std::string& text, const std::string& name) {
  return of_yaml(text, [&](const YAML::Node& root) -> Result<std::array<double, 16>> {
    if (!is_kalibr(root)) return Error{Errc::bad_format, "is no camchain of Kalibr, which would hold T_cn_cnm1"};
    const auto node = kalibr_node(root, name.empty() ? only_related(root) : name);
    if (!node) return node.error();
    if (!(*node)["T_cn_cnm1"])
      return Error{Errc::bad_format, "lacks T_cn_cnm1 of this camera: name the one that has it, as camchain.yaml:cam1"};
    const auto rows = (*node)["T_cn_cnm1"].as<std::vector<Numbers>>();
    std::array<double, 16> out{};
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (rows.size() != 4 || rows[i / 4].size() != 4) return Error{Errc::bad_format, "its T_cn_cnm1 is no 4x4 matrix"};
      out[i] = rows[i / 4][i % 4];
    }
    return out;
  });
}

Result<StoredCovariance> parse_camera_covariance(const std::string& text) {
  StoredCovariance out;
  cv::Mat matrix;
  try {
    const cv::FileStorage file(text, kInMemory);
    if (file["camera_covariance"].empty()) return out;
    matrix = stored_matrix(file["camera_covariance"]);
  } catch (const cv::Exception&) {
    return out;  // ROS's or Kalibr's
  }
  constexpr int kSide = CameraModel::kParameters;
  if (matrix.rows != kSide || matrix.cols != kSide)
    return Error{Errc::bad_format, fmt::format("camera_covariance is {}x{}, of 9x9; take it out to work without",
                                               matrix.rows, matrix.cols)};
  out.count = 1;
  std::copy_n(matrix.ptr<double>(), out.by_rows.size(), out.by_rows.begin());
  return out;
}

}  // namespace birdseye::host
