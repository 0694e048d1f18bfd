#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/volume/import.hpp"
#include "host/volume/segmentation.hpp"

namespace birdseye::host {

namespace {

struct SegmentOptions {
  VolumeSource source;
  std::filesystem::path out;
  std::vector<int> range;
  std::vector<double> seed;
  bool largest = false;
};

Result<void> volume_segment(const SegmentOptions& options) {
  const auto imported = import_with_notes(options.source);
  if (!imported) return imported.error();
  print_notes(imported->notes);
  const Volume* const ct = &imported->volume;
  SegmentationSettings settings;
  settings.low_hu = options.range[0];
  settings.high_hu = options.range[1];
  settings.largest = options.largest;
  if (!options.seed.empty())
    settings.seed_in_patient_mm = Eigen::Vector3d(options.seed[0], options.seed[1], options.seed[2]);
  const auto labels = segment(*ct, settings);
  if (!labels) return labels.error().with_context(options.source.path.string());
  if (auto written = write_labels(options.out, *labels); !written) return written;
  const auto voxels = std::count(labels->hu.begin(), labels->hu.end(), std::int16_t{1});
  fmt::print("{}: {} voxels, {:.1f} ml\n", options.out.string(), voxels,
             static_cast<double>(voxels) * ct->spacing_mm.prod() / 1000);
  return {};
}

}  // namespace

void add_volume(CLI::App& app, CommandStatus& status) {
  CLI::App& volume = *app.add_subcommand("volume", "look at volumes");
  volume.require_subcommand(1);
  add_volume_info(volume, status);
  const auto chosen = std::make_shared<SegmentOptions>();
  CLI::App& segment = *volume.add_subcommand("segment", "an organ by its HU, as a label volume");
  segment.add_option("path", chosen->source.path, "the CT")->required();
  add_ct_options(segment, chosen->source);
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
