#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "calibration/base/picture_size.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/durable.hpp"
#include "drivers/system/program.hpp"
#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/app/foreign_options.hpp"
#include "host/app/overlay_options.hpp"
#include "host/demo/demo_report.hpp"
#include "host/doctor/first_run.hpp"
#include "host/files/named_points.hpp"
#include "host/files/write_files.hpp"
#include "host/operation/landmark_check.hpp"
#include "host/operation/operation.hpp"
#include "host/operation/patient.hpp"
#include "host/recording/recording_signature.hpp"
#include "host/texts/texts.hpp"
#include "host/window/first_run_page.hpp"
#include "host/window/live_app.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

struct LiveOptions {
  std::string server, board;
  wire::ForeignSettings foreign;
  bool simulate = false, accept_unsigned = false;
  SimulatedCartSettings cart;
  LiveSettings live;
  PatientFiles simulated;  ///< once it is made
  LiveWindow::Settings window;
  fs::path tip, script, json, recording;
  double speed = 1;
  OverlayLook look;  ///< to begin with
  bool light_room = false, identify = false;
  fs::path language, list_texts;
  std::string size = "1280x720", video = "512x384", publish;
};

/// Where windows remember their layout between runs, by the XDG base directory specification.
fs::path layout_file() {
  const char* const config = std::getenv("XDG_CONFIG_HOME");
  const char* const home = std::getenv("HOME");
  fs::path folder;
  if (config != nullptr && *config != 0) {
    folder = config;
  } else if (home != nullptr) {
    folder = fs::path(home) / ".config";
  } else {
    return {};
  }
  std::error_code error;
  fs::create_directories(folder / "birdseye", error);
  return error ? fs::path() : folder / "birdseye" / "live.ini";
}

/// out/live; where that holds an operation, the next that does not.
fs::path free_folder() {
  fs::path folder = "out/live";
  for (int n = 2; has_operation(folder); ++n) folder = fmt::format("out/live-{}", n);
  return folder;
}

Result<void> refuse_operation_in(const LiveSettings& live) {
  std::error_code ignored;
  const bool goes_on = fs::equivalent(live.out, live.resume, ignored);
  if (live.out.empty() || goes_on || !has_operation(live.out)) return {};
  return Error{Errc::in_use,
               fmt::format("{0}: holds an operation already; go on from it with --resume {0}, or choose another --out",
                           live.out.string())};
}

constexpr const char* kOneSource = "give one of --server HOST:PORT, --recording PATH and --simulate";
constexpr const char* kNoCt = "--ct is missing: name the CT that is to be shown";

Result<void> prepare_window(LiveOptions& options) {
  LiveWindow::Settings& window = options.window;
  const auto size = parse_picture_size(options.size);
  if (!size || size->width_px < 640 || size->height_px < 480)
    return Error{Errc::bad_value, fmt::format("--size: \"{}\" is no size of at least 640x480", options.size)};
  window.width_px = size->width_px;
  window.height_px = size->height_px;
  window.title = words("window_title");
  window.layout = layout_file();
  return {};
}

/// Without a source or a CT: a window whose page says so and offers the simulated cart, where there is a display. Null
/// where nothing is lacking; the error says what is, unless that cart is taken.
Result<std::unique_ptr<LiveWindow>> offer_simulated_cart(LiveOptions& options, std::optional<LiveScript>& script) {
  const bool source = !options.server.empty() || !options.recording.empty(), ct = !options.live.patient.ct.path.empty();
  if (options.simulate || (source && ct)) return std::unique_ptr<LiveWindow>();
  if (auto prepared = prepare_window(options); !prepared) return prepared.error();
  const Error lacks{Errc::bad_value,
                    fmt::format("{}; birdseye doctor says what this machine has", source ? kNoCt : kOneSource)};
  auto window = LiveWindow::open(options.window);
  if (!window) return lacks;
  FirstRun given{options.server.empty() ? options.recording.string() : options.server, options.live.patient.ct.path,
                 options.live.patient.labels, !options.live.patient.organ.empty(), options.board};
  (*window)->set_room(options.light_room ? Room::light : Room::dark);
  const std::string lacking = source ? words("first_no_ct") : ct ? words("first_no_video") : words("first_neither");
  const auto chosen = show_first_run_page(**window, lacking, first_run_questions(this_machine(), given), script);
  if (!chosen) return chosen.error();
  if (*chosen == FirstRunChoice::close) return lacks;
  options.light_room = (*window)->room() == Room::light;
  options.simulate = true;
  options.server.clear();
  options.recording.clear();
  return window;
}

Result<void> prepare(LiveOptions& options) {
  const int sources = static_cast<int>(options.simulate) + static_cast<int>(!options.server.empty()) +
                      static_cast<int>(!options.recording.empty());
  if (sources != 1) return Error{Errc::bad_value, kOneSource};
  if (auto prepared = prepare_window(options); !prepared) return prepared;
  const auto video = parse_picture_size(options.video);
  if (!video) return Error{Errc::bad_value, fmt::format("--video: \"{}\" is no size, as 768x576", options.video)};
  options.cart.width_px = video->width_px;
  options.cart.height_px = video->height_px;
  options.foreign.scope_bird = options.live.scope;
  options.foreign.not_scope = options.live.pointer;
  if (!options.board.empty()) {
    auto pattern = calibration::parse_pattern(options.board);
    if (!pattern) return pattern.error();
    options.live.pattern = *std::move(pattern);
  }
  if (!options.tip.empty()) {
    const auto points = read_points(options.tip, PointsOf::sensor);
    if (!points) return points.error();
    if (points->size() != 1)
      return Error{Errc::bad_value, options.tip.string() + ": holds no single point; give what calibrate tip wrote"};
    options.live.tip_in_pointer_mm = points->front();
  }
  if (options.live.out.empty()) options.live.out = options.live.resume;  // what is found from there on is kept too
  if (auto kept = refuse_operation_in(options.live); !kept) return kept;
  if (options.simulate) {
    if (options.live.out.empty()) options.live.out = free_folder();
    options.cart.folder = options.live.out;
    options.simulated = simulated_patient(options.live.out);
    options.simulated.margins_mm = options.live.patient.margins_mm;
    if (auto made = make_folder_durably(options.live.out); !made) return made;
  } else if (std::error_code ignored; !fs::exists(options.live.patient.ct.path, ignored)) {
    return Error{Errc::not_found,
                 fmt::format("--ct {}: no such file or folder", options.live.patient.ct.path.string())};
  } else if (auto named = check_labels_named(options.live.patient); !named) {
    return named;
  }
  return {};
}

nlohmann::json json_of(const LiveFigures& figures, const OperationView& operation) {
  nlohmann::json json{{"frames", figures.frames},
                      {"frames_skipped", figures.frames_skipped},
                      {"frames_overlaid", figures.frames_overlaid},
                      {"seconds", figures.seconds},
                      {"age_ms_p50", figures.ages.percentile_ms(0.5)},
                      {"age_ms_p95", figures.ages.percentile_ms(0.95)},
                      {"age_ms_max", figures.ages.most_ms()},
                      {"oldest_overlay_ms", figures.oldest_overlay_ms},
                      {"stood_still", figures.stood_still},
                      {"touches", operation.touched_places},
                      {"engine", operation.engine_name},
                      {"link_says", operation.link.words},
                      {"appliance_says", operation.link.appliance_says},
                      {"picture_says", figures.picture_says}};
  if (const auto& fre = operation.fre_mm) json["fre_mm"] = *fre;
  if (operation.patient && !operation.patient->notes.empty()) json["notes"] = operation.patient->notes;
  if (figures.window_s) json["window_s"] = *figures.window_s;
  if (figures.ct_s) json["ct_s"] = *figures.ct_s;
  if (figures.fiducials_s) json["fiducials_s"] = *figures.fiducials_s;
  return json;
}

/// Against the truth of a simulated cart, as far as an overlay was drawn.
Result<void> judge(const LiveOptions& options, const LiveApp& app, nlohmann::json& json, Verdict& verdict) {
  const OperationView operation = app.operation();
  const auto& setup = app.setup();
  if (!setup || !operation.patient || operation.patient->landmarks.empty()) {
    verdict.add(Grade::fail, words("verdict_no_overlay"));
    return {};
  }
  const Eigen::Vector3d tumour_mm = operation.patient->landmarks.front().place_mm;
  const auto tumour_as_shown_mm = [&](std::uint64_t shape) {
    return as_shown_mm(tumour_mm, shape == operation.shapes ? operation.deformed.get() : nullptr);
  };
  const auto by_shape =
      logged_target_errors(options.live.out, options.live.out / "truth", setup->camera(), tumour_as_shown_mm);
  if (!by_shape) return by_shape.error();
  // What is on the screen at the end is judged.
  const auto last = by_shape->find(operation.shapes);
  if (last == by_shape->end()) {
    verdict.add(Grade::fail, why_not_judged(*by_shape));
    return {};
  }
  const LoggedErrors& errors = last->second;
  const double p95_mm = percentile(errors.mm, 0.95);
  json["target_error_mm_p50"] = percentile(errors.mm, 0.5);
  json["target_error_mm_p95"] = p95_mm;
  json["target_error_mm_max"] = *std::max_element(errors.mm.begin(), errors.mm.end());
  if (!errors.expected_mm.empty()) json["expected_error_mm_p50"] = percentile(errors.expected_mm, 0.5);
  if (operation.deformed && last != by_shape->begin())
    json["target_error_before_deforming_mm_p50"] = percentile(std::prev(last)->second.mm, 0.5);
  verdict.add(p95_mm <= kTargetLimits.pass_mm       ? Grade::pass
              : p95_mm <= kTargetLimits.marginal_mm ? Grade::marginal
                                                    : Grade::fail,
              words("verdict_tumour", p95_mm, errors.mm.size()));
  return {};
}

Result<ExitCode> run(LiveOptions& options) {
  if (!options.language.empty()) {
    if (auto spoken = speak(options.language); !spoken) return spoken.error();
  }
  if (!options.list_texts.empty()) {
    if (auto written = write_file(options.list_texts, language_text()); !written) return written.error();
    return ExitCode::success;
  }
  std::optional<LiveScript> script;
  if (!options.script.empty()) {
    auto read = LiveScript::read(options.script);
    if (!read) return read.error();
    script = *std::move(read);
  }
  auto window = offer_simulated_cart(options, script);
  if (!window) return window.error();
  auto authors = Authors::of_this_machine(options.accept_unsigned);
  if (!authors) return authors.error();
  options.live.authors = *std::move(authors);
  const HostTime asked = host_now();
  if (auto prepared = prepare(options); !prepared) return prepared.error();
  std::optional<DecisionLog> log;
  if (!options.live.out.empty()) {
    auto opened = DecisionLog::open(options.live.out);
    if (!opened) return opened.error();
    log = *std::move(opened);
  }
  std::unique_ptr<Publisher> publisher;
  if (!options.publish.empty()) {
    auto listening = Publisher::listen(options.publish);
    if (!listening) return listening.error();
    publisher = *std::move(listening);
  }
  if (*window == nullptr) window = LiveWindow::open(options.window);
  if (!window) return window.error();
  std::unique_ptr<LiveSource> source;
  if (!options.recording.empty()) {
    auto admitted = admit_recording(options.recording, options.live.authors);
    if (!admitted) return admitted.error();
    options.live.recording_doubt = std::move(admitted->doubt);
    auto opened = LiveSource::of_recording(options.recording, options.speed, admitted->events_sha256);
    if (!opened) return opened.error();
    source = *std::move(opened);
  } else {
    source = options.simulate ? LiveSource::of_simulator(options.cart)
                              : LiveSource::of_appliance(options.server, options.foreign);
  }
  LiveApp app(*std::move(window), std::move(source), options.live, options.simulated, std::move(script), std::move(log),
              std::move(publisher));
  app.begin_with(options.look, options.light_room ? Room::light : Room::dark, options.identify);
  const auto ran = app.run(asked);
  app.finish();
  nlohmann::json json = json_of(app.figures(), app.operation());
  Verdict verdict;
  if (!ran) verdict.add(Grade::fail, ran.error().what);
  // What the window said to the last of what it could not take up, or keep.
  if (const std::string& fault = app.operation().fault; !fault.empty()) verdict.add(Grade::marginal, fault);
  if (app.log()) {
    if (auto closed = app.log()->close(); !closed) return closed.error();
    if (options.simulate) {
      if (auto judged = judge(options, app, json, verdict); !judged) return judged.error();
    }
  }
  json["verdict"] = name_of(verdict.grade);
  json["reasons"] = verdict.reasons;
  if (auto written = write_file(options.json, text_of(json)); !written) return written.error();
  for (const std::string& reason : verdict.reasons) print_line(reason);
  if (const auto patient = app.operation().patient) print_notes(patient->notes);
  if (!ran) return ran.error();
  return verdict.grade == Grade::fail ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_live(CLI::App& app, CommandStatus& status) {
  auto options = std::make_shared<LiveOptions>();
  options->cart.deformation_mm = 8;
  options->cart.dwell_s = 0.7;
  options->cart.pause_s = 8;
  options->cart.views = true;  // from several ports: from one alone, how far away the organ is stays uncertain
  options->cart.look_s = 3600;
  options->cart.drop_late = true;
  options->cart.smoothing_ms = 12;  // what is averaged after a frame, the frame has to wait for
  options->cart.wait_ms = 30;
  CLI::App* command = app.add_subcommand("live", "the window at the cart: live video, and the CT over it");
  command->add_option("--server", options->server, "the appliance, or another OpenIGTLink server of tracked video")
      ->type_name("[NAME@]HOST:PORT");
  add_foreign_options(*command, options->foreign);
  command->add_option("--recording", options->recording, "a session recording, or a PLUS sequence: played again")
      ->type_name("PATH");
  command->add_option("--speed", options->speed, "of the recording: 2 plays it twice as fast (default 1)")
      ->check(CLI::Range(0.05, 20.0));
  command->add_flag("--simulate", options->simulate, "a simulated cart and patient of its own, in --out");
  command->add_option("--seed", options->cart.seed, "with --simulate: another patient and other noise");
  command
      ->add_option("--deformation-mm", options->cart.deformation_mm,
                   "with --simulate: how far the liver has moved since the CT, where it has moved most (default 8)")
      ->check(CLI::Range(0.0, 30.0));
  command->add_option("--deformation", options->cart.deformation, "with --simulate: of which kind")
      ->check(CLI::IsMember(deformation_kinds()));
  command->add_option("--faults", options->cart.faults, "with --simulate: a script of faults")->type_name("FILE");
  command
      ->add_option("--fix-reference", options->cart.reference,
                   "with --simulate: patient or table, what a third bird, reference, is fixed on")
      ->check(CLI::IsMember({"patient", "table"}));
  command
      ->add_option("--video", options->video,
                   "with --simulate: the size of its video (default 512x384, which two "
                   "cores trace and overlay in time)")
      ->type_name("WxH");
  command->add_flag("--strokes", options->cart.strokes,
                    "with --simulate: the pointer strokes the liver's face after the fiducials");
  command->add_option("--look-s", options->cart.look_s, "with --simulate: how long the operation lasts")
      ->check(CLI::Range(1.0, 86400.0));
  PatientFiles& patient = options->live.patient;
  command->add_option("--ct", patient.ct.path, "the patient's CT")->type_name("PATH");
  add_ct_options(*command, patient.ct);
  command->add_option("--labels", patient.labels, "its segmentation: DICOM SEG, or labels on the CT's grid")
      ->type_name("FILE");
  command->add_option("--show", patient.shown, "labels to show, by name or number; without them, all of the CT")
      ->delimiter(',');
  command
      ->add_option("--organ", patient.organ,
                   "labels of the organ that the video shows, to match it with; needed with --labels")
      ->delimiter(',');
  command->add_option("--targets", patient.targets, "labels whose middles are landmarks to check by")->delimiter(',');
  command->add_option("--margins", patient.margins_mm, "shells so many mm from the targets, up to four: 5,10")
      ->delimiter(',')
      ->type_name("MM");
  command
      ->add_option("--patient-id", options->live.patient_id,
                   "the ID of the patient on the table, where another system knows it: a CT of another ID is refused, "
                   "and nobody is asked")
      ->type_name("ID");
  command->add_option("--fiducials", patient.fiducials, "the fiducials' places in the CT; without it, they are found")
      ->type_name("FILE");
  command->add_option("--fiducial-count", options->live.fiducials, "how many of them are to be touched");
  command->add_option("--landmarks", patient.landmarks, "a table name, x, y, z of places to check by")
      ->type_name("FILE");
  command->add_option("--board", options->board, "the board to calibrate with")->type_name("SPEC");
  command->add_option("--tip", options->tip, "the pointer's tip, by calibrate tip; else by the calibration record")
      ->type_name("FILE");
  command->add_option("--scope", options->live.scope, "the scope's bird (default scope)");
  command
      ->add_option("--rod-angle", options->live.rod_angle_deg,
                   "of a scope whose rod turns, degrees, as it is read off; Page Up and Page Down turn it on")
      ->check(CLI::Range(-360.0, 360.0));
  command->add_option("--pointer", options->live.pointer, "the pointer's bird (default pointer)");
  command->add_flag("!--no-motion-check", options->live.video_must_agree,
                    "of a scene without any pattern, as a plain phantom: do not wait until the video has been seen to "
                    "move as the scope's poses say");
  command->add_option("--reference", options->live.reference,
                      "the bird that is fixed on patient or table (default: the one that the appliance names, if any)");
  command->add_option("--transfer", options->live.transfer, "transfer function: a preset, or a file");
  command->add_option("--engine", options->live.engine, "cpu, gl, slices or auto (default cpu)")
      ->check(CLI::IsMember({"cpu", "gl", "slices", "auto"}));
  command->add_option("--size", options->size, "of the window (default 1280x720)")->type_name("WxH");
  command->add_option("--scale", options->window.scale, "of text and panels; without it, as the screen asks for")
      ->check(CLI::Range(0.5, 4.0));
  add_look_options(*command, options->look);
  command->add_flag("--light-room", options->light_room, "colours for a light room (default: a dark one)");
  command->add_flag("--identify", options->identify, "name the patient in snapshots (default: do not)");
  command->add_option("--language", options->language, "the window's words in another language")->type_name("FILE");
  command
      ->add_option("--list-texts", options->list_texts,
                   "write all of the window's words to a file, to translate, and end")
      ->type_name("FILE");
  command->add_option("--script", options->script, "keys to press and pictures to take")->type_name("FILE");
  command->add_option("--out", options->live.out, "a folder for snapshots and the log of frames")->type_name("FOLDER");
  command->add_option("--resume", options->live.resume, "the --out folder of a window that was closed: go on from it")
      ->type_name("FOLDER");
  command
      ->add_option("--publish", options->publish, "give 3D Slicer the registered CT over OpenIGTLink (default: do not)")
      ->type_name("[ADDRESS:]PORT");
  command->add_flag("--accept-unsigned", options->accept_unsigned,
                    "use also what is not signed, or signed by a machine that is not known here; the picture says so");
  command->add_option("--json", options->json, "figures and verdict")->type_name("FILE");
  command->callback([options, &status] {
    const auto done = run(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
