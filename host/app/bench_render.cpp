#include <fmt/format.h>
#include <sys/utsname.h>
#include <tbb/info.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/app/bench_phantom.hpp"
#include "host/app/commands.hpp"
#include "host/app/write_files.hpp"
#include "host/render/cpu/ray_caster.hpp"
#include "host/render/reference/reference_renderer.hpp"

namespace birdseye::host {

namespace {

constexpr double kStep_mm = 1;

struct Options {
  std::filesystem::path json;
  int frames = 15;
  bool large = false;
  std::vector<int> levels{0, 1, 2, 3, 4, 5};
  std::vector<std::string> phantoms{"liver", "torso"};
};

struct Timing {
  double frame_ms = 0, cpu_ms = 0;  ///< medians
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

double cpu_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

Timing time_frames(int frames, const std::function<void(double azimuth_deg)>& frame) {
  frame(0);
  std::vector<double> wall_ms, cpu_ms;
  for (int i = 0; i < frames; ++i) {
    const double cpu = cpu_seconds();
    const auto began = std::chrono::steady_clock::now();
    frame(360.0 * i / frames);
    wall_ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count());
    cpu_ms.push_back(1e3 * (cpu_seconds() - cpu));
  }
  return {median(wall_ms), median(cpu_ms)};
}

/// Against the double-precision reference, over every 12th pixel of every 12th row.
double mean_error(const ImageRgba& picture, const std::vector<double>& reference, int stride) {
  double sum = 0;
  std::size_t n = 0;
  for (int y = 0; y < picture.height_px; y += stride) {
    for (int x = 0; x < picture.width_px; x += stride) {
      for (std::size_t c = 0; c < 4; ++c, ++n) {
        const std::size_t at =
            (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width_px) + static_cast<std::size_t>(x)) *
                4 +
            c;
        sum += std::abs(picture.rgba[at] - 255 * reference[n]);
      }
    }
  }
  return sum / static_cast<double>(n);
}

struct Case {
  std::string phantom;
  std::array<int, 3> size;
  double step_mm;
};

void bench_case(const Case& c, const Options& options, nlohmann::json& rows) {
  const Volume volume = bench_phantom(c.phantom, c.size);
  const LensRays rays(bench_camera(768, 576));
  RenderSettings settings;
  settings.step_mm = c.step_mm;
  for (const int level : options.levels) {
    std::optional<DisplacementField> field;
    std::size_t free_vertices = 0;
    if (level > 0) {
      auto [made, count] = bench_deformation(volume, level);
      field = std::move(made);
      free_vertices = count;
    }
    constexpr int kStride = 12;
    const auto reference = render_reference(volume, bench_transfer(), rays.camera(), bench_pose(0), settings,
                                            field ? &*field : nullptr, kStride);
    for (const bool pruned : {true, false}) {
      RayCaster caster(volume, bench_transfer(), cpu::supported_isas().back(), pruned);
      const auto frame = [&](double azimuth_deg) {
        if (field) caster.deform(*field);
        return caster.render(rays, bench_pose(azimuth_deg), settings);
      };
      const double error = mean_error(frame(0), reference, kStride);
      const Timing timing = time_frames(options.frames, frame);
      rows.push_back(
          {{"engine", "cpu"},
           {"phantom", c.phantom},
           {"volume", fmt::format("{}x{}x{}", c.size[0], c.size[1], c.size[2])},
           {"viewport", "768x576"},
           {"step_mm", c.step_mm},
           {"level", level},
           {"free_vertices", free_vertices},
           {"pruned", pruned},
           {"frame_ms_median", timing.frame_ms},
           {"cpu_ms_median", timing.cpu_ms},
           {"fps", 1e3 / timing.frame_ms},
           {"mean_abs_error_255", error},
           {"memory_ratio", static_cast<double>(caster.bytes()) / (2.0 * static_cast<double>(volume.hu.size()))}});
      const auto& row = rows.back();
      fmt::print("cpu  {:5}  {:11}  level {}  {:5} free  {:8}  {:7.2f} ms  {:7.2f} ms CPU  {:6.1f} fps  error {:.3f}\n",
                 c.phantom, row["volume"].get<std::string>(), level, free_vertices, pruned ? "pruned" : "unpruned",
                 timing.frame_ms, timing.cpu_ms, 1e3 / timing.frame_ms, error);
      std::fflush(stdout);
    }
  }
}

Result<void> bench_render(const Options& options) {
  nlohmann::json rows = nlohmann::json::array();
  std::vector<Case> cases;
  for (const std::string& phantom : options.phantoms) {
    for (const int depth : {64, 32}) cases.push_back({phantom, {256, 256, depth}, kStep_mm});
  }
  if (options.large) cases.push_back({"liver", {512, 512, 128}, 0.5});
  for (const Case& c : cases) bench_case(c, options, rows);
  utsname machine{};
  ::uname(&machine);
  const nlohmann::json json = {{"rows", rows},
                               {"machine",
                                {{"cores", tbb::info::default_concurrency()},
                                 {"isa", cpu::name_of(cpu::supported_isas().back())},
                                 {"kernel", machine.release}}},
                               {"verdict", "pass"},
                               {"reasons", {"measured; docs/manual/rendering.md has the targets"}}};
  return write_files({{options.json, text_of(json)}});
}

}  // namespace

void add_bench(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<Options>();
  CLI::App& bench = *app.add_subcommand("bench", "measure speed on this machine");
  bench.require_subcommand(1);
  CLI::App& render = *bench.add_subcommand("render", "all levels of deformation, with and without pruning");
  render.add_option("--json", options->json, "write the table to this file");
  render.add_option("--frames", options->frames, "frames a row (default 15)")->check(CLI::Range(3, 1000));
  render.add_option("--level", options->levels, "only these levels, 0 (not deformed) to 5")->check(CLI::Range(0, 5));
  render.add_option("--phantom", options->phantoms, "only these: liver, torso")
      ->check(CLI::IsMember({"liver", "torso"}));
  render.add_flag("--large", options->large, "also 512x512x128 voxels at 0.5 mm");
  render.callback([options, &status] { status.take(bench_render(*options)); });
}

}  // namespace birdseye::host
