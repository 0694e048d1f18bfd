#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "calibration/solve/intrinsics.hpp"
#include "host/app/board_stations.hpp"
#include "host/app/commands.hpp"
#include "host/app/demo_report.hpp"
#include "host/app/event_stream.hpp"
#include "host/app/film.hpp"
#include "host/app/picture.hpp"
#include "host/app/simulated_cart.hpp"
#include "host/app/simulated_truth.hpp"
#include "host/app/text_files.hpp"
#include "host/overlay/compositor.hpp"
#include "host/overlay/gate.hpp"
#include "host/registration/point_matching.hpp"
#include "host/registration/touch_detector.hpp"
#include "host/render/cpu/ray_caster.hpp"
#include "host/volume/import.hpp"
#include "host/volume/labels.hpp"
#include "host/volume/marker_finder.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// The labels of the simulator's segmentation that the overlay shows.
constexpr int kPortal = 2, kHepatic = 3, kTumour = 4;
constexpr std::size_t kMostFramesWaiting = 256;
constexpr int kKeepEvery = 20;  // of the overlaid frames, for the pictures of the report

/// One line of progress, in place on a terminal.
class Progress {
 public:
  void operator()(const std::string& what) {
    if (what == last_) return;
    last_ = what;
    const double s = std::chrono::duration<double>(Clock::now() - began_).count();
    fmt::print("{}[{:5.1f} s] {}{}", terminal_ ? "\r\x1b[K" : "", s, what, terminal_ ? "" : "\n");
    std::fflush(stdout);
  }
  void keep(const std::string& what) {
    (*this)(what);
    last_.clear();
    if (terminal_) fmt::print("\n");
  }
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(Clock::now() - began_).count(); }

 private:
  Clock::time_point began_ = Clock::now();
  std::string last_;
  bool terminal_ = ::isatty(STDOUT_FILENO) == 1;
};

/// What is read of the CT before the operation: all that the appliance does not send.
struct Plan {
  Volume shown;
  Eigen::Vector3d tumour_centre_in_patient_mm;
  std::vector<Eigen::Vector3d> markers_in_patient_mm;
};

Result<Plan> read_plan(const fs::path& patient, int fiducials) {
  const auto ct = import_volume(patient / "ct");
  if (!ct) return ct.error();
  const auto labels = import_labels(patient / "segmentation.nii.gz", *ct);
  if (!labels) return labels.error();
  Plan plan;
  const int shown[] = {kPortal, kHepatic, kTumour};
  plan.shown = keep_labels(*ct, *labels, shown);
  const auto centre = label_centroid_mm(*labels, kTumour);
  if (!centre) return centre.error();
  plan.tumour_centre_in_patient_mm = *centre;
  plan.markers_in_patient_mm = find_markers(*ct);
  if (static_cast<int>(plan.markers_in_patient_mm.size()) < fiducials) {
    return Error{Errc::not_found, fmt::format("{}: {} markers found where there are {}", (patient / "ct").string(),
                                              plan.markers_in_patient_mm.size(), fiducials)};
  }
  plan.markers_in_patient_mm.resize(static_cast<std::size_t>(fiducials));  // the brightest
  return plan;
}

/// What calibration and registration found; with it a frame's pose gives where the CT lies before the camera.
struct Setup {
  CameraModel camera;
  Transform<Camera, Sensor> camera_from_sensor;
  Transform<Tracker, Patient> tracker_from_patient;
};

struct OverlaidFrame {
  std::uint64_t sequence;
  DeviceTime acquired;
  Transform<Camera, Patient> camera_from_patient;
};

struct KeptFrame {
  std::uint64_t sequence;
  Picture video, overlay;
};

/// One run of the demo: takes the appliance's events in order and does what the stage asks for.
class Session {
 public:
  Session(SimulatedCart& cart, const calibration::BoardSpec& board, const Plan& plan, Film film, Progress& progress)
      : cart_(cart), board_(board), plan_(plan), film_(std::move(film)), progress_(progress), stations_(board) {}

  /// Until the operation has ended and its last frame has come.
  Result<void> run(EventStream& stream);
  Result<void> finish() { return film_.finish(); }

  DemoFigures figures;
  std::vector<OverlaidFrame> overlaid;
  std::vector<KeptFrame> kept;
  std::optional<Setup> setup;

 private:
  [[nodiscard]] std::string stage_at(DeviceTime time) const;
  Result<void> take(const wire::Birds& birds);
  Result<void> take(const wire::VideoFrame& frame);
  Result<void> calibrate_and_register(const CameraModel& size);
  Result<void> overlay(const wire::VideoFrame& frame);

  SimulatedCart& cart_;
  calibration::BoardSpec board_;
  const Plan& plan_;
  Film film_;
  Progress& progress_;
  BoardStations stations_;
  TouchDetector touch_detector_;
  std::vector<Eigen::Vector3d> touches_in_tracker_mm_;
  OverlayGate gate_;
  std::unique_ptr<LensRays> rays_;
  std::unique_ptr<RayCaster> caster_;
  std::optional<std::uint64_t> first_sequence_;
  DeviceTime first_measurement_;
  int measurements_ = 0;
};

std::string Session::stage_at(DeviceTime time) const {
  std::string name;
  for (const CartStage& stage : cart_.stages()) {
    if (stage.begins <= time) name = stage.name;
  }
  return name;
}

Result<void> Session::take(const wire::Birds& birds) {
  if (measurements_++ == 0) first_measurement_ = birds.acquired;
  const double since_s = (birds.acquired - first_measurement_).seconds();
  if (since_s > 0) figures.tracker_rate_hz = (measurements_ - 1) / since_s;
  const std::string stage = stage_at(birds.acquired);
  for (const wire::Bird& bird : birds.birds) {
    if (bird.name == "scope" && stage == "calibrate") stations_.push(birds.acquired, bird.tracker_from_sensor);
    if (bird.name == "pointer" && (stage == "touch" || stage == "look")) {
      const Eigen::Vector3d tip = bird.tracker_from_sensor * cart_.sheet().tip_in_pointer_mm;
      if (const auto touch = touch_detector_.push(birds.acquired, tip); touch && stage == "touch") {
        touches_in_tracker_mm_.push_back(touch->tip_in_tracker_mm);
        progress_(fmt::format("touched fiducial {} of {}", touches_in_tracker_mm_.size(), cart_.sheet().fiducials));
      }
    }
  }
  return {};
}

Result<void> Session::calibrate_and_register(const CameraModel& size) {
  stations_.finish();
  const auto points = calibration::board_points_mm(board_);
  const auto lens = calibration::solve_intrinsics(points, stations_.views(), size.width_px, size.height_px);
  if (!lens) return Error{lens.error().code, "camera calibration: " + lens.error().what};
  const auto hand_eye = calibration::solve_hand_eye(points, stations_.views(), stations_.tracker_from_sensor(),
                                                    lens->camera_from_marker, lens->camera, stations_.uncertainty());
  if (!hand_eye) return Error{hand_eye.error().code, "hand-eye calibration: " + hand_eye.error().what};
  const auto fit = match_and_fit(plan_.markers_in_patient_mm, touches_in_tracker_mm_);
  if (!fit) return Error{fit.error().code, "registration: " + fit.error().what};
  figures.camera_rms_px = lens->rms_px;
  figures.hand_eye_rms_px = hand_eye->tracked_rms_px;
  figures.board_views = static_cast<int>(stations_.views().size());
  figures.fre_mm = fit->fit.fre_rms_mm;
  figures.fiducial_residuals_mm = fit->fit.residuals_mm;
  setup = Setup{lens->camera, hand_eye->camera_from_sensor, fit->fit.to_from.inverse()};
  const auto transfer = load_transfer_function("tumour-and-vessels");
  if (!transfer) return transfer.error();
  rays_ = std::make_unique<LensRays>(setup->camera);
  caster_ = std::make_unique<RayCaster>(plan_.shown, *transfer);
  progress_.keep(fmt::format("camera {:.2f} px from {} views, hand-eye {:.2f} px, registration {:.2f} mm", lens->rms_px,
                             figures.board_views, hand_eye->tracked_rms_px, fit->fit.fre_rms_mm));
  return {};
}

Result<void> Session::overlay(const wire::VideoFrame& frame) {
  const OverlayGate::Decision decision = gate_.decide(frame.info.acquired, frame.info.pose);
  std::vector<std::uint8_t> out = *frame.rgb;
  if (decision.tracker_from_sensor && decision.strength > 0) {
    const Transform<Camera, Patient> camera_from_patient =
        setup->camera_from_sensor * decision.tracker_from_sensor->inverse() * setup->tracker_from_patient;
    RenderSettings settings;
    settings.step_mm = 1.2;
    out = composite(*frame.rgb, caster_->render(*rays_, camera_from_patient, settings), decision.strength);
    overlaid.push_back({frame.info.sequence, frame.info.acquired, camera_from_patient});
  } else {
    ++figures.frames_without_overlay;
  }
  if (overlaid.size() % kKeepEvery == 1) {
    kept.push_back(
        {frame.info.sequence, {frame.width_px, frame.height_px, *frame.rgb}, {frame.width_px, frame.height_px, out}});
  }
  if (overlaid.size() % kKeepEvery == 0) progress_(fmt::format("overlaid {} frames", overlaid.size()));
  return film_.add(out);
}

Result<void> Session::take(const wire::VideoFrame& frame) {
  ++figures.frames;
  // By the camera's own count, whoever lost them.
  if (!first_sequence_) first_sequence_ = frame.info.sequence;
  figures.frames_dropped = static_cast<int>(frame.info.sequence - *first_sequence_ + 1) - figures.frames;
  const std::string stage = stage_at(frame.info.acquired);
  if (stage == "calibrate") {
    stations_.push(frame);
    progress_(fmt::format("calibrating: {} views of the board", stations_.views().size()));
  }
  if (stage != "look" && stage != "end") return {};
  if (!setup) {
    CameraModel size;
    size.width_px = frame.width_px;
    size.height_px = frame.height_px;
    if (auto done = calibrate_and_register(size); !done) return done;
  }
  return overlay(frame);
}

Result<void> Session::run(EventStream& stream) {
  constexpr auto kPatience = std::chrono::seconds(15);
  auto heard = Clock::now();
  for (;;) {
    if (const std::string failure = cart_.failure(); !failure.empty()) return Error{Errc::disconnected, failure};
    auto event = stream.next(Clock::now() + std::chrono::milliseconds(200));
    if (!event) return event.error();
    if (!*event) {
      const auto stages = cart_.stages();
      // Nothing waits, the script has ended, and the last frames have had time to come.
      if (!stages.empty() && stages.back().name == "end" && Clock::now() - heard > std::chrono::milliseconds(500))
        return {};
      if (Clock::now() - heard > kPatience)
        return Error{Errc::timeout, "the appliance has sent nothing for 15 s; see birdseyed.log"};
      continue;
    }
    Result<void> taken;
    if (const auto* frame = std::get_if<wire::VideoFrame>(&**event)) {
      taken = take(*frame);
      heard = Clock::now();
    } else if (const auto* birds = std::get_if<wire::Birds>(&**event)) {
      taken = take(*birds);
      // After the script's end the tracker goes on a little; the last frames may still be on their way.
      const auto stages = cart_.stages();
      const bool ended = !stages.empty() && stages.back().name == "end" && stages.back().begins < birds->acquired;
      if (ended && Clock::now() - heard > std::chrono::milliseconds(400)) return {};
    }
    if (!taken) return taken;
  }
}

/// Compares every overlaid frame with the truth, marks the kept pictures and writes them.
Result<void> compare(const fs::path& out, Session& session, const Plan& plan) {
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

  Session session(**cart, *board, *plan, *std::move(film), progress);
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
