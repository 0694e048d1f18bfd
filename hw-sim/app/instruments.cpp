#include "hw-sim/app/instruments.hpp"

#include <algorithm>
#include <cstdio>
#include <memory>

#include "calibration/base/picture_size.hpp"
#include "drivers/system/interrupt.hpp"
#include "hw-sim/app/kept_inputs.hpp"
#include "hw-sim/faults/fault_script.hpp"
#include "hw-sim/ftdi/ft232r_program.hpp"
#include "hw-sim/minibird/program.hpp"
#include "hw-sim/video/program.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr const char* kJitterHelp =
    "mean of an exponential lateness of delivery, cut at 4 times the mean; never early, never out of order";
constexpr const char* kDriftHelp = "by which the instrument's own clock runs fast";

/// "3.67": the two numbers as the unit sends them.
Result<void> parse_revision(const std::string& text, UnitSettings& unit) {
  int major = 0, minor = 0, read = 0;
  if (std::sscanf(text.c_str(), "%d.%d%n", &major, &minor, &read) == 2 &&
      static_cast<std::size_t>(read) == text.size() && major >= 0 && major <= 255 && minor >= 0 && minor <= 255) {
    unit.revision_major = static_cast<std::uint8_t>(major);
    unit.revision_minor = static_cast<std::uint8_t>(minor);
    return {};
  }
  return Error{Errc::bad_value, "--revision: give two numbers of 0 to 255 with a dot, as 3.67"};
}

struct MiniBirdOptions {
  MiniBirdProgram program;
  std::string revision = "3.67";
  std::filesystem::path faults;
};

/// Settles what the command line gives as text.
Result<void> finish(MiniBirdOptions& options) {
  TrackerSettings& tracker = options.program.tracker;
  if (auto parsed = parse_revision(options.revision, tracker.unit); !parsed) return parsed;
  if (!options.faults.empty()) {
    auto script = read_fault_script(options.faults, Instruments::tracker, tracker.seed);
    if (!script) return script.error();
    tracker.faults = std::move(script->tracker);
  }
  return {};
}

Result<void> run(MiniBirdOptions& options) {
  if (auto kept = keep_inputs({options.program.truth}, {options.faults}); !kept) return kept;
  if (auto finished = finish(options); !finished) return finished;
  return run_minibird(options.program, note_interrupts());
}

/// The tracker behind a USB adapter.
struct Ft232rOptions {
  MiniBirdOptions behind;
  Ft232rProgram program;
};

Result<void> run(Ft232rOptions& options) {
  if (auto finished = finish(options.behind); !finished) return finished;
  options.program.tracker = options.behind.program.tracker;
  options.program.motion = options.behind.program.motion;
  options.program.period_s = options.behind.program.period_s;
  return run_ft232r(options.program, note_interrupts());
}

struct VideoOptions {
  CameraProgram program;
  std::string size = "1920x1080", format = "RGB3";
  bool no_stamps = false;
  std::filesystem::path faults;
};

Result<void> run(VideoOptions& options) {
  CameraProgram& program = options.program;
  if (auto kept = keep_inputs({program.truth, program.strobe}, {options.faults, program.post}); !kept) return kept;
  if (auto parsed = parse_size(options.size, program.width_px, program.height_px); !parsed) return parsed;
  if (program.width_px % 2 != 0 || program.height_px % 2 != 0) {
    return Error{Errc::bad_value, "--size: give even numbers, as 1920x1080"};
  }
  const auto format = frame_format_of(options.format);
  if (!format) return Error{Errc::bad_value, "--format: is none of RGB3, YUYV, UYVY, NV12, GREY"};
  program.format = *format;
  if (!program.post.empty() && *format != FrameFormat::rgb3) {
    return Error{Errc::bad_value, "--post: is drawn as RGB3 alone; leave out --format"};
  }
  program.timing.stamps = !options.no_stamps;
  if (!options.faults.empty()) {
    auto script = read_fault_script(options.faults, Instruments::camera, program.timing.seed);
    if (!script) return script.error();
    program.timing.faults = std::move(script->camera);
  }
  return run_camera(program, note_interrupts());
}

}  // namespace

Result<void> parse_size(const std::string& text, int& width_px, int& height_px) {
  const auto size = parse_picture_size(text);
  if (!size || std::min(size->width_px, size->height_px) < 64 || std::max(size->width_px, size->height_px) > 4096)
    return Error{Errc::bad_value, "--size: give WIDTHxHEIGHT of 64 to 4096 pixels, as 768x576"};
  width_px = size->width_px;
  height_px = size->height_px;
  return {};
}

namespace {

/// What a tracker can be told at any kind of line.
void add_tracker_options(CLI::App& command, MiniBirdOptions& options) {
  MiniBirdProgram& program = options.program;
  TrackerSettings& tracker = program.tracker;
  tracker.boot_ms = 1000;
  command.add_option("--birds", tracker.unit.birds, "in the flock")->check(CLI::Range(1, 126));
  command.add_option("--motion", program.motion, "circle, pivot (a tip in a divot) or still")
      ->check(CLI::IsMember({"circle", "pivot", "still"}));
  command.add_option("--period-s", program.period_s, "of the circle")->check(CLI::Range(0.5, 3600.0));
  command.add_option("--position-noise-mm", tracker.noise.position_mm, "per axis and record")
      ->check(CLI::Range(0.0, 50.0));
  command.add_option("--angle-noise-deg", tracker.noise.angle_deg, "per axis and record")->check(CLI::Range(0.0, 20.0));
  command.add_option("--distortion-mm", tracker.distortion_mm, "largest displacement by metal in the room")
      ->check(CLI::Range(0.0, 500.0));
  command.add_option("--delay-ms", tracker.delay_ms, "from measurement to first byte")->check(CLI::Range(0.0, 1000.0));
  command.add_option("--jitter-ms", tracker.jitter_ms, kJitterHelp)->check(CLI::Range(0.0, 1000.0));
  command.add_option("--drift-ppm", tracker.drift_ppm, kDriftHelp)->check(CLI::Range(-10'000.0, 10'000.0));
  command.add_option("--boot-ms", tracker.boot_ms, "of silence after power-up and reset")
      ->check(CLI::Range(0.0, 60'000.0));
  command.add_option("--baud", tracker.baud, "of its DIP switches: how long bytes take")
      ->check(CLI::IsMember({2400, 4800, 9600, 19200, 38400, 57600, 115200}));
  command.add_option("--revision", options.revision, "of its firmware, which says what parameters it knows");
  command.add_option("--model", tracker.unit.model, "ten characters that it calls itself");
  command.add_option("--faults", options.faults, "script of faults (TOML)");
  command.add_option("--seed", tracker.seed, "everything random follows from it");
}

}  // namespace

void add_minibird_command(CLI::App& app, const Take& take) {
  auto options = std::make_shared<MiniBirdOptions>();
  MiniBirdProgram& program = options->program;
  CLI::App& command = *app.add_subcommand("minibird", "run a tracker at a serial line, in real time");
  CLI::App& line = *command.add_option_group("line", "where a driver finds it")->require_option(1);
  line.add_option("--tty", program.tty, "name for a pseudo-terminal");
  line.add_option("--tcp", program.tcp, "[HOST:]PORT to listen at; port 0 takes a free one and says which");
  line.add_option("--unix", program.unix_socket, "path of a Unix socket to listen at");
  add_tracker_options(command, *options);
  command.add_option("--truth", program.truth, "JSON file that says where the birds truly are, and when");
  command.add_option("--seconds", program.seconds, "to run; 0: until SIGTERM")->check(CLI::Range(0.0, 1e6));
  command.callback([options, take] { take(run(*options)); });
}

void add_ft232r_command(CLI::App& app, const Take& take) {
  auto options = std::make_shared<Ft232rOptions>();
  Ft232rProgram& program = options->program;
  CLI::App& command =
      *app.add_subcommand("ft232r", "run a USB adapter with a tracker behind it, for QEMU's usb-redir, in real time");
  command.add_option("--unix", program.socket, "the socket of QEMU's device, to connect to")->required();
  command.add_option("--serial", program.chip.serial, "the adapter's serial number")
      ->check(
          CLI::Validator([](const std::string& text) { return text.size() <= 16 ? "" : "over 16 characters"; }, ""));
  command
      .add_option("--receive-fifo", program.chip.receive_fifo_bytes,
                  "bytes that wait for the host (the chip's 128); more forgives a host that stalls")
      ->check(CLI::Range(64, 65536));
  add_tracker_options(command, options->behind);
  command.callback([options, take] { take(run(*options)); });
}

void add_camera_command(CLI::App& app, const Take& take) {
  auto options = std::make_shared<VideoOptions>();
  CameraProgram& program = options->program;
  CameraTiming& timing = program.timing;
  CLI::App& command = *app.add_subcommand("camera", "run a camera with a test picture, in real time");
  CLI::App& sink = *command.add_option_group("sink", "where the frames go")->require_option(1);
  sink.add_option("--socket", program.socket, "path of a Unix socket to listen at");
  sink.add_option("--v4l2", program.device, "an output node of v4l2loopback, as /dev/video9");
  command.add_option("--size", options->size, "WIDTHxHEIGHT");
  command.add_option("--rate", timing.rate_hz, "frames a second")->check(CLI::Range(1.0, 240.0));
  command.add_option("--format", options->format, "RGB3, YUYV, UYVY, NV12 or GREY");
  command.add_flag("--no-stamps", options->no_stamps, "frames do not say when they were exposed");
  command.add_option("--exposure-ms", timing.exposure_ms, "of a row; nothing leaves before it has ended")
      ->check(CLI::Range(0.0, 1000.0));
  command.add_option("--delivery-ms", timing.delivery_ms, "from mid-exposure to the first byte")
      ->check(CLI::Range(0.0, 1000.0));
  command.add_option("--jitter-ms", timing.jitter_ms, kJitterHelp)->check(CLI::Range(0.0, 1000.0));
  command.add_option("--drift-ppm", timing.drift_ppm, kDriftHelp)->check(CLI::Range(-10'000.0, 10'000.0));
  command.add_flag("--rolling", program.rolling, "rows are exposed one after another");
  command.add_option("--faults", options->faults, "script of faults (TOML)");
  command.add_option("--seed", timing.seed, "everything random follows from it");
  command.add_option("--truth", program.truth, "JSON file that says when frames are truly exposed");
  command.add_option("--strobe", program.strobe,
                     "file that is told pull-up and pull-down with each exposure, as of a line of Linux's gpio-sim");
  command.add_option(
      "--post", program.post,
      "--truth of a minibird on its circle: show what a scope on its first bird sees of a post in the middle");
  command.add_option("--seconds", program.seconds, "to run; 0: until SIGTERM")->check(CLI::Range(0.0, 1e6));
  command.callback([options, take] { take(run(*options)); });
}

}  // namespace birdseye::hw_sim
