#include "host/calibrate/latency_streams.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <set>

#include "calibration/latency/image_motion.hpp"
#include "drivers/system/child_process.hpp"
#include "drivers/system/interrupt.hpp"
#include "drivers/system/local_programs.hpp"
#include "host/files/picture.hpp"
#include "host/files/write_files.hpp"
#include "host/link/appliance_link.hpp"
#include "host/recording/recording_reader.hpp"
#include "host/recording/recording_writer.hpp"

namespace birdseye::host {

namespace {

// Frames that wait while others are looked at: a second of them, of which the oldest goes first.
constexpr std::size_t kMostFramesWaiting = 60;
constexpr Duration kPatience = Duration::from_ms(15'000);
constexpr Duration kLook = Duration::from_ms(200);  // how soon an interruption is seen
// A clock of a machine that runs for months would leave too few digits for ppm.
double seconds_of(DeviceTime time, std::int64_t origin_ns) {
  return static_cast<double>(time.ns - origin_ns) * 1e-9;
}

class Gatherer {
 public:
  explicit Gatherer(const LatencySource& source) : source_(source) { streams_.bird = source.bird; }

  void take(const wire::Birds& birds) {
    begin(birds.acquired);
    for (const wire::Bird& bird : birds.birds) {
      names_.insert(bird.name);
      if (bird.name != source_.bird) continue;
      streams_.tracker.push_back({seconds_of(birds.acquired, *origin_ns_), bird.tracker_from_sensor.quaternion(),
                                  bird.tracker_from_sensor.translation()});
    }
  }
  void take(const wire::VideoFrame& frame) {
    // What the appliance takes off by an earlier record is part of what is looked for, and kept: whoever sets delay_ms
    // too has it taken off twice, which the times before that do not show.
    const DeviceTime acquired = frame.info.acquired + frame.info.latency.value_or(Duration{0});
    streams_.in_force_ms.reset();
    if (frame.info.latency) streams_.in_force_ms = 1e3 * frame.info.latency->seconds();
    begin(acquired);
    ++streams_.frames;
    const std::vector<std::uint8_t> grey = grey_of({*frame.rgb, frame.width_px, frame.height_px});
    const auto motion = motion_.push(seconds_of(acquired, *origin_ns_), {grey, frame.width_px, frame.height_px});
    if (motion) {
      streams_.video.push_back(*motion);
    } else if (++streams_.frames_without_motion > 1) {
      streams_.usual_reason = motion_.why();
    }
  }
  /// Seconds since the first event.
  [[nodiscard]] double lasted_s() const {
    const double poses_s = streams_.tracker.empty() ? 0 : streams_.tracker.back().time_s;
    return std::max(poses_s, streams_.video.empty() ? 0 : streams_.video.back().to_s);
  }
  Result<LatencyStreams> finish() {
    if (streams_.tracker.empty() && names_.empty())
      return Error{Errc::not_found, "no poses came; see that the tracker runs (Health tells)"};
    if (streams_.tracker.empty()) {
      std::string known;
      for (const std::string& name : names_) known += (known.empty() ? "" : ", ") + name;
      return Error{Errc::not_found,
                   fmt::format("no poses of a bird \"{}\" came, but of {}; set --bird", source_.bird, known)};
    }
    if (streams_.frames == 0) {
      return Error{
          Errc::not_found,
          "no frames came; see that the camera runs, and that a recording was made with [record] frames = true"};
    }
    return std::move(streams_);
  }

 private:
  void begin(DeviceTime time) {
    if (!origin_ns_) origin_ns_ = time.ns;
  }

  const LatencySource& source_;
  LatencyStreams streams_;
  std::set<std::string> names_;
  std::optional<std::int64_t> origin_ns_;
  calibration::ImageMotionTracker motion_;
};

Result<int> port_for_replay(const std::filesystem::path& config) {
  auto port = free_port();
  if (!port) return port;
  // Of a replay only [wire] counts; the instruments are named because every configuration names some.
  const auto written =
      write_file(config, fmt::format("[tracker]\ndevice = \"/dev/null\"\n\n[camera]\nsource = "
                                     "\"socket:/nowhere\"\n\n[wire]\nbind = \"127.0.0.1\"\nport = {}\n",
                                     *port));
  if (!written) return written.error();
  return port;
}

std::string last_line(const std::filesystem::path& log) {
  std::ifstream in(log);
  std::string line, last;
  while (std::getline(in, line)) {
    if (!line.empty()) last = line;
  }
  return last;
}

}  // namespace

Result<LatencyStreams> gather_events(EventSource& events, const LatencySource& source, Progress& progress) {
  Gatherer gatherer(source);
  HostTime heard = host_now();
  // Streams that come but tell nothing of this bird, or show no motion, do not last: finish() says why.
  const HostTime latest = heard + kPatience + Duration::from_seconds(std::max(0.0, source.seconds));
  while (source.seconds <= 0 || (gatherer.lasted_s() < source.seconds && host_now() < latest)) {
    if (interrupted()) return Error{Errc::disconnected, "interrupted; nothing is left running"};
    auto event = events.next(Deadline::after(kLook));
    if (!event) {
      if (source.seconds <= 0 && event.error().code == Errc::disconnected) break;  // a recording has come to its end
      return event.error();
    }
    if (!*event) {
      if (host_now() - heard > kPatience)
        return Error{Errc::timeout, "the appliance has sent neither poses nor frames for 15 s; see its Health"};
      continue;
    }
    if (const auto* frame = std::get_if<wire::VideoFrame>(&**event)) {
      gatherer.take(*frame);
    } else if (const auto* birds = std::get_if<wire::Birds>(&**event)) {
      gatherer.take(*birds);
    } else {
      continue;
    }
    heard = host_now();
    progress(source.seconds > 0 ? fmt::format("recording: {:.0f} of {:.0f} s", gatherer.lasted_s(), source.seconds)
                                : fmt::format("playing: {:.0f} s", gatherer.lasted_s()));
  }
  return gatherer.finish();
}

Result<LatencyStreams> gather_streams(EventStream& stream, const LatencySource& source, Progress& progress) {
  auto streams = gather_events(stream, source, progress);
  const Drops drops = stream.drops();
  if (const std::string words = drops.words(); !words.empty()) progress.keep(words);
  if (streams) streams->drops = drops;
  return streams;
}

Result<LatencyStreams> record_streams(const std::string& server, const LatencySource& source, Progress& progress) {
  note_interrupts();
  auto client = connect_appliance(server);
  if (!client) return client.error();
  if (const std::string who = answered_words(server, (*client)->machine()); !who.empty()) progress.keep(who);
  EventStream stream(*std::move(client), kMostFramesWaiting);
  return gather_streams(stream, source, progress);
}

bool is_session(const std::filesystem::path& recording) {
  std::error_code ignored;
  return std::filesystem::exists(recording / kRecordingEvents, ignored);
}

Result<LatencyStreams> session_streams(const std::filesystem::path& recording, const std::string& events_sha256,
                                       const LatencySource& source, Progress& progress) {
  note_interrupts();
  const auto reader = RecordingReader::open(recording, {.events_sha256 = events_sha256});
  if (!reader) return reader.error();
  return gather_events(**reader, source, progress);
}

Result<LatencyStreams> replay_streams(const std::filesystem::path& recording, const LatencySource& source,
                                      Progress& progress) {
  if (std::filesystem::is_directory(recording)) {
    return Error{
        Errc::bad_format,
        fmt::format("{}: is a folder; a session recording (birdseye record) will not do: give an appliance "
                    "recording, a .berec file that birdseyed writes by its section [record], or measure at the "
                    "appliance: --server",
                    recording.string())};
  }
  if (!std::filesystem::is_regular_file(recording))
    return Error{Errc::not_found, fmt::format("{}: there is no such recording", recording.string())};
  note_interrupts();
  const auto folder = RendezvousFolder::make();
  if (!folder) return folder.error();
  const auto config = (*folder)->path() / "replay.toml", log = (*folder)->path() / "birdseyed.log";
  const auto port = port_for_replay(config);
  if (!port) return port.error();
  // Whether it is to be used has been decided here.
  auto birdseyed = ChildProcess::start(
      {beside_us("birdseyed"), "--config", config.string(), "--replay", recording.string(), "--accept-unsigned"}, log);
  if (!birdseyed) return std::move(birdseyed).error();
  // What it refuses, it says at once; what it plays, it plays to whoever is there.
  auto client = wire::Client::connect("127.0.0.1", *port, Deadline::after(Duration::from_ms(5000)));
  if (!client) {
    if (birdseyed->wait(host_now())) return Error{Errc::bad_format, last_line(log)};
    return client.error();
  }
  EventStream stream(*std::move(client), kMostFramesWaiting);
  auto streams = gather_streams(stream, source, progress);
  const auto code = birdseyed->wait(Deadline::after(Duration::from_ms(2000)));
  if (!streams && code && *code != 0) return Error{Errc::bad_format, last_line(log)};
  return streams;
}

}  // namespace birdseye::host
