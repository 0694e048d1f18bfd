#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "calibration/base/verdict.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/interrupt.hpp"
#include "drivers/system/program.hpp"
#include "drivers/system/progress.hpp"
#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/app/overlay_options.hpp"
#include "host/files/files_sha256.hpp"
#include "host/files/registration_file.hpp"
#include "host/files/result_folder.hpp"
#include "host/files/write_files.hpp"
#include "host/operation/reference_sensor.hpp"
#include "host/operation/replay_player.hpp"
#include "host/operation/replay_setup.hpp"
#include "host/overlay/margins.hpp"
#include "host/overlay/render_scene.hpp"
#include "host/recording/recording_reader.hpp"
#include "host/recording/recording_signature.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
struct ReplayOptions {
  ReplayInputs inputs;
  VolumeSource volume;
  ShownChoice shown;
  OverlayLook look;
  fs::path deformation, out, json, live_log;
  std::string transfer = "tumour-and-vessels", engine = "cpu", scope = "scope";
  double film_hz = 0;
  int every = 10;
  bool motion_check = true, accept_unsigned = false;
};

constexpr double kMostHiddenToPass = 10;  // % of the frames

/// Why most frames are as they are: "most often, in 40 frames: the tracker is silent". Empty where nothing was wrong.
std::string most_often(const Replayed& done) {
  const auto reasons = alike_reasons(done.reasons);
  const auto most = std::ranges::max_element(reasons, {}, [](const auto& reason) { return reason.second; });
  return most == reasons.end() ? "" : fmt::format("most often, in {} frames: {}", most->second, most->first);
}

Verdict judge(const Replayed& done, const RecordingReader& reader, const ReplaySetup& setup, const ReplayTrust& trust,
              const std::map<std::string, std::string>& remedies, bool motion_check) {
  Verdict verdict;
  for (const auto& [why_not, remedy] : remedies) {
    const auto frames = done.reasons.find(why_not);
    if (frames == done.reasons.end()) continue;
    verdict.add(Grade::fail,
                fmt::format("{} of {} frames carry no overlay: {}; {}", frames->second, done.frames, why_not, remedy));
  }
  if (done.overlaid == 0) {
    verdict.add(Grade::fail, done.frames == 0 ? "the recording has no frames" : "no frame carries an overlay");
    verdict.add(Grade::fail, most_often(done));
  } else {
    const double hidden = 100 * (1 - static_cast<double>(done.overlaid) / static_cast<double>(done.frames));
    verdict.judge("frames without an overlay", hidden, "%", kMostHiddenToPass, 50, "see frames.csv for the reasons");
    if (hidden > kMostHiddenToPass) verdict.add(Grade::marginal, most_often(done));
  }
  if (done.other_size > 0) {
    verdict.add(Grade::fail, fmt::format("{} of {} frames are of another size than the camera was calibrated at; give "
                                         "the calibration of the camera that took them",
                                         done.other_size, done.frames));
  }
  if (motion_check && done.overlaid > 0 && !done.video_told)
    verdict.add(Grade::marginal, "the video does not show whether it moves as the poses say");
  for (const std::string& caution : setup.cautions) verdict.add(Grade::marginal, caution);
  for (const std::string& unproven : setup.hardware.unproven()) verdict.add(Grade::marginal, unproven);
  if (reader.frames_lost() > 0)
    verdict.add(Grade::marginal, fmt::format("{} frames are cut short or missing", reader.frames_lost()));
  for (const std::string& note : reader.notes()) verdict.add(Grade::marginal, note);
  for (const std::string& figure : trust.vouched_for)
    verdict.add(Grade::marginal, fmt::format("nothing states {}: how far the overlay may be off is not known", figure));
  return verdict;
}

nlohmann::json json_of(const Replayed& done, const ReplaySetup& setup, const ReplayTrust& trust,
                       const std::string& engine, const std::vector<std::string>& notes, const Verdict& verdict) {
  nlohmann::json json = {{"frames", done.frames},
                         {"frames_overlaid", done.overlaid},
                         {"frames_overlaid_whole", done.whole},
                         {"frames_of_other_size", done.other_size},
                         {"frames_of_other_hardware", done.other_hardware},
                         {"reasons_of_frames", alike_reasons(done.reasons)},
                         {"pictures_crc32", fmt::format("{:08x}", done.checksum)},
                         {"engine", engine},
                         {"notes", notes},
                         {"verdict", name_of(verdict.grade)},
                         {"reasons", verdict.reasons}};
  if (setup.by_touches && setup.touches > 0) json["touches"] = setup.touches;
  const TrustFigures& figures = trust.figures;
  const auto enter = [&](const char* name, const std::optional<double>& figure) {
    if (figure && std::ranges::count(trust.vouched_for, name) == 0) json[name] = *figure;
  };
  enter("fre_mm", figures.fre_mm);
  enter("camera_rms_px", figures.scope.camera_rms_px);
  enter("held_out_px", figures.scope.held_out_px);
  return json;
}

/// For people: by what it was registered, and what was written where.
void print_results(const ReplayOptions& options, const ReplaySetup& setup, const Replayed& done) {
  const std::string by = setup.touches > 0 ? fmt::format(", by {} touches", setup.touches) : "";
  print_line("fiducial registration error (FRE): " +
             (setup.fre_mm ? fmt::format("{:.2f} mm{}", *setup.fre_mm, by) : "not known"));
  const auto in_out = [&options](const char* name) { return (options.out / name).string(); };
  std::string written =
      fmt::format("wrote {}, {}, {}", in_out("frames.csv"), in_out("replay.json"), in_out("patient_from_tracker.txt"));
  if (options.film_hz > 0) written += ", " + in_out("overlay.mp4");
  print_line(fmt::format("{}; {} picture{} {}", written, done.pictures, done.pictures == 1 ? "" : "s",
                         in_out("overlay-*.png")));
}

/// All of the recording through the overlay. remedies: for why no overlay was drawn, what to do about it.
Result<void> play(RecordingReader& reader, const ReplayOptions& options, ReplayHardware& hardware, ReplayPlayer& player,
                  std::map<std::string, std::string>& remedies, Progress& progress) {
  ReferenceSensor reference;
  reference.use(options.inputs.reference, options.scope);
  std::string why_bare;  // nobody is there to look whether the registration still holds
  for (;;) {
    if (interrupted()) return Error{Errc::disconnected, "interrupted; what was drawn before is there"};
    const auto event = reader.next(Deadline::after(Duration::from_ms(30'000)));
    if (!event && event.error().code == Errc::disconnected) return {};
    if (!event) return event.error();
    if (!*event) continue;
    ReferenceSensor::Relative relative = reference.take(**event);
    if (relative.news != ReferenceSensor::News::none && why_bare.empty())
      why_bare = fmt::format("the reference \"{}\" was lost, came off or was pushed: register anew from there on",
                             reference.name());
    if (const auto* birds = std::get_if<wire::Birds>(&relative.event)) player.take(*birds);
    hardware.take(relative.event);
    auto* const frame = std::get_if<wire::VideoFrame>(&relative.event);
    if (frame == nullptr) continue;
    if (!why_bare.empty()) {
      frame->info.pose = PoseAnswer();
      frame->info.pose.reason = why_bare;
    }
    if (!hardware.why_not().empty()) remedies[hardware.why_not()] = hardware.remedy();
    if (auto taken = player.take(*frame, hardware.why_not()); !taken) return taken;
    if (player.done().frames % 20 == 0) progress(fmt::format("{} frames", player.done().frames));
  }
}

/// What it was replayed by. Of which CT it is, and how well it fits, it says only where that was found here or where
/// the file that brought it says so: what a person vouches for is not sealed.
RegistrationFile registration_of(const ReplaySetup& setup, const std::string& ct_sha256) {
  RegistrationFile out{setup.setup().tracker_from_patient().inverse()};
  if (setup.by_touches) {
    out.ct_sha256 = ct_sha256;
    out.fre_mm = setup.by_touches->fre_mm;
  } else if (setup.by_file) {
    out.ct_sha256 = setup.by_file->ct_sha256;
    out.fre_mm = setup.by_file->fre_mm;
  }
  return out;
}

ResultFolder folder_of(const ReplayOptions& options) {
  return {options.out, "replay", "replay.json",
          "frames\\.csv|patient_from_tracker\\.txt|overlay-[0-9]{6,}\\.png|overlay\\.mp4", "pictures_crc32"};
}

/// Those that may lie in the folder by a name of a replay's.
std::vector<fs::path> files_read(const ReplayOptions& options) {
  const ReplayInputs& inputs = options.inputs;
  return {inputs.patient_from_tracker,
          inputs.tracker_from_patient,
          inputs.camera_from_sensor,
          inputs.patient_from_model,
          inputs.fiducials,
          options.live_log};
}

Result<ExitCode> run(ReplayOptions& options) {
  if (options.out.empty()) return Error{Errc::bad_value, "--out: is empty; name a folder"};
  if (auto is_free = check_free(folder_of(options), files_read(options), {options.json}); !is_free)
    return is_free.error();
  auto authors = Authors::of_this_machine(options.accept_unsigned);
  if (!authors) return authors.error();
  options.inputs.authors = *std::move(authors);
  const auto admitted = admit_recording(options.inputs.recording, options.inputs.authors);
  if (!admitted) return admitted.error();
  options.inputs.events_sha256 = admitted->events_sha256;
  auto reader = RecordingReader::open(
      options.inputs.recording,
      {.speed = 0, .transform = options.inputs.transform, .events_sha256 = options.inputs.events_sha256});
  if (!reader) return reader.error();
  for (const fs::path* file : {&options.inputs.patient_from_model, &options.deformation}) {
    if (file->empty()) continue;
    if (auto same = check_against_sheet(*file); !same) return same.error();
  }
  auto setup = read_replay_setup(options.inputs);
  if (!setup) return setup.error();
  if (!admitted->doubt.empty())
    setup->cautions.push_back(words("why_unsigned", words("unsigned_recording"), admitted->doubt));
  ShownChoice choice = options.shown;
  choice.summed = true;  // what is replayed by, and what is written, says which CT it is of
  const auto fiducials_inside = [&](const Volume& ct) -> Result<void> {
    if (!setup->by_touches || options.inputs.fiducials.empty()) return {};  // a window's were looked at there
    return check_places(setup->by_touches->fiducials_in_patient_mm, ct).with_context(options.inputs.fiducials.string());
  };
  const auto shown = read_shown(options.volume, choice, fiducials_inside);
  if (!shown) return shown.error();
  print_notes(shown->notes);
  if (setup->operation) {
    if (auto same = check_patient(*setup->operation, shown->ct_sha256, shown->labels_sha256); !same)
      return same.error().with_context("--operation " + options.inputs.operation.string());
  }
  if (setup->by_file) {
    if (auto same = check_ct(*setup->by_file, shown->ct_sha256); !same)
      return same.error().with_context(options.inputs.patient_from_tracker.string());
  }
  const Volume* const volume = &shown->volume;
  const auto transfer = load_transfer_function(options.transfer);
  if (!transfer) return transfer.error();
  std::optional<Margins> margins = shown->margins;
  const auto engine = make_engine(options.engine, *volume, *transfer);
  if (!engine) return engine.error();
  if (!(*engine)->choice().empty()) fmt::print(stderr, "{}\n", (*engine)->choice());
  std::optional<DisplacementField> field;
  if (!options.deformation.empty()) {
    auto read = read_field(options.deformation);
    if (!read) return read.error();
    if (auto covers = check_covers(*read, *volume); !covers)
      return covers.error().with_context(options.deformation.string());
    field = *std::move(read);
  }
  if (setup->operation && setup->operation->deformed) field = setup->operation->deformed->field;
  if (field) {
    (*engine)->deform(*field);
    if (margins) margins = deformed(*margins, *field);
  }
  std::map<std::uint64_t, LoggedDecision> live;
  if (!options.live_log.empty()) {
    auto decisions = read_decisions(options.live_log);
    if (!decisions) return decisions.error().with_context("--live-log");
    for (LoggedDecision& decision : *decisions) live.insert_or_assign(decision.sequence, std::move(decision));
  }
  if (auto emptied = make_empty(folder_of(options), files_read(options)); !emptied) return emptied.error();
  note_interrupts();
  ::signal(SIGPIPE, SIG_IGN);  // of an encoder that ended
  Progress progress;
  const ReplayTrust trust = trust_of(*setup, *volume);
  ReplayPlayer player({options.out, options.every, options.film_hz, options.look, options.scope, options.motion_check,
                       trust.vouched_for.empty(), std::move(live)},
                      *setup, trust.figures, **engine, std::move(margins));
  std::map<std::string, std::string> remedies;
  if (auto played = play(**reader, options, setup->hardware, player, remedies, progress); !played)
    return played.error();
  if (const std::string fault = (*engine)->fault(); !fault.empty())
    return Error{Errc::io, fmt::format("{}: {}; use --engine cpu", (*engine)->name(), fault)};
  if (auto finished = player.finish(); !finished) return finished.error();
  const Verdict verdict = judge(player.done(), **reader, *setup, trust, remedies, options.motion_check);
  nlohmann::json figures = json_of(player.done(), *setup, trust, (*engine)->name(), shown->notes, verdict);
  figures["files"] = files_of(folder_of(options));  // the next replay may replace these, and no others
  for (const char* name : {"frames.csv", "patient_from_tracker.txt"}) figures["files"].push_back(name);
  const std::string json = text_of(figures);
  const std::string registration = registration_text(registration_of(*setup, shown->ct_sha256));
  if (auto written = write_files({{options.out / "frames.csv", player.done().table},
                                  {options.out / "patient_from_tracker.txt", registration},
                                  {options.out / "replay.json", json},
                                  {options.json, json}});
      !written) {
    return written.error();
  }
  progress.keep(fmt::format("{} frames, {} with an overlay, pictures {:08x}: {}", player.done().frames,
                            player.done().overlaid, player.done().checksum, name_of(verdict.grade)));
  for (const std::string& reason : verdict.reasons) print_line(reason);
  print_results(options, *setup, player.done());
  return verdict.grade == Grade::fail ? ExitCode::verdict_fail : ExitCode::success;
}

/// Gives those that an operation stands in place of.
std::vector<CLI::Option*> add_inputs(CLI::App& command, ReplayInputs& inputs) {
  command.add_option("recording", inputs.recording, "a session recording (a folder), or a .igs.mha")->required();
  command.add_option("--transform", inputs.transform, "of a .igs.mha: which transform is the scope's");
  std::vector<CLI::Option*> out{
      command.add_option("--calibration,--record", inputs.calibration,
                         "the calibration record (default: the recording's own)"),
      command.add_option("--camera", inputs.camera,
                         "lens (of OpenCV, ROS or Kalibr), in place of the calibration record's"),
      command.add_option("--camera-from-sensor", inputs.camera_from_sensor, "hand-eye, a 4x4 matrix, mm"),
      command.add_option("--registration", inputs.patient_from_tracker, "patient_from_tracker, of register fiducials"),
      command.add_option("--tracker-from-patient", inputs.tracker_from_patient, "its inverse, as the demo writes it")};
  CLI::Option* const fiducials = command.add_option(
      "--fiducials", inputs.fiducials, "markers in the CT, which the pointer touches in the recording: registers anew");
  command.add_option("--tip", inputs.tip, "the pointer's tip, x y z, mm (default: the calibration record's)")
      ->needs(fiducials);
  command.add_option("--pointer", inputs.pointer, "the bird that touches (default pointer)")->needs(fiducials);
  command.add_option("--reference", inputs.reference,
                     "the bird that was fixed on patient or table: poses are taken relative to it");
  command.add_option("--touched", inputs.touched_s, "from and to, s: when it touches")->expected(2)->needs(fiducials);
  out.insert(out.end(),
             {fiducials, command.add_option("--model-pose", inputs.patient_from_model, "pose.txt of register views"),
              command.add_option("--camera-rms-px", inputs.camera_rms_px,
                                 "how well the lens is known, where no calibration record says"),
              command.add_option("--hand-eye-rms-px", inputs.held_out_px, "and hand-eye"),
              command.add_option("--fre-mm", inputs.fre_mm, "and the registration")});
  command
      .add_option("--rod-angle", inputs.rod_angle_deg,
                  "of a scope whose rod turns, degrees, as it was read off when it was recorded")
      ->check(CLI::Range(-360.0, 360.0));
  return out;
}

}  // namespace

void add_replay(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<ReplayOptions>();
  options->look.render.step_mm = 1.2;
  CLI::App& command = *app.add_subcommand("replay", "draw the CT over a recording, the same to the bit each time");
  std::vector<CLI::Option*> replaced = add_inputs(command, options->inputs);
  command.add_option("--volume", options->volume.path, "the CT")->required();
  add_ct_options(command, options->volume);
  add_shown_options(command, options->shown);
  add_look_options(command, options->look);
  command.add_option("--transfer", options->transfer, "preset or JSON file (default tumour-and-vessels)");
  replaced.push_back(command.add_option("--deformation", options->deformation, "ITK displacement field, LPS mm"));
  command.add_flag("!--no-motion-check", options->motion_check,
                   "of a scene without any pattern, as a plain phantom: do not ask whether the video moves as the "
                   "scope's poses say");
  CLI::Option* const operation =
      command.add_option("--operation", options->inputs.operation, kOperationHelp)->type_name("FOLDER|FILE");
  for (CLI::Option* const option : replaced) operation->excludes(option);
  command.add_option("--engine", options->engine, "auto, cpu, gl or slices (default cpu)")
      ->check(CLI::IsMember(engine_names()));
  command.add_option("--step-mm", options->look.render.step_mm, "between samples along a ray")
      ->check(CLI::Range(0.05, 20.0));
  command.add_option("--out", options->out, "folder for pictures, frames.csv and replay.json")->required();
  command.add_option("--scope", options->scope, "the scope's bird (default scope)");
  command.add_option("--every", options->every, "writes one frame in so many as a picture (default 10)")
      ->check(CLI::Range(1, 1'000'000));
  command.add_option("--film", options->film_hz, "also overlay.mp4, of so many frames a second")
      ->check(CLI::Range(1.0, 1000.0));
  command
      .add_option("--live-log", options->live_log,
                  "what live --out wrote: frames.csv then says of each frame what the window decided, too")
      ->type_name("FOLDER|FILE");
  command.add_flag("--accept-unsigned", options->accept_unsigned,
                   "use also what is not signed, or signed by a machine that is not known here; the verdict says so");
  command.add_option("--json", options->json, "write the figures to this file too");
  command.callback([options, &status] {
    const auto done = run(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
