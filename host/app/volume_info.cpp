#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <span>

#include "drivers/system/program.hpp"
#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/dicom/series_choice.hpp"
#include "host/files/write_files.hpp"
#include "host/volume/image_file.hpp"
#include "host/volume/import.hpp"
#include "host/volume/labels.hpp"
#include "host/volume/mask_folder.hpp"
#include "host/volume/series_list.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

struct InfoOptions {
  VolumeSource source;
  fs::path json;
};

std::string orientation_of(const SeriesInfo& info) {
  Eigen::Affine3d axes = Eigen::Affine3d::Identity();
  axes.linear() = info.axes;
  return info.axes.isZero() ? "" : orientation_letters(axes);
}

/// "2021-05-03" of "20210503"; as it is where it is no such date.
std::string date_of(const SeriesInfo& info) {
  const std::string& d = info.date;
  if (d.size() != 8 || d.find_first_not_of("0123456789") != std::string::npos) return d;
  return fmt::format("{}-{}-{}", d.substr(0, 4), d.substr(4, 2), d.substr(6, 2));
}

/// One line: what is not known is "-".
std::string line_of(const SeriesInfo& info) {
  std::string name = info.description;
  if (!info.part.empty()) name += fmt::format("{}{}", name.empty() ? "" : ", ", info.part);
  std::string size = "-", contrast = info.agent;
  if (info.size[2] > 0) {
    size = fmt::format("{} slice{} of {} x {}", info.size[2], info.size[2] == 1 ? "" : "s", info.size[0], info.size[1]);
  }
  if (!info.spacing_mm.isZero()) {
    const Eigen::Vector3d& mm = info.spacing_mm;
    size += fmt::format(", {:.3g} x {:.3g} x {:.3g} mm", mm.x(), mm.y(), mm.z());
  }
  if (!info.phase.empty()) contrast += fmt::format("{}{}", contrast.empty() ? "" : ", ", info.phase);
  const auto known = [](const std::string& text) { return text.empty() ? std::string("-") : text; };
  std::string line =
      fmt::format("series {:<5} {:<28}  {:<2}  {:<10}  {}  {}  {}", info.id, known(name), known(info.modality),
                  known(date_of(info)), size, known(orientation_of(info)), known(contrast));
  if (!info.problem.empty()) line += fmt::format("  no volume: {}", info.problem);
  return line;
}

nlohmann::json json_of(const SeriesInfo& info) {
  nlohmann::json json{{"id", info.id}, {"uid", info.uid}, {"readable", info.problem.empty()}};
  const auto put = [&json](const char* key, const std::string& text) {
    if (!text.empty()) json[key] = text;
  };
  put("description", info.description);
  put("part", info.part);
  put("modality", info.modality);
  put("date", date_of(info));
  put("time", info.time);
  put("contrast_agent", info.agent);
  put("phase", info.phase);
  put("transfer_syntax", info.syntax);
  put("orientation", orientation_of(info));
  put("problem", info.problem);
  if (info.size[2] > 0) {
    json["size"] = info.size;
  }
  if (!info.spacing_mm.isZero()) json["spacing_mm"] = {info.spacing_mm.x(), info.spacing_mm.y(), info.spacing_mm.z()};
  return json;
}

/// Whether values are labels: few, and none below 0, where a CT has the air about the patient.
bool look_like_labels(const std::vector<std::int16_t>& values) {
  constexpr std::size_t kMostLabels = 256;
  return values.size() <= kMostLabels && (values.empty() || values.front() > 0);
}

void print_values(const Volume& volume, bool labels, nlohmann::json& json) {
  if (labels) {
    const auto values = values_in(volume);
    constexpr std::size_t kShown = 30;
    fmt::print("labels       {}{} (no Hounsfield units: give this as --labels)\n",
               fmt::join(std::span(values).first(std::min(values.size(), kShown)), ", "),
               values.size() > kShown ? fmt::format(" and {} more", values.size() - kShown)
                                      : std::string(values.empty() ? "none" : ""));
    json["label_values"] = values;
    return;
  }
  const auto [low, high] = std::minmax_element(volume.hu.begin(), volume.hu.end());
  const double mean = std::accumulate(volume.hu.begin(), volume.hu.end(), 0.0) / static_cast<double>(volume.hu.size());
  fmt::print("HU           {} to {}, mean {:.1f}\n", *low, *high, mean);
  json["hu_min"] = *low;
  json["hu_max"] = *high;
  json["hu_mean"] = mean;
}

void print_grid(const Volume& volume, nlohmann::json& json) {
  const auto& size = volume.size;
  const Eigen::Vector3d& spacing = volume.spacing_mm;
  const Eigen::Matrix4d m = volume.patient_from_voxel.matrix();
  const std::string letters = orientation_letters(volume.patient_from_voxel);
  fmt::print("size         {} x {} x {} voxels\n", size[0], size[1], size[2]);
  fmt::print("spacing      {:.4f} x {:.4f} x {:.4f} mm\n", spacing.x(), spacing.y(), spacing.z());
  fmt::print("extent       {:.1f} x {:.1f} x {:.1f} mm\n", size[0] * spacing.x(), size[1] * spacing.y(),
             size[2] * spacing.z());
  fmt::print("orientation  {} (voxel axes point to the patient's)\n", letters);
  fmt::print("first voxel  ({:.3f}, {:.3f}, {:.3f}) mm, patient LPS\n", m(0, 3), m(1, 3), m(2, 3));
  json["size"] = {size[0], size[1], size[2]};
  json["spacing_mm"] = {spacing.x(), spacing.y(), spacing.z()};
  for (int i = 0; i < 4; ++i) json["patient_from_voxel"].push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
  json["orientation"] = letters;
}

void print_series(const SeriesList& list, nlohmann::json& json) {
  json["series"] = nlohmann::json::array();
  for (const SeriesInfo& info : list.series) {
    print_line(line_of(info));
    json["series"].push_back(json_of(info));
  }
  for (const std::string& unreadable : list.unreadable) print_line(fmt::format("passed over  {}", unreadable));
  if (!list.unreadable.empty()) json["unreadable"] = list.unreadable;
}

void print_labels(const std::vector<NamedLabel>& labels, nlohmann::json& json) {
  for (const NamedLabel& label : labels) {
    print_line(fmt::format("label        {:<4} {}", label.number, label.name.empty() ? "-" : label.name));
    json["labels"].push_back({{"number", label.number}, {"name", label.name}});
  }
}

/// Of a segmentation, which is no CT: on what grid it is, and what it shows.
Result<void> segmentation_info(const InfoOptions& options, nlohmann::json& json) {
  const auto image = read_labels_file(options.source.path);
  if (!image) return image.error();
  fmt::print("segmentation of {} x {} x {} voxels, {:.4f} x {:.4f} x {:.4f} mm\n", image->size[0], image->size[1],
             image->size[2], image->spacing_mm.x(), image->spacing_mm.y(), image->spacing_mm.z());
  print_labels(image->label_names, json);
  return write_file(options.json, text_of(json));
}

/// Whether to look at one of the series: not where none of several is named. An error where the one that is named is
/// not there.
Result<bool> look_at_one(const SeriesList& list, const VolumeSource& source) {
  const auto chosen = choose_series(list.series, source.series);
  if (chosen) return true;
  if (!source.series.empty() || chosen.error().code != Errc::unsupported)
    return chosen.error().with_context(source.path.string());
  fmt::print("name one with --series to look at it\n");
  return false;
}

Result<void> volume_info(const InfoOptions& options) {
  nlohmann::json json;
  if (holds_dicom(options.source.path)) {
    const auto list = list_series(options.source);
    if (!list && list.error().code == Errc::not_found && is_mask_folder(options.source.path)) {
      fmt::print("segmentation of one mask a file\n");
      print_labels(mask_names(options.source.path), json);
      return write_file(options.json, text_of(json));
    }
    if (!list) return list.error();
    const SeriesInfo& first = list->series.front();
    // Of a single series that is no volume the error says all.
    if (list->series.size() > 1 || first.problem.empty()) print_series(*list, json);
    if (list->series.size() == 1 && first.modality == "SEG") return segmentation_info(options, json);
    const auto look = look_at_one(*list, options.source);
    if (!look) return look.error();
    if (!*look) return write_file(options.json, text_of(json));
  }
  auto imported = import_with_notes(options.source);
  if (!imported) return imported.error();
  const auto& hu = imported->volume.hu;
  if (std::adjacent_find(hu.begin(), hu.end(), std::not_equal_to<>()) == hu.end())
    imported->notes.push_back(
        fmt::format("all voxels are {}: there is nothing in it to draw or to register", hu.front()));
  print_grid(imported->volume, json);
  const bool labels = !imported->label_names.empty() ||
                      (!holds_dicom(options.source.path) && look_like_labels(values_in(imported->volume)));
  print_values(imported->volume, labels, json);
  print_labels(imported->label_names, json);
  if (!imported->notes.empty()) json["notes"] = imported->notes;
  for (const std::string& note : imported->notes) print_line(fmt::format("note         {}", note));
  return write_file(options.json, text_of(json));
}

}  // namespace

void add_volume_info(CLI::App& volume, CommandStatus& status) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App& info = *volume.add_subcommand("info", "the series of a folder; size, geometry and values of a CT");
  info.add_option("path", options->source.path, "DICOM folder or file, NIfTI, NRRD, MHA or MHD")->required();
  add_ct_options(info, options->source);
  info.add_option("--json", options->json, "write the figures to this file");
  info.callback([options, &status] { status.take(volume_info(*options)); });
}

}  // namespace birdseye::host
