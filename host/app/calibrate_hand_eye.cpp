#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "calibration/base/units.hpp"
#include "drivers/system/program.hpp"
#include "host/app/calibrate_commands.hpp"
#include "host/app/pose_options.hpp"
#include "host/app/results.hpp"
#include "host/calibrate/hand_eye_files.hpp"
#include "host/calibrate/hand_eye_report.hpp"
#include "host/calibrate/hand_eye_rod.hpp"
#include "host/calibrate/hand_eye_solution.hpp"
#include "host/calibrate/picture_views.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/column_names.hpp"
#include "host/files/text_files.hpp"
#include "host/guide/live_hand_eye.hpp"
#include "host/link/appliance_hardware.hpp"
#include "host/recording/recording_reader.hpp"

namespace birdseye::host {

namespace {

struct CalibrateHandEyeOptions {
  HandEyeFiles files;
  std::filesystem::path rod_angles;
  bool live = false;
  std::filesystem::path recording;
  LivePlan plan;
  PoseOptions poses_are;
  std::string eye_direction;            ///< empty where it is not said: marker_from_camera
  std::string eye_unit, eye_time_unit;  ///< empty where it is not said: as of all files
  std::vector<double> at;
  std::string pixel_aspect = "1";
  double position_sigma_mm = 0, angle_sigma_deg = 0;
  ResultPaths results;
};

Result<void> check_right(const HandEyeFiles& files) {
  if (files.right_camera.empty() != files.right_from_left.empty())
    return Error{Errc::bad_value, "give --right-camera and --right-from-left together"};
  if (files.right_images.empty() && files.right_points.empty()) {
    if (files.right_camera.empty()) return {};
    return Error{Errc::bad_value, "--right-images is missing: which pictures are the right camera's?"};
  }
  if (files.points.empty() != files.right_points.empty() || !files.right_images.empty() == !files.right_points.empty())
    return Error{Errc::bad_value, "--right-points goes with --points, the left camera's"};
  if (files.images.empty() && files.points.empty())
    return Error{Errc::bad_value, "--right-images goes with --images, the left camera's"};
  if (files.camera.empty() == files.right_camera.empty()) return {};
  return Error{Errc::bad_value,
               "with --right-images give --camera, --right-camera and --right-from-left, or none of them: both lenses "
               "are then calibrated from the pictures"};
}

/// Refuses, by its name, what was given and would be of no effect.
Result<void> check_use(const CLI::App& command, const CalibrateHandEyeOptions& options) {
  const HandEyeFiles& files = options.files;
  const bool recorded = !options.recording.empty();
  if (!options.live) {
    if (auto fine = refuse_given(command, {"--server", "--stations", "--seconds"}, "goes with --live"); !fine)
      return fine;
  }
  if (!options.live && !recorded) {
    if (auto fine = refuse_given(command, {"--bird", "--keep", "--most-stations"}, "goes with --live or --recording");
        !fine)
      return fine;
  } else if (auto fine = refuse_given(command,
                                      {"--poses", "--transform", "--body", "--board-poses", "--unit", "--time-unit",
                                       "--column-major", "--poses-are", "--max-error", "--size"},
                                      recorded ? "goes with files, and --recording takes their place"
                                               : "goes with files, and --live takes none");
             !fine) {
    return fine;
  }
  if (files.board_poses.empty()) {
    if (auto fine = refuse_given(command, {"--board-transform", "--board-body"}, "goes with --board-poses"); !fine)
      return fine;
  }
  if (files.points.empty() && !files.size.empty()) return Error{Errc::bad_value, "--size goes with --points"};
  if (files.eye_poses.empty())
    return refuse_given(command, {"--eye-transform", "--eye-unit", "--eye-time-unit", "--eye-poses-are"},
                        "goes with --eye-poses");
  return refuse_given(command, {"--board"}, "goes with pictures, and --eye-poses takes their place");
}

Result<void> check(const CalibrateHandEyeOptions& options) {
  const HandEyeFiles& files = options.files;
  const int sources = (options.live ? 1 : 0) + (files.images.empty() ? 0 : 1) + (files.points.empty() ? 0 : 1) +
                      (files.eye_poses.empty() ? 0 : 1) + (options.recording.empty() ? 0 : 1);
  if (sources != 1) {
    return Error{Errc::bad_value,
                 "give one of --images (with --board), --points, --eye-poses and --live, or a --recording"};
  }
  if (files.eye_poses.empty() && files.points.empty() && files.board.empty())
    return Error{Errc::bad_value, "--board is missing: which pattern is looked at?"};
  const bool guided = options.live || !options.recording.empty();
  if (!guided && files.poses.empty())
    return Error{Errc::bad_value, "--poses is missing: where was the tracker's sensor?"};
  if (const auto sound = check_right(files); !sound) return sound.error();
  if (!options.at.empty() && files.eye_poses.empty())
    return Error{Errc::bad_value, "--at goes with --eye-poses, in whose world it is"};
  if (!options.rod_angles.empty() && files.images.empty() && files.points.empty())
    return Error{Errc::bad_value, "--rod-angles goes with --images, whose pictures it names"};
  if (files.pixel_aspect != 1 && files.images.empty() && files.points.empty())
    return Error{Errc::bad_value, "--pixel-aspect goes with --images"};
  if (guided && !options.poses_are.field.empty())
    return Error{Errc::bad_value, "--field goes with --poses: an appliance corrects by its own [calibration] field"};
  if ((options.position_sigma_mm > 0) != (options.angle_sigma_deg > 0))
    return Error{Errc::bad_value, "give --position-sigma and --angle-sigma together"};
  return {};
}

/// How the files of poses are to be read. What the camera saw is not the tracker's, and no map of its field corrects
/// it.
void read_how(CalibrateHandEyeOptions& options, const AdmittedField& field) {
  const PoseReading how = pose_reading(options.poses_are, field.map);
  HandEyeFiles& files = options.files;
  for (PoseReading* tracked : {&files.of_sensor, &files.of_board}) {
    tracked->mm_per_unit = how.mm_per_unit;
    tracked->unit_said = how.unit_said;
    tracked->s_per_unit = how.s_per_unit;
    tracked->column_major = how.column_major;
    tracked->inverted = how.inverted;
    tracked->field = how.field;
    tracked->most_error_mm = how.most_error_mm;
  }
  files.of_board.option_prefix = "board-";
  files.of_eye.option_prefix = "eye-";
  files.of_eye.mm_per_unit = mm_per(options.eye_unit).value_or(how.mm_per_unit);
  files.of_eye.unit_said = how.unit_said || !options.eye_unit.empty();
  files.of_eye.s_per_unit = options.eye_time_unit.empty() ? how.s_per_unit : seconds_per(options.eye_time_unit);
  files.of_eye.column_major = how.column_major;
  files.of_eye.inverted = options.eye_direction == "camera_from_marker";
}

/// A hand-eye goes into a record beside the lens it was made with, and no other.
Result<void> check_record(const CalibrateHandEyeOptions& options) {
  const auto& path = options.results.record;
  std::error_code ignored;
  const bool there = std::filesystem::exists(path, ignored);
  if (path.empty() || (!there && options.files.camera.empty())) return {};
  std::optional<CameraModel> recorded;
  if (there) {
    const auto read = read_signed_record(path);
    if (!read) return read.error();
    if (read->record.lens) recorded = read->record.lens->camera;
  }
  if (options.files.camera.empty()) return {};
  const auto camera = read_camera(options.files.camera);
  if (!camera) return camera.error();
  if (recorded == *camera) return {};
  return Error{Errc::bad_value,
               fmt::format("{}: its lens is not that of {}: enter that first (birdseye calibrate camera --record), or "
                           "leave out --camera",
                           path.string(), options.files.camera.string())};
}

/// Of an appliance that runs, or of a recording of one.
Result<HandEyeRecording> record_live(const CalibrateHandEyeOptions& options, const AdmittedRecording& recording) {
  LivePlan plan = options.plan;
  auto pattern = calibration::parse_pattern(options.files.board);
  if (!pattern) return pattern.error();
  plan.guide.pattern = *std::move(pattern);
  if (!options.files.camera.empty()) {
    auto camera = read_camera(options.files.camera);
    if (!camera) return camera.error();
    plan.guide.camera = *camera;
  }
  Progress progress;
  Result<GuidedStations> session = Error{};
  if (options.recording.empty()) {
    session = guide_hand_eye(plan, progress);
  } else {
    const auto reader = RecordingReader::open(options.recording, {.events_sha256 = recording.events_sha256});
    if (!reader) return reader.error();
    session = stations_of_recording(**reader, plan.guide, progress);
    if (!session) return session.error().with_context(options.recording.string());
  }
  if (!session) return session.error();
  HandEyeRecording out;
  out.input = std::move(session->input);
  if (!options.files.camera.empty()) {
    const auto covariance = read_camera_covariance(options.files.camera);
    if (!covariance) return covariance.error();
    out.input.camera_covariance = *covariance;
  }
  out.notes.push_back("ended: " + session->ended);
  if (!plan.guide.camera) {
    if (session->lens) {
      out.camera_verdict = calibration::judge_camera(*session->lens);
      out.input.camera_covariance = session->lens->covariance;
    } else {
      out.camera_verdict.add(Grade::fail, "no lens was found: " + session->lens_fault,
                             "hold the scope still at more stations, tilted another way at each");
    }
    out.lens = std::move(session->lens);
  }
  out.round_field = session->round_field;
  return out;
}

/// Hand-eye, and the lens it was found with where that is new.
RecordEntry entry_of(const CalibrateHandEyeOptions& options, const HandEyeRecording& recording,
                     const HandEyeFound& found, const std::string& doubt) {
  const HandEyeFiles& files = options.files;
  std::string what = !files.board.empty()    ? files.board
                     : !files.points.empty() ? files.points.filename().string()
                                             : files.eye_poses.filename().string();
  if (files.pixel_aspect != 1) what += fmt::format(", pixel aspect {:.4g}", files.pixel_aspect);
  return {fmt::format("{}, {} stations", what, recording.input.stations.size()),
          [&](calibration::CalibrationRecord& record, const calibration::Provenance& provenance) {
            if (const auto& lens = recording.lens) {
              record.hand_eye.reset();  // the new one is entered below
              enter_lens(record, {provenance, lens->camera, name_of(lens->model), lens->covariance, lens->rms_px,
                                  lens->held_out_px, std::nullopt, recording.round_field});
            }
            const calibration::HandEyeResult& r = found.result;
            record.hand_eye =
                calibration::HandEyeEntry{provenance,    r.camera_from_sensor, r.covariance, r.rms_px,
                                          r.held_out_px, r.held_out_mm,        std::nullopt, r.independent_stations};
            if (found.rod && found.rod->scope) {
              const RodScope& rod = *found.rod->scope;
              record.hand_eye->rod = calibration::RodEntry{found.rod->at_reference().angle_deg, rod.axis_in_sensor,
                                                           rod.axis_point_in_sensor_mm, rod.picture_turn};
            }
          },
          doubt};
}

void finish(const CalibrateHandEyeOptions& options, const HandEyeRecording& recording, const HandEyeFound& found,
            const std::string& doubt, CommandStatus& status) {
  const calibration::HandEyeResult& result = found.result;
  for (const std::string& note : recording.notes) print_line(note);
  if (recording.stream_correlation > 0 && result.solved) {
    const double late_ms = -1000 * (recording.stream_offset_s + result.time_offset_s.value_or(0));
    fmt::print("the times of the pictures are {:.1f} +- {:.1f} ms too {} against those of the poses\n",
               std::abs(late_ms), 1000 * result.time_offset_sigma_s, late_ms > 0 ? "late" : "early");
  }
  nlohmann::json json = hand_eye_json(result, recording);
  if (options.files.pixel_aspect != 1) json["pixel_aspect"] = options.files.pixel_aspect;
  HtmlPage page = hand_eye_page(result, recording);
  if (found.rod) {
    json["rod"] = rod_json(*found.rod);
    add_rod_to(page, *found.rod);
  }
  finish_calibration(options.results, result.solved ? pose_text(result.camera_from_sensor.matrix()) : "",
                     std::move(json), std::move(page), found.verdict, status,
                     entry_of(options, recording, found, doubt));
}

void run(const CLI::App& command, CalibrateHandEyeOptions& options, CommandStatus& status) {
  HandEyeFiles& files = options.files;
  const auto aspect = parse_pixel_aspect(options.pixel_aspect);
  if (!aspect) return status.refuse(aspect.error());
  files.pixel_aspect = *aspect;
  if (const auto sound = check(options); !sound) return status.refuse(sound.error());
  if (const auto used = check_use(command, options); !used) return status.refuse(used.error());
  const auto field = admit_field(options.poses_are.field, options.live ? options.plan.server : "", options.results);
  if (!field) return status.refuse(field.error());
  read_how(options, *field);
  if (const auto sound = check_record(options); !sound) return status.refuse(sound.error());
  if (!options.at.empty())
    files.at_mm = files.of_eye.mm_per_unit * Eigen::Vector3d(options.at[0], options.at[1], options.at[2]);
  if (options.live) {
    const auto fits = check_bound_record(options.results.record, options.plan.server, {"tracker", "camera"});
    if (!fits) return status.refuse(fits.error());
  }
  RodAngles angles;
  if (!options.rod_angles.empty()) {
    auto read = read_rod_angles(options.rod_angles);
    if (!read) return status.refuse(read.error());
    angles = *std::move(read);
  }
  const auto source =
      admit_sources({options.recording, files.poses, files.board_poses, files.eye_poses}, options.results);
  if (!source) return status.refuse(source.error());
  auto recording =
      options.live || !options.recording.empty() ? record_live(options, *source) : read_hand_eye_stations(files);
  if (!recording) return status.refuse(recording.error());
  if (options.position_sigma_mm > 0)
    recording->input.tracker_noise =
        calibration::TrackerNoise{options.position_sigma_mm, options.angle_sigma_deg * kRadPerDeg};
  recording->directions_said = !options.poses_are.direction.empty() && !options.eye_direction.empty();
  recording->input.sensor_inverted = files.of_sensor.inverted;
  recording->input.eye_inverted = files.of_eye.inverted;
  auto found = solve_hand_eye(*recording, angles, !files.eye_poses.empty());
  if (!found) return status.refuse(found.error());
  const std::string doubt = tell_doubts(*source, *field, found->verdict);
  finish(options, *recording, *found, doubt, status);
}

}  // namespace

void add_calibrate_hand_eye(CLI::App& calibrate, CommandStatus& status) {
  auto options = std::make_shared<CalibrateHandEyeOptions>();
  HandEyeFiles& files = options->files;
  CLI::App* command = calibrate.add_subcommand("hand-eye", "where the camera sits on its sensor");
  command->add_option("--board", files.board, "pattern in the pictures, as chessboard:14x10:3mm")->type_name("SPEC");
  command->add_option("--images", files.images, "pictures of the board, or folders of them")->type_name("PATH");
  command->add_option("--points", files.points, "a folder of points that were found before, in place of pictures")
      ->type_name("FOLDER");
  command->add_option("--size", files.size, "of the pictures that --points come from, as 1920x1080")->type_name("WxH");
  command
      ->add_option("--pixel-aspect", options->pixel_aspect,
                   "a pixel's width over its height: 0.5 (or 1:2) of field-squeezed video, as 1920x540")
      ->type_name("RATIO");
  command->add_option("--poses", files.poses, "tracked poses of the sensor, one for each picture")->type_name("PATH");
  command->add_option("--transform,--tool", files.of_sensor.transform,
                      "whose poses, where --poses holds those of several tools");
  command
      ->add_option("--body", files.of_sensor.body,
                   "points of a body in place of a sensor, name,x,y,z a line: --poses is a table of where these were "
                   "tracked")
      ->type_name("FILE");
  command->add_option("--board-body", files.of_board.body, "the same of --board-poses")->type_name("FILE");
  command->add_option("--board-poses", files.board_poses, "tracked poses of what carries the board, if it moves")
      ->type_name("PATH");
  command->add_option("--board-transform,--board-tool", files.of_board.transform, "the same of --board-poses");
  command->add_option("--eye-transform,--eye-tool", files.of_eye.transform, "the same of --eye-poses");
  command
      ->add_option("--camera", files.camera,
                   "lens (of OpenCV, ROS or Kalibr); without it, calibrated from the pictures")
      ->type_name("FILE");
  command->add_option("--right-images", files.right_images, "the right camera's, which pair with --images by name")
      ->type_name("PATH");
  command->add_option("--right-points", files.right_points, "the right camera's points, likewise")->type_name("FOLDER");
  command->add_option("--right-camera", files.right_camera, "the right lens, as --camera")->type_name("FILE");
  command
      ->add_option("--right-from-left", files.right_from_left,
                   "4x4 matrix, left to right camera, mm: with --right-camera")
      ->type_name("FILE");
  command
      ->add_option("--eye-poses", files.eye_poses,
                   "instead of pictures, poses of the camera in the board's frame; by time if both have times")
      ->type_name("PATH");
  add_eye_unit(*command, options->eye_unit);
  add_eye_time_unit(*command, options->eye_time_unit);
  command
      ->add_option("--eye-poses-are", options->eye_direction,
                   "what --eye-poses are: marker_from_camera, where the camera is in the board's frame (default), or "
                   "camera_from_marker, where the board is in the camera's, as OpenCV and ArUco find it")
      ->check(CLI::IsMember({"marker_from_camera", "camera_from_marker"}));
  command
      ->add_option("--at", options->at,
                   "with --eye-poses: the point of their world at which hand-eye is judged, in their unit")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::Range(-1e6, 1e6))
      ->type_name("X,Y,Z");
  add_pose_options(*command, options->poses_are);
  command->add_option("--position-sigma", options->position_sigma_mm, "the tracker's noise per axis, mm")
      ->check(CLI::PositiveNumber);
  command->add_option("--angle-sigma", options->angle_sigma_deg, "the tracker's noise per axis, degrees")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--rod-angles", options->rod_angles,
                   "of an oblique scope: at what its rod stood, as lines of picture,degrees")
      ->type_name("FILE");
  command->add_flag("--live", options->live, "be guided, with an appliance that runs, in place of files");
  command
      ->add_option("--recording", options->recording,
                   "a session recording, in place of files: each rest of the scope over the board is a station")
      ->type_name("FOLDER");
  LivePlan& plan = options->plan;
  command->add_option("--server", plan.server, "with --live: the appliance (default 127.0.0.1)")
      ->type_name("[NAME@]HOST:PORT");
  command->add_option("--bird", plan.guide.bird,
                      "with --live or --recording: the scope's bird, by its name (default: scope)");
  command->add_option("--keep", plan.guide.keep, "likewise: a folder for the views, pictures and poses of the stations")
      ->type_name("FOLDER");
  command->add_option("--stations", plan.guide.fewest_stations, "with --live: the fewest (default 12)")
      ->check(CLI::Range(6, 100));
  command->add_option("--most-stations", plan.guide.most_stations, "likewise: then it ends in any case (default 40)")
      ->check(CLI::Range(6, 200));
  command->add_option("--seconds", plan.seconds, "with --live: then it ends in any case (default 300)")
      ->check(CLI::Range(5.0, 7200.0));
  add_result_options(*command, options->results, "camera_from_sensor, a 4x4 matrix, mm");
  allow_unsigned_sources(*command);
  command->callback([options, command, &status] { run(*command, *options, status); });
}

}  // namespace birdseye::host
