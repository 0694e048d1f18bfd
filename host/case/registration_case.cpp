#include "host/case/registration_case.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <toml.hpp>

#include "calibration/base/nesting.hpp"
#include "calibration/base/parser_words.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/case/named_landmarks.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/read_mat.hpp"
#include "host/files/text_files.hpp"
#include "host/registration/similarity/overlap_mask.hpp"
#include "host/registration/similarity/similarity.hpp"
#include "host/volume/import.hpp"
#include "host/volume/label_names.hpp"
#include "host/volume/labels.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// A table of the case, with its name and file for messages.
class CaseTable {
 public:
  CaseTable(const fs::path& file, std::string name, const toml::value& table)
      : file_(file), name_(std::move(name)), table_(table) {}
  [[nodiscard]] bool has(const char* key) const { return table_.is_table() && table_.contains(key); }
  template <typename T>
  [[nodiscard]] Result<T> get(const char* key) const {
    if (!has(key)) return wrong(key, "is missing");
    try {
      if constexpr (std::is_same_v<T, double>) {
        if (table_.at(key).is_integer()) return static_cast<double>(table_.at(key).as_integer());
      }
      if constexpr (std::is_same_v<T, std::vector<double>>) {
        T numbers;
        for (const toml::value& number : table_.at(key).as_array())
          numbers.push_back(number.is_integer() ? static_cast<double>(number.as_integer()) : number.as_floating());
        return numbers;
      } else {
        return toml::find<T>(table_, key);
      }
    } catch (const std::exception&) {
      return wrong(key, "is of another type");
    }
  }
  template <typename T>
  [[nodiscard]] Result<T> get(const char* key, const T& otherwise) const {
    if (!has(key)) return otherwise;
    return get<T>(key);
  }
  /// A path of the case, relative to its file.
  [[nodiscard]] Result<fs::path> path(const char* key) const {
    const auto text = get<std::string>(key);
    if (!text) return text.error();
    const fs::path path = file_.parent_path() / *text;
    std::error_code error;
    if (text->empty() || !fs::exists(path, error)) return wrong(key, fmt::format("{} does not exist", path.string()));
    return path;
  }
  [[nodiscard]] Error wrong(const char* key, const std::string& why) const {
    return Error{Errc::bad_value, fmt::format("{}: [{}] {}: {}", file_.string(), name_, key, why)};
  }
  [[nodiscard]] const toml::value& value() const { return table_; }

 private:
  const fs::path& file_;
  std::string name_;
  const toml::value& table_;
};

/// A key that is not known is a slip of the pen, and would be taken for its default. table: its name, "" for the
/// file's.
Result<void> only_known_keys(const fs::path& file, const std::string& table, const toml::value& content) {
  static const std::map<std::string, std::vector<std::string>> kKnown = {
      {"", {"volume", "model", "view", "target", "landmark", "points", "truth"}},
      {"volume", {"path", "series", "untilt", "spacing", "orientation", "label", "label_values", "transfer"}},
      {"model",
       {"control_points", "level", "optimiser", "initial", "refine_pose", "pose_prior", "unknowns", "similarity",
        "most_evaluations"}},
      {"view", {"image", "camera", "camera_from_patient", "mask"}},
      {"target", {"place_mm"}},
      {"landmark", {"name", "place_mm", "sigma_mm", "seen"}},
      {"landmark.seen", {"view", "pixel", "sigma_px"}},
      {"points", {"path"}},
      {"truth", {"landmarks", "control_points", "pose"}}};
  const auto known = kKnown.find(table);
  if (known == kKnown.end()) return {};
  if (content.is_array()) {
    for (const toml::value& one : content.as_array()) {
      if (auto good = only_known_keys(file, table, one); !good) return good;
    }
  }
  if (!content.is_table()) return {};
  for (const auto& [key, value] : content.as_table()) {
    if (std::find(known->second.begin(), known->second.end(), key) == known->second.end()) {
      return Error{Errc::bad_value,
                   fmt::format("{}: {} is not known; there are {}", file.string(),
                               table.empty() ? fmt::format("[{}]", key) : fmt::format("[{}] {}:", table, key),
                               fmt::join(known->second, ", "))};
    }
    if (auto good = only_known_keys(file, table.empty() ? key : fmt::format("{}.{}", table, key), value); !good)
      return good;
  }
  return {};
}

/// Numbers, or names.
Result<std::vector<LabelChoice>> read_labels_wanted(const CaseTable& table) {
  const auto numbers = table.get<std::vector<int>>("label_values");
  if (numbers) return std::vector<LabelChoice>(numbers->begin(), numbers->end());
  const auto names = table.get<std::vector<std::string>>("label_values");
  if (names) return std::vector<LabelChoice>(names->begin(), names->end());
  return numbers.error();
}

Result<void> read_volume(const CaseTable& table, RegistrationCase& out) {
  const auto path = table.path("path");
  if (!path) return path.error();
  VolumeSource source(*path);
  const auto series = table.get<std::string>("series", "");
  if (!series) return series.error();
  source.series = *series;
  const auto untilt = table.get<bool>("untilt", false);
  if (!untilt) return untilt.error();
  source.untilt = *untilt;
  source.stated.in_case = true;
  if (table.has("spacing")) {
    const auto spacing = table.get<std::vector<double>>("spacing");
    if (!spacing) return spacing.error();
    if (spacing->size() != 3) return table.wrong("spacing", "is three numbers, mm");
    source.stated.spacing_mm = Eigen::Vector3d::Map(spacing->data());
  }
  const auto orientation = table.get<std::string>("orientation", "");
  if (!orientation) return orientation.error();
  source.stated.orientation = *orientation;
  if (!source.stated.orientation.empty() && !axes_of_letters(source.stated.orientation)) {
    return table.wrong("orientation",
                       "is one of R and L, one of A and P and one of I and S, in the order of i, j, k, as \"LPS\"");
  }
  auto ct = import_body(source);
  if (!ct) return ct.error();
  out.ct = std::move(ct->volume);
  out.notes = std::move(ct->notes);
  const auto transfer = table.get<std::string>("transfer", "liver");
  if (!transfer) return transfer.error();
  out.transfer = *transfer;
  if (!table.has("label")) return {};
  const auto label = table.path("label");
  if (!label) return label.error();
  const auto wanted = read_labels_wanted(table);
  if (!wanted) return wanted.error();
  auto labels = import_named_labels(*label, out.ct, *wanted);
  if (!labels) return labels.error();
  out.notes.insert(out.notes.end(), labels->notes.begin(), labels->notes.end());
  const auto values = values_of_labels(labels->names, *wanted, &out.notes);
  if (!values) return values.error().with_context(label->string());
  out.labels = std::move(labels->volume);
  out.label_values = *values;
  if (values->empty()) return table.wrong("label_values", "is empty; name the labels to keep");
  return {};
}

/// What only the optimisers that go by the value alone have a choice of.
Result<void> read_direct_search(const CaseTable& table, RegistrationCase& out) {
  const bool direct = out.optimiser == "simplex" || out.optimiser == "powell";
  for (const char* key : {"unknowns", "similarity", "most_evaluations"}) {
    if (table.has(key) && !direct) return table.wrong(key, "needs optimiser = \"simplex\" or \"powell\"");
  }
  const auto unknowns = table.get<std::string>("unknowns", "control_points");
  if (!unknowns) return unknowns.error();
  if (*unknowns != "control_points" && *unknowns != "vertices")
    return table.wrong("unknowns", "is control_points or vertices");
  out.vertices = *unknowns == "vertices";
  constexpr int kDeepest = 3;  // 1029 unknowns
  if (out.vertices && out.level > kDeepest)
    return table.wrong("level", fmt::format("is 1 to {} where unknowns = \"vertices\"", kDeepest));
  if (direct && !out.vertices && !out.control_points) {
    return table.wrong("control_points", fmt::format("give three whole numbers: \"auto\" needs optimiser = "
                                                     "\"gradient\", not \"{}\"",
                                                     out.optimiser));
  }
  const auto similarity = table.get<std::string>("similarity", out.similarity);
  if (!similarity) return similarity.error();
  out.similarity = *similarity;
  const auto& names = similarity_names();
  if (std::find(names.begin(), names.end(), out.similarity) == names.end())
    return table.wrong("similarity", fmt::format("is none of {}", fmt::join(names, ", ")));
  const auto most = table.get<int>("most_evaluations", out.most_evaluations);
  if (!most) return most.error();
  if (*most < 1) return table.wrong("most_evaluations", "is 1 or more");
  out.most_evaluations = *most;
  return {};
}

Result<void> read_model(const CaseTable& table, RegistrationCase& out) {
  const auto& model = table.value();
  if (table.has("control_points") && model.at("control_points").is_string()) {
    if (model.at("control_points").as_string().str != "auto")
      return table.wrong("control_points", "is three whole numbers or \"auto\"");
  } else if (table.has("control_points")) {
    const auto points = table.get<std::vector<int>>("control_points");
    if (!points) return points.error();
    constexpr int kMost = 15;
    if (points->size() != 3 || *std::min_element(points->begin(), points->end()) < 1 ||
        *std::max_element(points->begin(), points->end()) > kMost) {
      return table.wrong("control_points", fmt::format("is three whole numbers of 1 to {}, or \"auto\"", kMost));
    }
    out.control_points = {(*points)[0], (*points)[1], (*points)[2]};
  }
  const auto level = table.get<int>("level", out.level);
  if (!level) return level.error();
  if (*level < 1 || *level > PatchOctree::kDeepest) return table.wrong("level", "is 1 to 5");
  out.level = *level;
  const auto optimiser = table.get<std::string>("optimiser", out.optimiser);
  if (!optimiser) return optimiser.error();
  if (*optimiser != "geometry" && *optimiser != "gradient" && *optimiser != "simplex" && *optimiser != "powell")
    return table.wrong("optimiser", "is geometry, gradient, simplex or powell");
  out.optimiser = *optimiser;
  if (auto done = read_direct_search(table, out); !done) return done.error();
  const auto refine_pose = table.get<bool>("refine_pose", out.refine_pose);
  if (!refine_pose) return refine_pose.error();
  if (*refine_pose && out.optimiser != "gradient") return table.wrong("refine_pose", "needs optimiser = \"gradient\"");
  out.refine_pose = *refine_pose;
  if (table.has("pose_prior")) {
    const auto prior = table.get<double>("pose_prior");
    if (!prior) return prior.error();
    constexpr double kMost = 100;
    if (!(*prior >= 0 && *prior <= kMost)) return table.wrong("pose_prior", "is 0 to 100, as 0.01");
    out.pose_prior = *prior;
  }
  if (!table.has("initial")) return {};
  if (out.optimiser == "geometry")
    return table.wrong("initial", "needs optimiser = \"gradient\", \"simplex\" or \"powell\"; geometry begins at rest");
  const auto initial = table.path("initial");
  if (!initial) return initial.error();
  auto field = read_field(*initial);
  if (!field) return field.error();
  out.initial = *std::move(field);
  return {};
}

Result<void> read_view(const CaseTable& table, const fs::path& folder, RegistrationCase& out) {
  VideoView view;
  const auto image = table.path("image");
  if (!image) return image.error();
  view.name = fs::relative(*image, folder.empty() ? "." : folder).string();
  const auto read = read_bgr_mat(*image);
  if (!read)
    return table.wrong("image",
                       fmt::format("{} is no picture that can be read: {}", image->string(), read.error().what));
  const cv::Mat& bgr = *read;
  const auto camera = table.get<std::string>("camera");  // which may name one of several behind a colon
  if (!camera) return camera.error();
  const auto model = read_camera(folder / *camera);
  if (!model) return table.wrong("camera", model.error().what);
  view.camera = *model;
  const auto covariance = read_camera_covariance(folder / *camera);
  if (!covariance) return table.wrong("camera", covariance.error().what);
  if (bgr.cols != model->width_px || bgr.rows != model->height_px) {
    return table.wrong("camera", fmt::format("is for pictures of {}x{} and {} is of {}x{}; calibrate at this size",
                                             model->width_px, model->height_px, image->string(), bgr.cols, bgr.rows));
  }
  const auto pose = table.path("camera_from_patient");
  if (!pose) return pose.error();
  const auto matrix = read_pose(*pose);
  if (!matrix) return matrix.error();
  view.camera_from_patient = Transform<Camera, Patient>::from_matrix(*matrix);
  cv::Mat rgb, grey;
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  view.grey.assign(grey.begin<std::uint8_t>(), grey.end<std::uint8_t>());
  std::vector<std::uint8_t> left_out(view.grey.size(), 0);
  if (table.has("mask")) {
    const auto mask_path = table.path("mask");
    if (!mask_path) return mask_path.error();
    const auto read_mask = read_grey_mat(*mask_path);
    if (!read_mask || read_mask->size() != grey.size())
      return table.wrong("mask", mask_path->string() + " is no picture of the image's size");
    const cv::Mat& mask = *read_mask;
    constexpr int kCounts = 128;
    std::transform(mask.begin<std::uint8_t>(), mask.end<std::uint8_t>(), left_out.begin(),
                   [](std::uint8_t m) { return static_cast<std::uint8_t>(m < kCounts ? 1 : 0); });
  }
  Picture picture{bgr.cols, bgr.rows, {}};
  picture.rgb.assign(rgb.datastart, rgb.dataend);
  auto overlap = overlap_mask(picture.view(), left_out);
  if (!overlap) return overlap.error().with_context(image->string());
  view.mask = *std::move(overlap);
  constexpr double kLeast_percent = 1;
  const auto counts = view.mask.size() - static_cast<std::size_t>(std::count(view.mask.begin(), view.mask.end(), 0));
  if (100.0 * static_cast<double>(counts) < kLeast_percent * static_cast<double>(view.mask.size())) {
    return table.wrong(
        "image", fmt::format("only {} of {}'s pixels count, under {} %: too much is masked, black or glare", counts,
                             view.name, kLeast_percent));
  }
  for (const VideoView& other : out.views) {
    if (other.grey == view.grey)
      return table.wrong("image", fmt::format("is the same picture as {}; name each view once", other.name));
  }
  if (!*covariance) {
    std::string note = fmt::format("{} does not tell how well its lens is known: what is to be expected leaves it out",
                                   (folder / *camera).string());
    if (std::ranges::find(out.notes, note) == out.notes.end()) out.notes.push_back(std::move(note));
  }
  out.camera_covariances.push_back(*covariance);
  out.pictures.push_back(std::move(picture));
  out.views.push_back(std::move(view));
  return {};
}

/// So many numbers, whole or not.
Result<Eigen::VectorXd> read_numbers(const CaseTable& table, const char* key, Eigen::Index count, const char* what) {
  const auto numbers = table.get<toml::array>(key);
  if (!numbers) return numbers.error();
  std::vector<double> out;
  for (const toml::value& one : *numbers) {
    if (!one.is_integer() && !one.is_floating()) return table.wrong(key, what);
    out.push_back(one.is_integer() ? static_cast<double>(one.as_integer()) : one.as_floating());
  }
  const Eigen::Map<const Eigen::VectorXd> all(out.data(), static_cast<Eigen::Index>(out.size()));
  if (all.size() != count || !all.allFinite()) return table.wrong(key, what);
  return Eigen::VectorXd(all);
}

/// Where a view shows a landmark.
Result<LandmarkEntry::Seen> read_seen(const CaseTable& table) {
  const auto view = table.get<std::string>("view");
  if (!view) return view.error();
  const auto pixel = read_numbers(table, "pixel", 2, "is two numbers, x and y in pixels");
  if (!pixel) return pixel.error();
  const auto sigma_px = table.get<double>("sigma_px", 1.0);
  if (!sigma_px) return sigma_px.error();
  return LandmarkEntry::Seen{*view, *pixel, *sigma_px};
}

/// A place of the organ that a person finds in the CT and in views.
Result<NamedMatch> read_named(const CaseTable& table, const fs::path& file, const RegistrationCase& c) {
  const auto name = table.get<std::string>("name");
  if (!name) return name.error();
  const auto place = read_numbers(table, "place_mm", 3, "is three numbers, mm in the patient's frame");
  if (!place) return place.error();
  const auto sigma_mm = table.get<double>("sigma_mm", 1.0);
  if (!sigma_mm) return sigma_mm.error();
  if (!table.has("seen") || !table.value().at("seen").is_array())
    return table.wrong("seen", "is missing; name one [[landmark.seen]] or more");
  LandmarkEntry entry{*name, *place, *sigma_mm, {}};
  for (const toml::value& one : table.value().at("seen").as_array()) {
    const auto seen = read_seen(CaseTable(file, fmt::format("landmark.seen {}", entry.seen.size()), one));
    if (!seen) return Error{seen.error().code, seen.error().what + fmt::format(" (of landmark {})", *name)};
    entry.seen.push_back(*seen);
  }
  auto match = match_of(entry, c.ct, c.views, c.matched);
  if (!match) return table.wrong("name", fmt::format("{}: {}", *name, match.error().what));
  return match;
}

/// What else than pictures tells of the organ, and what persons found in them.
Result<void> read_further(const fs::path& file, const toml::value& all, RegistrationCase& out) {
  const bool named = all.contains("landmark"), points = all.contains("points");
  if ((named || points) && out.optimiser != "geometry") {
    return Error{Errc::bad_value, fmt::format("{}: [{}] needs optimiser = \"geometry\", not \"{}\"", file.string(),
                                              named ? "landmark" : "points", out.optimiser)};
  }
  if (named) {
    constexpr std::size_t kMost = 100;
    if (!all.at("landmark").is_array() || all.at("landmark").as_array().size() > kMost)
      return Error{Errc::bad_value, fmt::format("{}: write [[landmark]], {} at most", file.string(), kMost)};
    for (const toml::value& one : all.at("landmark").as_array()) {
      const CaseTable table(file, fmt::format("landmark {}", out.matched.size()), one);
      auto landmark = read_named(table, file, out);
      if (!landmark) return landmark.error();
      out.matched.push_back(*std::move(landmark));
    }
  }
  if (!points) return {};
  const auto path = CaseTable(file, "points", all.at("points")).path("path");
  if (!path) return path.error();
  auto rows = read_point_rows(*path);
  if (!rows) return rows.error();
  out.surface_points = std::move(rows->surface);
  std::move(rows->matched.begin(), rows->matched.end(), std::back_inserter(out.matched));
  return {};
}

}  // namespace

Result<RegistrationCase> read_case(const fs::path& path) {
  const auto whole = read_whole_file(path, kMostTextBytes);
  if (!whole) {
    return Error{whole.error().code,
                 whole.error().what + " (name the case's TOML file, as birdseye-sim case writes it)"};
  }
  std::stringstream text(*whole);
  if (nests_too_deeply(*whole, Notation::toml)) {
    return Error{Errc::bad_format,
                 fmt::format("{}: nests lists, tables or keys deeper than any case; write it anew", path.string())};
  }
  toml::value all;
  try {
    all = toml::parse(text, path.string());
  } catch (const std::exception& problem) {
    return Error{Errc::bad_format, fmt::format("{}: is no case: {}", path.string(), parser_words(problem.what()))};
  }
  if (auto known = only_known_keys(path, "", all); !known) return known.error();
  RegistrationCase out;
  const toml::value none = toml::table{};
  const auto table = [&](const char* name) { return CaseTable(path, name, all.contains(name) ? all.at(name) : none); };
  if (auto done = read_volume(table("volume"), out); !done) return done.error();
  if (auto done = read_model(table("model"), out); !done) return done.error();
  if (!all.contains("view") || !all.at("view").is_array() || all.at("view").as_array().empty())
    return Error{Errc::bad_value, fmt::format("{}: has no [[view]]; name one or more", path.string())};
  int number = 0;
  for (const toml::value& view : all.at("view").as_array()) {
    const CaseTable one(path, fmt::format("view {}", number++), view);
    if (auto done = read_view(one, path.parent_path(), out); !done) return done.error();
  }
  if (const CaseTable target = table("target"); target.has("place_mm")) {
    const auto place = read_numbers(target, "place_mm", 3, "is three numbers, mm in the patient's frame");
    if (!place) return place.error();
    if (!lies_in(out.ct, *place))
      return target.wrong("place_mm", "lies outside the CT; give mm in the patient's frame, LPS");
    out.target_mm = *place;
  }
  if (auto done = read_further(path, all, out); !done) return done.error();
  const CaseTable truth = table("truth");
  if (truth.has("landmarks")) {
    const auto landmarks_path = truth.path("landmarks");
    if (!landmarks_path) return landmarks_path.error();
    auto landmarks = read_landmarks(*landmarks_path);
    if (!landmarks) return landmarks.error();
    out.landmarks = *std::move(landmarks);
  }
  if (truth.has("control_points")) {
    const auto points_path = truth.path("control_points");
    if (!points_path) return points_path.error();
    auto deformation = read_true_deformation(*points_path);
    if (!deformation) return deformation.error();
    out.truth = *std::move(deformation);
  }
  if (truth.has("pose")) {
    const auto pose_path = truth.path("pose");
    if (!pose_path) return pose_path.error();
    const auto pose = read_pose(*pose_path);
    if (!pose) return pose.error();
    out.true_pose = Transform<Patient, Patient>::from_matrix(*pose);
  }
  return out;
}

}  // namespace birdseye::host
