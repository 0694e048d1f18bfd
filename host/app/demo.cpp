#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>

#include "host/app/commands.hpp"
#include "host/app/demo_session.hpp"
#include "host/app/simulated_truth.hpp"
#include "host/app/text_files.hpp"
#include "host/volume/import.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostFramesWaiting = 256;

/// Compares every overlaid frame with the truth, marks the kept pictures and writes them.
Result<void> compare(const fs::path& out, DemoSession& session, const Plan& plan) {
  const auto truth = read_simulated_truth(out / "truth");
  if (!truth) return truth.error();
  const auto where = [&](std::uint64_t sequence) -> std::optional<std::pair<Eigen::Vector3d, Eigen::Vector2d>> {
    const auto found = truth->camera_from_patient.find(sequence);
    if (found == truth->camera_from_patient.end()) return std::nullopt;
    const Eigen::Vector3d in_camera = found->second * truth->tumour_centre_in_patient_mm;
    const auto pixel = project(truth->camera, in_camera);
    if (!pixel) return std::nullopt;
    return std::pair{in_camera, *pixel};
  };
  std::map<std::uint64_t, Eigen::Vector2d> estimated_px;
  for (const OverlaidFrame& frame : session.overlaid) {
    const Eigen::Vector3d in_camera = frame.camera_from_patient * plan.tumour_centre_in_patient_mm;
    const auto pixel = project(session.setup->camera, in_camera);
    const auto true_place = where(frame.sequence);
    if (!pixel || !true_place) continue;
    estimated_px[frame.sequence] = *pixel;
    session.figures.errors.push_back({(frame.acquired - session.overlaid.front().acquired).seconds(),
                                      (in_camera - true_place->first).norm(), (*pixel - true_place->second).norm()});
  }
  std::vector<Picture> videos, overlays;
  for (std::size_t i = 0; i < std::min<std::size_t>(6, session.kept.size()); ++i) {
    KeptFrame& frame = session.kept[i * session.kept.size() / std::min<std::size_t>(6, session.kept.size())];
    if (const auto true_place = where(frame.sequence); true_place && estimated_px.count(frame.sequence) != 0) {
      draw_circle(frame.overlay, estimated_px[frame.sequence]);
      draw_cross(frame.overlay, true_place->second);
    }
    videos.push_back(frame.video);
    overlays.push_back(frame.overlay);
  }
  for (const auto& [name, pictures] : {std::pair{"overlay.png", &overlays}, {"video.png", &videos}}) {
    const Picture grid = tile(*pictures, 3, 0.75);
    if (auto written = write_png(out / name, grid.rgb, grid.width_px, grid.height_px, 3); !written) return written;
  }
  return {};
}

void judge(DemoFigures& figures) {
  constexpr double kPassMm = 3, kMarginalMm = 5;
  std::vector<double> mm;
  for (const FrameError& error : figures.errors) mm.push_back(error.target_mm);
  const double p95 = percentile(mm, 0.95);
  figures.verdict = p95 <= kPassMm ? "pass" : p95 <= kMarginalMm ? "marginal" : "fail";
  if (mm.empty()) {
    figures.reasons.push_back("no frame carried an overlay");
  } else {
    figures.reasons.push_back(
        fmt::format("the tumour's centre is within {:.2f} mm in 95 % of the frames; {} mm pass", p95, kPassMm));
  }
}

struct Options {
  SimulatedCartSettings cart;
  std::string noise = "typical";
};

Result<ExitCode> demo(const Options& options) {
  Progress progress;
  SimulatedCartSettings settings = options.cart;
  if (options.noise == "none") settings.position_noise_mm = settings.angle_noise_deg = 0;
  const fs::path& out = settings.folder;
  std::error_code error;
  fs::create_directories(out, error);
  if (error) return Error{Errc::unreadable, fmt::format("{}: cannot be made; choose another --out", out.string())};
  if (!settings.ct.empty()) {
    // With the host's own checks: what would be stacked wrongly is refused here, with the reason.
    if (const auto sound = import_volume(settings.ct); !sound) return sound.error();
  }
  for (const char* name :
       {"report.json", "report.html", "overlay.png", "video.png", "overlay.mp4", "simulator.log", "birdseyed.log"}) {
    fs::remove(out / name, error);
  }
  progress(settings.ct.empty() ? "making the patient" : "making the patient from " + settings.ct.string());
  if (auto made = SimulatedCart::make_patient(settings); !made) return made.error();
  progress("starting tracker, camera and appliance");
  const auto cart = SimulatedCart::start(settings);
  if (!cart) return cart.error();
  auto client = wire::Client::connect("127.0.0.1", (*cart)->port(), Clock::now() + std::chrono::seconds(20));
  if (!client) return client.error();
  EventStream stream(*std::move(client), kMostFramesWaiting);
  const auto plan = read_plan(out / "phantom", (*cart)->sheet().fiducials);
  if (!plan) return plan.error();
  const auto board = calibration::parse_board((*cart)->sheet().board);
  if (!board) return board.error();
  auto film = Film::open(out / "overlay.mp4", settings.width_px, settings.height_px, settings.video_rate_hz);
  if (!film) return film.error();
  progress.keep(fmt::format("the CT shows {} markers; the operation begins", plan->markers_in_patient_mm.size()));

  DemoSession session(**cart, *board, *plan, *std::move(film), progress);
  session.figures.title =
      settings.ct.empty() ? "Birdseye: the simulated cart" : "Birdseye: the simulated cart over a CT of yours";
  session.figures.position_noise_mm = settings.position_noise_mm;
  session.figures.angle_noise_deg = settings.angle_noise_deg;
  if (auto ran = session.run(stream); !ran) return ran.error();
  if (auto ended = (*cart)->finish(Clock::now() + std::chrono::seconds(10)); !ended) return ended.error();
  if (!session.setup) return Error{Errc::timeout, "no frame of the liver came; see birdseyed.log"};
  if (auto filmed = session.finish(); !filmed) return filmed.error();
  if (auto compared = compare(out, session, *plan); !compared) return compared.error();
  if (auto written = write_pose(out / "tracker_from_patient.txt", session.setup->tracker_from_patient.matrix());
      !written)
    return written.error();
  if (auto written = write_pose(out / "camera_from_sensor.txt", session.setup->camera_from_sensor.matrix()); !written)
    return written.error();
  if (auto written = write_camera(out / "camera.yaml", session.setup->camera); !written) return written.error();
  judge(session.figures);
  session.figures.wall_s = progress.seconds();
  if (auto written = write_demo_report(out, session.figures); !written) return written.error();
  progress.keep(fmt::format("{}: {}", session.figures.verdict, session.figures.reasons.front()));
  fmt::print("{}\n", (out / "report.html").string());
  return session.figures.verdict == "fail" ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_demo(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<Options>();
  SimulatedCartSettings& cart = options->cart;
  cart.folder = "out/demo";
  CLI::App& command = *app.add_subcommand("demo", "the whole cart, simulated: calibrate, register, overlay, report");
  command.add_option("--out", cart.folder, "folder for the report (default out/demo)");
  command.add_option("--ct", cart.ct, "a CT to operate on, in place of the procedural patient");
  command.add_option("--seed", cart.seed, "everything random follows from it");
  command.add_option("--noise", options->noise, "typical (0.5 mm, 0.1 deg) or none")
      ->check(CLI::IsMember({"typical", "none"}));
  command.callback([options, &status] {
    const auto done = demo(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
