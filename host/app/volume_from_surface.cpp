#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "host/app/commands.hpp"
#include "host/registration/rigid/surface_slab.hpp"
#include "host/volume/image_file.hpp"

namespace birdseye::host {

namespace {

struct VolumeFromSurfaceOptions {
  std::filesystem::path surface, out;
  SlabSettings slab;
  std::vector<double> seen_from{0, 0, 0};
};

Result<void> volume_from_surface(const VolumeFromSurfaceOptions& options) {
  const auto surface = read_surface(options.surface);
  if (!surface) return surface.error();
  SlabSettings settings = options.slab;
  settings.seen_from_mm = {options.seen_from[0], options.seen_from[1], options.seen_from[2]};
  const auto volume = slab_behind(*surface, settings);
  if (!volume) return volume.error().with_context(options.surface.string());
  ImageFile image;
  image.size = volume->size;
  image.spacing_mm = volume->spacing_mm;
  image.origin_mm = volume->patient_from_voxel.translation();
  image.axes.setIdentity();
  image.hu = volume->hu;
  if (auto written = write_image(options.out, image, StoredAs::int16); !written) return written;
  fmt::print("{}: {} x {} x {} voxels of {:g} mm\n", options.out.string(), volume->size[0], volume->size[1],
             volume->size[2], settings.spacing_mm);
  return {};
}

}  // namespace

void add_volume_from_surface(CLI::App& volume, CommandStatus& status) {
  const auto options = std::make_shared<VolumeFromSurfaceOptions>();
  CLI::App& command = *volume.add_subcommand("from-surface", "a slab of tissue behind a surface, where there is no CT");
  command.add_option("surface", options->surface, "STL, PLY, OBJ or VTK, patient LPS mm; open or closed")->required();
  command.add_option("--spacing-mm", options->slab.spacing_mm, "of the voxels (default: 0.5)");
  command.add_option("--depth-mm", options->slab.depth_mm, "of tissue behind the surface (default: 8)");
  command
      .add_option("--seen-from", options->seen_from,
                  "X,Y,Z: behind is away from this point, patient LPS mm (default: 0,0,0)")
      ->expected(3)
      ->delimiter(',');
  command.add_option("--out", options->out, "volume to write: .nii.gz, .nrrd or .mha")->required();
  command.callback([options, &status] { status.take(volume_from_surface(*options)); });
}

}  // namespace birdseye::host
