#include "host/bench/render_study.hpp"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>

#include "calibration/base/median.hpp"
#include "drivers/system/clock.hpp"
#include "host/bench/bench_machine.hpp"
#include "host/bench/bench_phantom.hpp"
#include "host/bench/processor_time.hpp"
#include "host/files/picture.hpp"
#include "host/files/write_files.hpp"
#include "host/render/engine.hpp"
#include "host/render/reference/reference_renderer.hpp"

namespace birdseye::host {

namespace {

constexpr double kStep_mm = 1;
constexpr int kWidth_px = 768, kHeight_px = 576;
constexpr int kStride = 12;  // of the pixels that are compared with the reference

struct Timing {
  double frame_ms = 0, cpu_ms = 0;  ///< medians
};

Timing time_frames(int frames, const std::function<void(double azimuth_deg)>& frame) {
  frame(0);
  std::vector<double> wall_ms, cpu_ms;
  for (int i = 0; i < frames; ++i) {
    const double cpu = process_cpu_s();
    const HostTime began = host_now();
    frame(360.0 * i / frames);
    wall_ms.push_back((host_now() - began).seconds() * 1e3);
    cpu_ms.push_back(1e3 * (process_cpu_s() - cpu));
  }
  return {median_of(wall_ms), median_of(cpu_ms)};
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

struct Level {
  int number = 0;
  std::optional<DisplacementField> field;
  std::size_t free_vertices = 0;
  std::vector<double> reference;
};

std::vector<std::uint8_t> over_white(const ImageRgba& image) {
  std::vector<std::uint8_t> rgb;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    for (std::size_t c = 0; c < 3; ++c) {
      rgb.push_back(static_cast<std::uint8_t>(std::min(255, image.rgba[i + c] + 255 - image.rgba[i + 3])));
    }
  }
  return rgb;
}

struct TimedCase {
  std::string phantom;
  std::array<int, 3> size;
  double step_mm;
};

/// One engine at one level, with pruning or without.
Result<nlohmann::json> bench_engine(const TimedCase& c, const RenderStudyOptions& options, const Volume& volume,
                                    Engine& engine, const Level& level, bool pruned) {
  const CameraModel camera = bench_camera(kWidth_px, kHeight_px);
  RenderSettings settings;
  settings.step_mm = c.step_mm;
  const auto frame = [&](double azimuth_deg) { return engine.render(camera, bench_pose(azimuth_deg), settings); };
  const auto deforming_frame = [&](double azimuth_deg) {
    engine.deform(*level.field);
    return frame(azimuth_deg);
  };
  if (level.field) engine.deform(*level.field);
  const double error = mean_error(frame(0), level.reference, kStride);
  const Timing timing = time_frames(options.frames, frame);
  if (const std::string fault = engine.fault(); !fault.empty()) return Error{Errc::io, engine.name() + ": " + fault};
  nlohmann::json row = {{"engine", engine.name()},
                        {"phantom", c.phantom},
                        {"volume", fmt::format("{}x{}x{}", c.size[0], c.size[1], c.size[2])},
                        {"viewport", fmt::format("{}x{}", kWidth_px, kHeight_px)},
                        {"step_mm", c.step_mm},
                        {"level", level.number},
                        {"free_vertices", level.free_vertices},
                        {"pruned", pruned},
                        {"frame_ms_median", timing.frame_ms},
                        {"cpu_ms_median", timing.cpu_ms},
                        {"fps", 1e3 / timing.frame_ms},
                        {"mean_abs_error_255", error}};
  if (level.field) row["deforming_frame_ms_median"] = time_frames(options.frames, deforming_frame).frame_ms;
  if (engine.bytes() > 0) {
    row["memory_ratio"] = static_cast<double>(engine.bytes()) / (2.0 * static_cast<double>(volume.hu.size()));
  }
  return row;
}

Level make_level(const TimedCase& c, const Volume& volume, int number) {
  Level level;
  level.number = number;
  if (number > 0) {
    auto [field, count] = bench_deformation(volume, number);
    assert(least_determinant(field) > 0);
    level.field = std::move(field);
    level.free_vertices = count;
  }
  RenderSettings settings;
  settings.step_mm = c.step_mm;
  level.reference = render_reference(volume, bench_transfer(), bench_camera(kWidth_px, kHeight_px), bench_pose(0),
                                     settings, level.field ? &*level.field : nullptr, kStride);
  return level;
}

/// The phantom cut open, as the manual shows it.
Result<void> draw_level(const RenderStudyOptions& options, const TimedCase& c, Engine& engine, const Level& level) {
  RenderSettings settings;
  settings.step_mm = 0.5 * c.step_mm;
  settings.clip = ClipPlane{Eigen::Vector3d(-1, 0, 0), -150};
  if (level.field) engine.deform(*level.field);
  const ImageRgba image = engine.render(bench_camera(kWidth_px, kHeight_px), bench_pose(20), settings);
  const std::string engine_name = engine.name().substr(0, engine.name().find(','));
  return write_file(options.pictures / fmt::format("{}-{}-level{}.png", c.phantom, engine_name, level.number),
                    png_of(RgbView{over_white(image), image.width_px, image.height_px}));
}

/// The undeformed case for another program: volume.mha and scene.json.
Result<void> write_scene(const std::filesystem::path& folder, const TimedCase& c, const Volume& volume) {
  const Eigen::Vector3d& spacing = volume.spacing_mm;
  const Eigen::Vector3d origin = volume.patient_from_voxel.translation();
  std::string mha = fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nDimSize = {} {} {}\n"
      "TransformMatrix = 1 0 0 0 1 0 0 0 1\nElementSpacing = {} {} {}\nOffset = {} {} {}\nElementType = MET_SHORT\n"
      "ElementDataFile = LOCAL\n",
      c.size[0], c.size[1], c.size[2], spacing.x(), spacing.y(), spacing.z(), origin.x(), origin.y(), origin.z());
  mha.append(reinterpret_cast<const char*>(volume.hu.data()), volume.hu.size() * sizeof(std::int16_t));
  nlohmann::json transfer = nlohmann::json::array();
  const TransferFunction table = bench_transfer();
  for (int hu = TransferFunction::kLowestHu; hu <= TransferFunction::kHighestHu; hu += 5) {
    const TransferFunction::Entry& e = table.at(hu);
    transfer.push_back({hu, e.r, e.g, e.b, e.extinction_per_mm});
  }
  const Eigen::Vector3d middle = 0.5 * spacing.cwiseProduct(Eigen::Vector3d(c.size[0], c.size[1], c.size[2]));
  const nlohmann::json scene = {{"phantom", c.phantom},
                                {"volume", fmt::format("{}x{}x{}", c.size[0], c.size[1], c.size[2])},
                                {"width_px", kWidth_px},
                                {"height_px", kHeight_px},
                                {"step_mm", c.step_mm},
                                {"view_angle_deg", 30},
                                {"elevation_deg", 30},
                                {"distance_mm", 340},
                                {"middle_mm", {middle.x(), middle.y(), middle.z()}},
                                {"transfer", transfer}};
  return write_files({{folder / "volume.mha", mha}, {folder / "scene.json", text_of(scene)}});
}

Result<void> bench_case(const TimedCase& c, const RenderStudyOptions& options, const TellRow& tell,
                        nlohmann::json& rows) {
  const Volume volume = bench_phantom(c.phantom, c.size);
  if (!options.scene.empty() && c.phantom == "liver" && c.size[2] == 64) {
    if (auto written = write_scene(options.scene, c, volume); !written) return written;
  }
  for (const int number : options.levels) {
    const Level level = make_level(c, volume, number);
    for (const std::string& name : options.engines) {
      for (const bool pruned : {true, false}) {
        auto engine = make_engine(name, volume, bench_transfer(), {.prune = pruned});
        if (!engine) return engine.error();
        auto row = bench_engine(c, options, volume, **engine, level, pruned);
        if (!row) return row.error();
        tell(*row);
        rows.push_back(*std::move(row));
        if (!pruned || options.pictures.empty()) continue;
        if (auto drawn = draw_level(options, c, **engine, level); !drawn) return drawn;
      }
    }
  }
  return {};
}

}  // namespace

Result<nlohmann::json> render_study(const RenderStudyOptions& options, const TellRow& tell) {
  for (const std::filesystem::path& folder : {options.scene, options.pictures}) {
    std::error_code error;
    if (!folder.empty()) std::filesystem::create_directories(folder, error);
    if (error)
      return Error{Errc::unreadable, fmt::format("{}: cannot be made; choose another folder", folder.string())};
  }
  const auto threads =
      static_cast<std::size_t>(options.threads > 0 ? options.threads : tbb::info::default_concurrency());
  const tbb::global_control at_most(tbb::global_control::max_allowed_parallelism, threads);
  nlohmann::json rows = nlohmann::json::array();
  std::vector<TimedCase> cases;
  for (const std::string& phantom : options.phantoms) {
    for (const int depth : {64, 32}) cases.push_back({phantom, {256, 256, depth}, kStep_mm});
  }
  if (options.large) cases.push_back({"liver", {512, 512, 128}, 0.5});
  for (const TimedCase& c : cases) {
    if (auto done = bench_case(c, options, tell, rows); !done) return done.error();
  }
  // Pictures and memory are judged here; times are for whoever knows the machine.
  constexpr double kMostError = 0.5, kMostMemory = 3;
  std::vector<std::string> reasons;
  for (const nlohmann::json& row : rows) {
    const auto engine = row["engine"].get<std::string>();
    const auto error = row["mean_abs_error_255"].get<double>();
    if (engine.rfind("slices", 0) != 0 && error > kMostError) {
      reasons.push_back(
          fmt::format("{} at level {} is {:.2f}/255 from the reference", engine, row["level"].get<int>(), error));
    }
    if (row.value("memory_ratio", 0.0) > kMostMemory) reasons.push_back(engine + ": more memory than three volumes");
  }
  const bool sound = reasons.empty();
  const std::string verdict = sound ? "pass" : "fail";
  if (sound) {
    reasons.push_back(
        fmt::format("all rays within {}/255 of the reference, in at most {} volumes more", kMostError, kMostMemory));
  }
  nlohmann::json machine = bench_machine();
  machine["threads"] = threads;
  return nlohmann::json{{"rows", rows}, {"machine", machine}, {"verdict", verdict}, {"reasons", reasons}};
}

}  // namespace birdseye::host
