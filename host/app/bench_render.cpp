#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/app/commands.hpp"
#include "host/bench/render_study.hpp"
#include "host/files/write_files.hpp"
#include "host/render/engine.hpp"

namespace birdseye::host {

namespace {

struct BenchRenderOptions {
  std::filesystem::path json;
  RenderStudyOptions study;
};

void print_render_row(const nlohmann::json& row) {
  const auto deforming = row.find("deforming_frame_ms_median");
  fmt::print(
      "{:12.12}  {:5}  {:11}  level {}  {:5} free  {:8}  {:8.2f} ms  {:8.2f} ms CPU  {:6.1f} fps  error {:.3f}{}\n",
      row["engine"].get<std::string>(), row["phantom"].get<std::string>(), row["volume"].get<std::string>(),
      row["level"].get<int>(), row["free_vertices"].get<std::size_t>(),
      row["pruned"].get<bool>() ? "pruned" : "unpruned", row["frame_ms_median"].get<double>(),
      row["cpu_ms_median"].get<double>(), row["fps"].get<double>(), row["mean_abs_error_255"].get<double>(),
      deforming == row.end() ? "" : fmt::format("  {:7.2f} ms deforming", deforming->get<double>()));
  std::fflush(stdout);
}

Result<ExitCode> bench_render(const BenchRenderOptions& options) {
  const auto table = render_study(options.study, print_render_row);
  if (!table) return table.error();
  if (auto written = write_files({{options.json, text_of(*table)}}); !written) return written.error();
  return (*table)["verdict"] == "pass" ? ExitCode::success : ExitCode::verdict_fail;
}

}  // namespace

void add_bench(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<BenchRenderOptions>();
  CLI::App& bench = *app.add_subcommand("bench", "measure speed on this machine");
  bench.require_subcommand(1);
  add_bench_device(bench, status);
  add_bench_similarity(bench, status);
  add_bench_wire(bench, status);
  add_bench_register(bench, status);
  CLI::App& render = *bench.add_subcommand("render", "all levels of deformation, with and without pruning");
  render.add_option("--json", options->json, "write the table to this file");
  render.add_option("--frames", options->study.frames, "frames a row (default 15)")->check(CLI::Range(3, 1000));
  render.add_option("--threads", options->study.threads, "of the cpu engine (default all cores)")
      ->check(CLI::Range(1, 1024));
  render.add_option("--engine", options->study.engines, "these engines: cpu, gl, slices (default cpu)")
      ->check(CLI::IsMember(engine_names()));
  render.add_option("--pictures", options->study.pictures, "folder for a picture of each level, cut open");
  render.add_option("--export", options->study.scene,
                    "folder for the 256x256x64 liver and its scene, for other programs");
  render.add_option("--level", options->study.levels, "only these levels, 0 (not deformed) to 5")
      ->check(CLI::Range(0, 5));
  render.add_option("--phantom", options->study.phantoms, "only these: liver, torso")
      ->check(CLI::IsMember({"liver", "torso"}));
  render.add_flag("--large", options->study.large, "also 512x512x128 voxels at 0.5 mm");
  render.callback([options, &status] {
    const auto done = bench_render(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
