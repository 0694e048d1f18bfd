#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "drivers/system/clock.hpp"
#include "drivers/system/interrupt.hpp"
#include "drivers/system/json_file.hpp"
#include "drivers/system/program.hpp"
#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/demo/demo_session.hpp"
#include "host/demo/demo_verdict.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/result_folder.hpp"
#include "host/files/text_files.hpp"
#include "host/files/write_files.hpp"
#include "host/operation/landmark_check.hpp"
#include "host/simulated/simulated_truth.hpp"
#include "host/volume/image_file.hpp"
#include "host/volume/import.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostDemoFramesWaiting = 256;
constexpr const char* kNoFrame =
    "no frame of the liver came; if this machine was busy, run the demo again by itself, else see birdseyed.log";

struct Places {
  Eigen::Vector2d true_px, rigid_px, overlaid_px;
};

/// Every overlaid frame against the truth, as it was drawn and, where the CT was deformed, as it would be without that.
/// By the frame's sequence, where the picture shows the tumour's centre.
Result<std::map<std::uint64_t, Places>> compare(const fs::path& out, DemoSession& session, const PatientPlan& patient) {
  const auto truth = read_simulated_truth(out / "truth");
  if (!truth) return truth.error();
  const Eigen::Vector3d rigid_mm = target_in_patient_mm(patient), shown_mm = as_shown_mm(rigid_mm, session.deformed());
  std::map<std::uint64_t, Places> places;
  for (const OverlaidFrame& frame : session.overlaid) {
    const auto error_of = [&](const Eigen::Vector3d& tumour_mm) {
      return overlay_error(*truth, frame.sequence, session.setup->camera(), frame.camera_from_patient, tumour_mm);
    };
    const auto drawn = error_of(shown_mm), rigid = error_of(rigid_mm);
    if (!drawn || !rigid) {
      return Error{Errc::bad_format, fmt::format("{}: lacks frame {}, which was overlaid; run the demo again",
                                                 (out / "truth").string(), frame.sequence)};
    }
    const double time_s = (frame.acquired - session.overlaid.front().acquired).seconds();
    session.figures.errors.push_back({time_s, drawn->target_mm, drawn->overlay_px});
    if (session.deformed() != nullptr)
      session.figures.deforming->rigid_errors.push_back({time_s, rigid->target_mm, rigid->overlay_px});
    const auto &drawn_px = drawn->true_and_overlaid_px, &rigid_px = rigid->true_and_overlaid_px;
    if (drawn_px && rigid_px) places[frame.sequence] = {drawn_px->first, rigid_px->second, drawn_px->second};
  }
  return places;
}

/// Marks some of the kept pictures, and writes them.
Result<void> write_pictures(const fs::path& out, DemoSession& session, const std::map<std::uint64_t, Places>& places) {
  constexpr std::size_t kMost = 6, kPairEvery = 2;
  const std::size_t count = std::min(kMost, session.kept.size());
  std::vector<Picture> videos, overlays, pairs;
  for (std::size_t i = 0; i < count; ++i) {
    KeptFrame& frame = session.kept[i * session.kept.size() / count];
    if (const auto place = places.find(frame.sequence); place != places.end()) {
      const auto mark = [&place](Picture& picture, const Eigen::Vector2d& shown_px) {
        draw_circle(picture, shown_px);
        draw_cross(picture, place->second.true_px);
      };
      mark(frame.overlay, place->second.overlaid_px);
      if (frame.rigid) mark(*frame.rigid, place->second.rigid_px);
    }
    videos.push_back(frame.video);
    overlays.push_back(frame.overlay);
    if (!frame.rigid || i % kPairEvery != 0) continue;
    pairs.push_back(*frame.rigid);
    pairs.push_back(frame.overlay);
  }
  struct Grid {
    const char* name;
    const std::vector<Picture>& pictures;
    int columns;
  };
  for (const Grid& grid :
       {Grid{"overlay.png", overlays, 3}, Grid{"video.png", videos, 3}, Grid{"rigid_and_deformed.png", pairs, 2}}) {
    if (grid.pictures.empty()) continue;
    const Picture tiled = tile(grid.pictures, grid.columns, 0.75);
    if (auto written = write_file(out / grid.name, png_of(tiled.view())); !written) return written;
  }
  return {};
}

struct DemoOptions {
  SimulatedCartSettings cart;
  VolumeSource ct;
  std::string noise = "typical";
};

ResultFolder folder_of(const DemoOptions& options) {
  return {options.cart.folder, "demo", "report.json",
          "ct\\.nii\\.gz|report\\.html|(overlay|video|rigid_and_deformed)\\.png|overlay\\.mp4|simulator\\.log|"
          "birdseyed\\.(log|toml)|cart\\.json|(tracker_from_patient|camera_from_sensor)\\.txt|camera\\.yaml",
          "overlay_error_px_p50"};
}

/// Whether path is the folder or lies in it; both are there.
bool is_within(const fs::path& path, const fs::path& folder) {
  std::error_code error;
  const fs::path place = fs::canonical(path, error);
  if (error) return false;
  const fs::path base = fs::canonical(folder, error);
  return !error && std::ranges::mismatch(base, place).in1 == base.end();
}

/// The simulator replaces what lies in the folder's phantom/ and truth/: nothing there may be read, nor be anybody's
/// own.
Result<void> check_inner_folders(const ResultFolder& folder, const std::vector<fs::path>& inputs) {
  for (const char* const name : {"phantom", "truth"}) {
    const fs::path inner = folder.path / name;
    std::error_code error;
    const bool is_empty = fs::is_empty(inner, error);
    if (error || is_empty) continue;
    for (const fs::path& input : inputs) {
      if (!input.empty() && is_within(input, inner)) {
        return Error{Errc::bad_value,
                     fmt::format("{}: is read, and would be written over by demo; give another --out", input.string())};
      }
    }
    if (!is_of_earlier_run(folder)) {
      return Error{Errc::bad_value, fmt::format("{}: is there, and not of an earlier demo; give another --out, or move "
                                                "the folder away",
                                                inner.string())};
    }
  }
  return {};
}

/// Adds to the report which files the demo wrote: the next one may replace these, and no others.
Result<void> list_files(const ResultFolder& folder) {
  auto report = read_json_file(folder.path / folder.sheet);
  if (!report) return report.error();
  (*report)["files"] = files_of(folder);
  return write_file(folder.path / folder.sheet, text_of(*report));
}

/// The chosen CT as the simulator can read it, which knows no series.
Result<fs::path> write_simple_ct(const Volume& volume, const fs::path& out) {
  ImageFile image;
  image.size = volume.size;
  image.spacing_mm = volume.spacing_mm;
  image.origin_mm = volume.patient_from_voxel.translation();
  image.axes = volume.patient_from_voxel.linear().colwise().normalized();
  image.hu = volume.hu;
  const fs::path path = out / "ct.nii.gz";
  if (auto written = write_image(path, image, StoredAs::int16); !written) return written.error();
  return path;
}

Result<ExitCode> demo(const DemoOptions& options) {
  Progress progress;
  SimulatedCartSettings settings = options.cart;
  settings.views = settings.deformation_mm > 0;
  if (options.noise == "none") settings.position_noise_mm = settings.angle_noise_deg = 0;
  const fs::path& out = settings.folder;
  const std::vector<fs::path> inputs{options.ct.path, settings.faults};
  if (auto is_free = check_free(folder_of(options), inputs); !is_free) return is_free.error();
  if (auto is_free = check_inner_folders(folder_of(options), inputs); !is_free) return is_free.error();
  std::optional<ImportedVolume> ct;
  if (!options.ct.path.empty()) {
    // With the host's own checks: what would be stacked wrongly is refused here, with the reason.
    auto imported = import_body(options.ct);
    if (!imported) return imported.error();
    print_notes(imported->notes);
    ct = *std::move(imported);
  }
  if (auto emptied = make_empty(folder_of(options), inputs); !emptied) return emptied.error();
  std::vector<std::string> ct_notes;
  if (ct) {
    auto simple = write_simple_ct(ct->volume, out);
    if (!simple) return simple.error();
    settings.ct = *std::move(simple);
    ct_notes = std::move(ct->notes);
    ct.reset();  // the simulator and the appliance need the memory
  }
  note_interrupts();
  progress(settings.ct.empty() ? "making the patient" : "making the patient from " + options.ct.path.string());
  if (auto made = SimulatedCart::make_patient(settings); !made) return made.error();
  progress("starting tracker, camera and appliance");
  const auto cart = SimulatedCart::start(settings);
  if (!cart) return cart.error();
  auto client = wire::Client::connect("127.0.0.1", (*cart)->port(), Deadline::after(Duration::from_ms(20'000)));
  if (!client) return client.error();
  EventStream stream(*std::move(client), kMostDemoFramesWaiting);
  auto read = read_with_fiducials(out, (*cart)->sheet().fiducials);
  if (!read) return read.error();
  const auto patient = std::make_shared<const PatientPlan>(*std::move(read));
  const auto board = calibration::parse_pattern((*cart)->sheet().board);
  if (!board) return board.error();
  auto film = Film::open(out / "overlay.mp4", settings.width_px, settings.height_px, settings.video_rate_hz);
  if (!film) return film.error();
  progress.keep(fmt::format("the CT shows {} markers; the operation begins", patient->fiducials_in_patient_mm->size()));

  DemoSession session(**cart, *board, patient, *std::move(film), progress);
  session.figures.title =
      settings.ct.empty() ? "Birdseye: the simulated cart" : "Birdseye: the simulated cart over a CT of yours";
  session.figures.notes = std::move(ct_notes);
  session.figures.deformation_mm = settings.deformation_mm;
  session.figures.position_noise_mm = settings.position_noise_mm;
  session.figures.angle_noise_deg = settings.angle_noise_deg;
  const auto ran = session.run(stream);
  session.figures.drops = stream.drops();
  if (const std::string words = session.figures.drops.words(); !words.empty()) progress.keep(words);
  if (!ran) return ran.error();
  if (auto ended = (*cart)->finish(Deadline::after(Duration::from_ms(10'000))); !ended) return ended.error();
  if (!session.setup) return Error{Errc::timeout, kNoFrame};
  if (auto filmed = session.finish(); !filmed) return filmed.error();
  const auto places = compare(out, session, *patient);
  if (!places) return places.error();
  if (auto written = write_pictures(out, session, *places); !written) return written.error();
  const Setup& setup = *session.setup;
  const auto& lens_covariance = session.scope()->camera_covariance();
  if (auto written =
          write_files({{out / "tracker_from_patient.txt", pose_text(setup.tracker_from_patient().matrix())},
                       {out / "camera_from_sensor.txt", pose_text(setup.camera_from_sensor().matrix())},
                       {out / "camera.yaml", camera_text(setup.camera()) +
                                                 (lens_covariance ? camera_covariance_text(*lens_covariance) : "")}});
      !written) {
    return written.error();
  }
  session.figures.verdict = demo_verdict(session.figures);
  session.figures.drops.tell(session.figures.verdict);
  session.figures.wall_s = progress.seconds();
  if (auto written = write_demo_report(out, session.figures); !written) return written.error();
  if (auto listed = list_files(folder_of(options)); !listed) return listed.error();
  progress.keep((out / "report.html").string());
  fmt::print("verdict: {}\n", name_of(session.figures.verdict.grade));
  for (const std::string& reason : session.figures.verdict.reasons) print_line(reason);
  return session.figures.verdict.grade == Grade::fail ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_demo(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<DemoOptions>();
  SimulatedCartSettings& cart = options->cart;
  cart.folder = "out/demo";
  cart.deformation_mm = 10;
  CLI::App& command =
      *app.add_subcommand("demo", "the whole cart, simulated: calibrate, register, deform, overlay, report");
  command.add_option("--out", cart.folder, "folder for the report (default out/demo)");
  CLI::Option* const ct =
      command.add_option("--ct", options->ct.path, "a CT to operate on, in place of the procedural patient");
  add_ct_options(command, options->ct);
  for (const char* name : {"--series", "--untilt", "--spacing", "--orientation"}) command.get_option(name)->needs(ct);
  command.add_option("--seed", cart.seed, "everything random follows from it");
  command
      .add_option(
          "--deformation-mm", cart.deformation_mm,
          "how far the liver has moved since the CT, where it has moved most (default 10); 0: nothing is deformed")
      ->check(CLI::Range(0.0, 30.0));
  command.add_option("--deformation", cart.deformation, "of which kind")->check(CLI::IsMember(deformation_kinds()));
  command.add_option("--faults", cart.faults, "a script of faults, to see what the overlay does")->type_name("FILE");
  command.add_option("--noise", options->noise, "typical (0.5 mm, 0.1 deg) or none")
      ->check(CLI::IsMember({"typical", "none"}));
  command.callback([options, &status] {
    const auto done = demo(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
