#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/base/verdict.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/interrupt.hpp"
#include "drivers/system/program.hpp"
#include "drivers/system/progress.hpp"
#include "host/app/commands.hpp"
#include "host/app/foreign_options.hpp"
#include "host/files/write_files.hpp"
#include "host/link/appliance_link.hpp"
#include "host/link/event_stream.hpp"
#include "host/recording/recording_writer.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

// Two seconds of 60 Hz for a disk that halts, of which the oldest go first.
constexpr std::size_t kMostRecordFramesWaiting = 120;
constexpr Duration kSilence = Duration::from_ms(15'000);
/// What the last lines and the sheet need, and other programs.
constexpr std::uintmax_t kSpareBytes = std::uintmax_t{32} << 20U;
/// By how much a recording may be shorter than asked for: the larger of the two.
constexpr double kMostMissingShare = 0.1, kMostMissing_s = 0.5;

struct RecordOptions {
  std::string server, video = "raw";
  wire::ForeignSettings foreign;
  fs::path out, json;
  double seconds = 0;
  bool pair = false;
};

/// How a recording ended.
struct Ending {
  std::string why;
  bool asked_for = false;  ///< by --seconds or by a signal
  bool in_time = false;    ///< by --seconds
  std::size_t left = 0;    ///< of what had come before the end, what could not be written
};

Result<void> write_event(const wire::Event& event, RecordingWriter& writer, const fs::path& folder) {
  std::error_code unknown;
  if (std::holds_alternative<wire::VideoFrame>(event) && fs::space(folder, unknown).available < kSpareBytes && !unknown)
    return Error{Errc::io, fmt::format("{}: the disk is full; free some, or choose another --out", folder.string())};
  return writer.add(event);
}

/// Until there is a reason to end.
Ending record(EventStream& stream, RecordingWriter& writer, const RecordOptions& options, Progress& progress) {
  HostTime heard = host_now();
  std::optional<HostTime> began;  // by this machine's clock, whatever the server's stamps say
  int told_s = -1;
  while (!interrupted()) {
    const RecordingFigures& figures = writer.figures();
    if (options.seconds > 0 && began && (host_now() - *began).seconds() >= options.seconds)
      return {fmt::format("{:g} s are over", options.seconds), true, true};
    auto event = stream.next(Deadline::after(Duration::from_ms(200)));
    if (!event) return {event.error().what};
    if (!*event) {
      if (host_now() - heard > kSilence)
        return {fmt::format("{} sent neither frames nor poses for {:g} s; do its instruments run?", options.server,
                            kSilence.seconds())};
      continue;
    }
    if (acquired_of(**event)) {
      heard = host_now();
      if (!began) began = heard;
    }
    if (auto added = write_event(**event, writer, options.out); !added) return {added.error().what};
    if (const int second = static_cast<int>(figures.seconds()); std::exchange(told_s, second) != second) {
      progress(fmt::format("{} s, {} frames, {} poses", second, figures.frames, figures.measurements));
      if (auto there = writer.check_folder(); !there) return {there.error().what};
    }
  }
  return {"it was interrupted", true};
}

/// What came before the end and was not taken yet: no more than the stream's queues hold. All of it at once, before any
/// is written, so that none of it gives way to what still comes.
std::vector<wire::Event> take_waiting(EventStream& stream) {
  std::size_t count = 0;
  for (const QueueFill& fill : stream.fills()) count += fill.values;
  std::vector<wire::Event> waiting;
  while (waiting.size() < count) {
    auto event = stream.next(Deadline::after(Duration::from_ms(0)));
    if (!event || !*event) break;
    waiting.push_back(**std::move(event));
  }
  return waiting;
}

/// After an end that was asked for; else the disk takes no more. Of what waited while something was written for long,
/// that which is later than --seconds is no part of the recording.
void write_waiting(const std::vector<wire::Event>& waiting, RecordingWriter& writer, const RecordOptions& options,
                   Ending& ending) {
  ending.left = waiting.size();
  if (!ending.asked_for) return;
  for (const wire::Event& event : waiting) {
    const auto acquired = acquired_of(event);
    const auto& first = writer.figures().first;
    const bool later = options.seconds > 0 && acquired && first && (*acquired - *first).seconds() > options.seconds;
    if (!later) {
      if (auto added = write_event(event, writer, options.out); !added) {
        ending = {.why = added.error().what, .left = ending.left};
        return;
      }
    }
    --ending.left;
  }
}

/// For how long there are frames or poses: each stands for the time up to the next.
double lasted_s(const RecordingFigures& figures) {
  const auto count = static_cast<double>(std::max(figures.frames, figures.measurements));
  return count > 1 ? figures.seconds() * count / (count - 1) : 0;
}

Verdict judge(const RecordingWriter& writer, const RecordOptions& options, const Ending& ending, bool finished) {
  const RecordingFigures& figures = writer.figures();
  Verdict verdict;
  const bool none = figures.frames == 0 && figures.measurements == 0;
  const bool fail = none || !writer.damage().empty();
  verdict.add(fail ? Grade::fail : ending.asked_for ? Grade::pass : Grade::marginal, "ended because " + ending.why);
  for (const std::string& damage : writer.damage()) {
    if (damage != ending.why) verdict.add(Grade::fail, damage);
  }
  if (!writer.damage().empty()) verdict.add(Grade::fail, "nobody signed it");
  if (!finished && writer.damage().empty()) verdict.add(Grade::marginal, "not all of its files could be completed");
  if (none) return verdict;
  const double missing_s = options.seconds - lasted_s(figures);
  if (ending.in_time && missing_s > std::max(kMostMissing_s, kMostMissingShare * options.seconds)) {
    verdict.add(
        Grade::marginal,
        fmt::format("{:.1f} s of the {:g} s that were asked for are in it: of the rest {} sent nothing, or this "
                    "machine was too slow to keep it",
                    figures.seconds(), options.seconds, options.server));
  }
  if (ending.left > 0)
    verdict.add(Grade::marginal,
                fmt::format("{} frames, poses and other messages that had come were not written", ending.left));
  if (figures.frames == 0) verdict.add(Grade::marginal, "no frames came");
  if (figures.measurements == 0) verdict.add(Grade::marginal, "no poses came");
  const double all = static_cast<double>(figures.frames) + static_cast<double>(figures.frames_missing);
  if (figures.frames_missing > 0) {
    verdict.add(100 * static_cast<double>(figures.frames_missing) > all ? Grade::marginal : Grade::pass,
                fmt::format("{} of {:.0f} frames are missing", figures.frames_missing, all));
  }
  for (const std::string& note : writer.notes()) verdict.add(Grade::marginal, note);
  if (!writer.rests_on().empty()) {
    verdict.add(Grade::marginal,
                fmt::format("UNSIGNED: the poses rest on what no known machine signed ({})", writer.rests_on()));
  }
  return verdict;
}

nlohmann::json json_of(const RecordingFigures& figures, const Verdict& verdict) {
  return {
      {"seconds", figures.seconds()},         {"frames", figures.frames},  {"frames_missing", figures.frames_missing},
      {"measurements", figures.measurements}, {"events", figures.events},  {"poses", figures.poses},
      {"verdict", name_of(verdict.grade)},    {"reasons", verdict.reasons}};
}

Result<ExitCode> run(const RecordOptions& options) {
  if (options.out.empty()) return Error{Errc::bad_value, "--out: is empty; name a folder"};
  note_interrupts();
  ::signal(SIGPIPE, SIG_IGN);  // of an encoder that ended
  auto machine = ThisMachine::open();
  if (!machine) return machine.error();
  wire::ForeignSettings foreign = options.foreign;
  foreign.scope_bird.clear();  // what is recorded is found again by the names that the server gave
  auto client = connect_appliance(options.server, foreign);
  if (!client) return client.error();
  auto writer = RecordingWriter::create({.folder = options.out,
                                         .source = options.server,
                                         .scope = foreign.scope_device.empty() ? "scope" : foreign.scope_device,
                                         .compressed = options.video == "compressed",
                                         .pair = options.pair,
                                         .machine = std::make_shared<const ThisMachine>(*std::move(machine))});
  if (!writer) return writer.error();
  Progress progress;
  Ending ending;
  std::string peer, answered;
  bool plain = false;
  Drops drops;
  std::vector<wire::Event> waiting;
  {
    EventStream stream(*std::move(client), kMostRecordFramesWaiting);
    ending = record(stream, **writer, options, progress);
    waiting = take_waiting(stream);
    peer = stream.peer_words();
    answered = answered_words(options.server, stream.machine());
    plain = stream.is_plain();
    drops = stream.drops();
  }
  write_waiting(waiting, **writer, options, ending);
  progress.keep("completing the files");
  const auto finished = (*writer)->finish(ending.why);
  Verdict verdict = judge(**writer, options, ending, finished.has_value());
  if (!answered.empty()) verdict.add(Grade::pass, answered);
  if (!peer.empty()) verdict.add(Grade::pass, fmt::format("{} is {}", options.server, peer));
  if (plain) verdict.add(Grade::pass, "recorded without TLS: others on the network could read and change what came");
  drops.tell(verdict);
  const RecordingFigures& figures = (*writer)->figures();
  if (auto written = write_file(options.json, text_of(json_of(figures, verdict))); !written) return written.error();
  fmt::print("{}: {:.1f} s, {} frames, {} measurements\n", options.out.string(), figures.seconds(), figures.frames,
             figures.measurements);
  for (const std::string& reason : verdict.reasons) print_line(reason);
  fmt::print("verdict: {}\n", name_of(verdict.grade));
  return verdict.grade == Grade::fail ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_record(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<RecordOptions>();
  CLI::App& command = *app.add_subcommand("record", "keep video and poses for Slicer, PLUS and birdseye replay");
  command.add_option("--server", options->server, "the appliance or another OpenIGTLink server, [NAME@]HOST:PORT")
      ->required();
  add_foreign_options(command, options->foreign);
  command.add_option("--out", options->out, "folder, which is made")->required();
  command.add_option("--seconds", options->seconds, "that it lasts (default: until it is interrupted)")
      ->check(CLI::Range(0.1, 86400.0));
  command.add_option("--video", options->video, "raw (default) or compressed: a film, which loses something")
      ->check(CLI::IsMember({"raw", "compressed"}));
  command.add_flag("--pair", options->pair, "leave header and pixels two files, for long recordings");
  command.add_option("--json", options->json, "write the figures to this file");
  command.callback([options, &status] {
    const auto done = run(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
