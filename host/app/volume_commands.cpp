#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>

#include "host/app/commands.hpp"
#include "host/files/write_files.hpp"
#include "host/volume/import.hpp"
#include "host/volume/segmentation.hpp"

namespace birdseye::host {

namespace {

Result<void> volume_info(const std::filesystem::path& path, const std::filesystem::path& json_path) {
  const auto volume = import_volume(path);
  if (!volume) return volume.error();
  const auto [low, high] = std::minmax_element(volume->hu.begin(), volume->hu.end());
  const double mean =
      std::accumulate(volume->hu.begin(), volume->hu.end(), 0.0) / static_cast<double>(volume->hu.size());
  const auto& size = volume->size;
  const Eigen::Vector3d& spacing = volume->spacing_mm;
  const Eigen::Matrix4d m = volume->patient_from_voxel.matrix();
  const std::string letters = orientation_letters(volume->patient_from_voxel);
  fmt::print("size         {} x {} x {} voxels\n", size[0], size[1], size[2]);
  fmt::print("spacing      {:.4f} x {:.4f} x {:.4f} mm\n", spacing.x(), spacing.y(), spacing.z());
  fmt::print("extent       {:.1f} x {:.1f} x {:.1f} mm\n", size[0] * spacing.x(), size[1] * spacing.y(),
             size[2] * spacing.z());
  fmt::print("orientation  {} (voxel axes point to the patient's)\n", letters);
  fmt::print("first voxel  ({:.3f}, {:.3f}, {:.3f}) mm, patient LPS\n", m(0, 3), m(1, 3), m(2, 3));
  fmt::print("HU           {} to {}, mean {:.1f}\n", *low, *high, mean);
  nlohmann::json json;
  json["size"] = {size[0], size[1], size[2]};
  json["spacing_mm"] = {spacing.x(), spacing.y(), spacing.z()};
  for (int i = 0; i < 4; ++i) json["patient_from_voxel"].push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
  json["orientation"] = letters;
  json["hu_min"] = *low;
  json["hu_max"] = *high;
  json["hu_mean"] = mean;
  return write_file(json_path, text_of(json));
}

struct SegmentOptions {
  std::filesystem::path path, out;
  std::vector<int> range;
  std::vector<double> seed;
  bool largest = false;
};

Result<void> volume_segment(const SegmentOptions& options) {
  const auto ct = import_volume(options.path);
  if (!ct) return ct.error();
  SegmentationSettings settings;
  settings.low_hu = options.range[0];
  settings.high_hu = options.range[1];
  settings.largest = options.largest;
  if (!options.seed.empty())
    settings.seed_in_patient_mm = Eigen::Vector3d(options.seed[0], options.seed[1], options.seed[2]);
  const auto labels = segment(*ct, settings);
  if (!labels) return labels.error().with_context(options.path.string());
  if (auto written = write_labels(options.out, *labels); !written) return written;
  const auto voxels = std::count(labels->hu.begin(), labels->hu.end(), std::int16_t{1});
  fmt::print("{}: {} voxels, {:.1f} ml\n", options.out.string(), voxels,
             static_cast<double>(voxels) * ct->spacing_mm.prod() / 1000);
  return {};
}

}  // namespace

void add_volume(CLI::App& app, CommandStatus& status) {
  struct Options {
    std::filesystem::path path, json;
  };
  const auto options = std::make_shared<Options>();
  CLI::App& volume = *app.add_subcommand("volume", "look at volumes");
  volume.require_subcommand(1);
  CLI::App& info = *volume.add_subcommand("info", "size, geometry and values of a CT");
  info.add_option("path", options->path, "DICOM folder or file, NIfTI, NRRD, MHA or MHD")->required();
  info.add_option("--json", options->json, "write the figures to this file");
  info.callback([options, &status] { status.take(volume_info(options->path, options->json)); });

  const auto chosen = std::make_shared<SegmentOptions>();
  CLI::App& segment = *volume.add_subcommand("segment", "an organ by its HU, as a label volume");
  segment.add_option("path", chosen->path, "the CT")->required();
  segment.add_option("--hu", chosen->range, "LOW,HIGH: the organ's values")->required()->expected(2)->delimiter(',');
  segment.add_option("--seed", chosen->seed, "X,Y,Z: only what is connected to this point, patient LPS mm")
      ->expected(3)
      ->delimiter(',');
  segment.add_flag("--largest", chosen->largest, "only the largest connected part");
  segment.add_option("--out", chosen->out, "labels to write: .nii.gz, .nrrd or .mha")->required();
  segment.callback([chosen, &status] { status.take(volume_segment(*chosen)); });
  add_volume_from_surface(volume, status);
  add_volume_markers(volume, status);
}

}  // namespace birdseye::host
