#include "host/recording/recording_writer.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "calibration/record/strict_json.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/durable.hpp"
#include "host/files/files_sha256.hpp"
#include "host/files/frame_size.hpp"
#include "host/files/sequence_header.hpp"
#include "host/files/write_files.hpp"
#include "host/recording/recording_signature.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr double kUsualRateHz = 25;
constexpr std::size_t kMostVideos = 20;  // a file each
/// No two birds are this close: each has a housing, and mostly an instrument around it.
constexpr double kSameBirdMm = 5;

}  // namespace

Result<std::unique_ptr<RecordingWriter>> RecordingWriter::create(const RecordingSettings& settings) {
  std::error_code error;
  if (fs::exists(settings.folder / kRecordingSheet, error) || fs::exists(settings.folder / kRecordingEvents, error)) {
    return Error{Errc::in_use,
                 fmt::format("{}: holds a recording already; choose another --out", settings.folder.string())};
  }
  if (auto made = make_folder_durably(settings.folder); !made) return made.error();
  auto files = RecordingFiles::open(settings.folder);
  if (!files) return files.error();
  auto events = OutputFile::create(settings.folder / kRecordingEvents);
  if (!events) return events.error();
  auto tracker = SequenceWriter::create(settings.folder, kRecordingTracker, 0, 0);
  if (!tracker) return tracker.error();
  std::unique_ptr<RecordingWriter> writer(
      new RecordingWriter(settings, *std::move(files), *std::move(events), *std::move(tracker)));
  if (auto written = writer->write_sheet("it is being recorded, or was cut short", false); !written)
    return written.error();
  return writer;
}

Result<void> RecordingWriter::add_line(const wire::Event& event, const FramePlace& place) {
  const std::string line = event_line(event, place) + "\n";
  if (auto put = events_.put(events_at_, line); !put) {
    events_.cut(events_at_);
    return put;
  }
  events_at_ += line.size();
  events_sum_.add({reinterpret_cast<const std::uint8_t*>(line.data()), line.size()});
  ++figures_.events;
  return {};
}

void RecordingWriter::note_time(DeviceTime time) {
  if (!figures_.first) figures_.first = figures_.last = time;
  figures_.last = std::max(*figures_.last, time);
}

Result<void> RecordingWriter::add(const wire::Event& event) {
  if (const auto* frame = std::get_if<wire::VideoFrame>(&event)) return add_frame(*frame);
  if (const auto* birds = std::get_if<wire::Birds>(&event)) {
    if (auto added = add_birds(*birds); !added) return added;
  }
  if (const auto* health = std::get_if<wire::Health>(&event)) {
    health_ = *health;
    // Once told it stays: poses that it corrected are in the recording.
    if (!health->field_unsigned.empty()) rests_on_ = fmt::format("its map of the field is {}", health->field_unsigned);
  }
  return add_line(event, {});
}

/// Two birds whose names differ in signs alone have two transforms.
void RecordingWriter::name_transform(const std::string& bird) {
  if (transform_of_.contains(bird) || transform_of_.size() >= kMostBirds) return;
  const std::string name = transform_name(bird);
  const auto taken = [&](const std::string& other) {
    return std::ranges::any_of(transform_of_, [&](const auto& known) { return known.second == other; });
  };
  std::string own = name;
  for (int number = 2; taken(own); ++number) own = fmt::format("{}{}", number, name);
  transform_of_.emplace(bird, own);
}

/// A server may send the poses of one time one by one, as PLUS does: they are one measurement.
Result<void> RecordingWriter::add_birds(const wire::Birds& birds) {
  note_time(birds.acquired);
  if (birds.acquired != measured_.acquired) {
    if (auto written = write_measurement(); !written) return written;
    measured_.acquired = birds.acquired;
  }
  for (const wire::Bird& bird : birds.birds) {
    name_transform(bird.name);
    if (!transform_of_.contains(bird.name)) continue;
    histories_[bird.name].push(birds.acquired, {}, bird.tracker_from_sensor);
    ++figures_.poses[bird.name];
    std::erase_if(measured_.birds, [&](const wire::Bird& other) { return other.name == bird.name; });
    measured_.birds.push_back(bird);
  }
  return {};
}

Result<void> RecordingWriter::write_measurement() {
  const wire::Birds birds = std::exchange(measured_, {});
  if (birds.birds.empty()) return {};
  SequenceWriter::Fields fields = {{std::string(kTimestampField), seconds_text(birds.acquired.ns)}};
  // Every bird that ever told of itself is in each of the frames.
  for (const auto& [name, transform] : transform_of_) {
    const auto found = std::find_if(birds.birds.begin(), birds.birds.end(),
                                    [&name = name](const wire::Bird& bird) { return bird.name == name; });
    const bool seen = found != birds.birds.end();
    const Eigen::Matrix4d m = seen ? found->tracker_from_sensor.matrix() : Eigen::Matrix4d(Eigen::Matrix4d::Identity());
    fields.emplace_back(transform + std::string(kTransformField), transform_text(m));
    fields.emplace_back(transform + std::string(kTransformStatusField), seen ? kStatusOk : kStatusInvalid);
  }
  if (auto added = tracker_.add(fields, {}); !added) return added;
  ++figures_.measurements;
  return {};
}

/// Whose pose that of the frame is; none where that is not known, so that no transform is invented. The only bird that
/// has told its name yet may be another than the scope's: its own poses must say the same as the frame's.
std::optional<std::string> RecordingWriter::scope_of(const wire::VideoFrame& frame) const {
  for (const std::string& name : {settings_.scope, std::string("scope")}) {
    if (transform_of_.contains(name)) return name;
  }
  const auto& pose = frame.info.pose.tracker_from_sensor;
  if (!pose || transform_of_.size() != 1) return std::nullopt;
  const std::string& only = transform_of_.begin()->first;
  const auto own = histories_.at(only).at(frame.info.acquired).tracker_from_sensor;
  if (!own || (own->translation() - pose->translation()).norm() > kSameBirdMm) return std::nullopt;
  return only;
}

SequenceWriter::Fields RecordingWriter::fields_of(const wire::VideoFrame& frame) const {
  const wire::FrameInfo& info = frame.info;
  SequenceWriter::Fields fields = {{std::string(kFrameNumberField), std::to_string(info.sequence)},
                                   {std::string(kTimestampField), seconds_text(info.acquired.ns)},
                                   {std::string(kUnfilteredTimestampField), seconds_text(info.arrived.ns)},
                                   {"TimestampSigma", seconds_text(info.acquired_sigma.ns)},
                                   {"PoseKind", to_string(info.pose.kind)},
                                   {"PoseSigmaMm", fmt::format("{}", info.pose.position_sigma_mm)}};
  if (info.latency) fields.emplace_back("Latency", seconds_text(info.latency->ns));
  const auto scope = scope_of(frame);
  for (const auto& [bird, transform] : transform_of_) {
    const PoseAnswer pose = scope == bird ? info.pose : histories_.at(bird).at(info.acquired);
    const auto& m = pose.tracker_from_sensor;
    fields.emplace_back(transform + std::string(kTransformField),
                        transform_text(m ? m->matrix() : Eigen::Matrix4d(Eigen::Matrix4d::Identity())));
    fields.emplace_back(transform + std::string(kTransformStatusField), m ? kStatusOk : kStatusInvalid);
  }
  return fields;
}

std::string RecordingWriter::next_video() const {
  const std::size_t number = figures_.videos.size() + 1;
  return number == 1 ? kRecordingVideo : fmt::format("{}-{}", kRecordingVideo, number);
}

Result<void> RecordingWriter::begin_video(const wire::VideoFrame& frame, double rate_hz) {
  if (figures_.videos.size() >= kMostVideos) {
    return Error{
        Errc::unsupported,
        fmt::format("the frames have had {} sizes, one after another: set the camera to one", kMostVideos + 1)};
  }
  RecordedVideo video;
  video.name = next_video();
  video.width_px = frame.width_px;
  video.height_px = frame.height_px;
  video.rate_hz = rate_hz;
  if (settings_.compressed) {
    video.file = video.name + ".mp4";
    auto film = Film::open(settings_.folder / video.file, frame.width_px, frame.height_px, rate_hz);
    if (!film) return film.error();
    film_ = *std::move(film);
  } else {
    auto sequence = SequenceWriter::create(settings_.folder, video.name, frame.width_px, frame.height_px);
    if (!sequence) return sequence.error();
    video.file = sequence->path().filename().string();
    sequence_.push_back(*std::move(sequence));
  }
  figures_.videos.push_back(video);
  return write_sheet("it is being recorded, or was cut short", false);
}

Result<void> RecordingWriter::write_frame(const wire::VideoFrame& frame) {
  RecordedVideo& video = figures_.videos.back();
  if (auto added = film_ ? film_->add(*frame.rgb) : sequence_[0].add(fields_of(frame), *frame.rgb); !added)
    return added;
  if (auto added = add_line(frame, {video.name, video.frames}); !added) return added;
  ++video.frames;
  ++figures_.frames;
  return {};
}

Result<void> RecordingWriter::add_frame(const wire::VideoFrame& frame) {
  if (!is_frame_size(frame.width_px, frame.height_px)) {
    return Error{Errc::unsupported,
                 fmt::format("frames of {}x{} px are larger than those that are recorded ({} px at most): set the "
                             "camera to a smaller size",
                             frame.width_px, frame.height_px, kMostFramePixels)};
  }
  note_time(frame.info.acquired);
  if (last_sequence_ && frame.info.sequence > *last_sequence_ + 1)
    figures_.frames_missing += frame.info.sequence - *last_sequence_ - 1;
  last_sequence_ = frame.info.sequence;
  const bool open = film_ || !sequence_.empty();
  if (open &&
      (figures_.videos.back().width_px != frame.width_px || figures_.videos.back().height_px != frame.height_px)) {
    notes_.push_back(fmt::format("the frames changed from {}x{} to {}x{} px: another file begins there",
                                 figures_.videos.back().width_px, figures_.videos.back().height_px, frame.width_px,
                                 frame.height_px));
    if (auto ended = end_video(); !ended) return ended;
  }
  if (film_ || !sequence_.empty()) return write_frame(frame);
  if (!settings_.compressed) {
    if (auto begun = begin_video(frame, 0); !begun) return begun;
    return write_frame(frame);
  }
  if (waiting_ && (waiting_->width_px != frame.width_px || waiting_->height_px != frame.height_px)) {
    if (auto ended = end_video(); !ended) return ended;
  }
  if (!waiting_) {
    // Its line at once, in its turn.
    waiting_ = frame;
    ++figures_.frames;
    return add_line(frame, {next_video(), 0});
  }
  const double between_s = (frame.info.acquired - waiting_->info.acquired).seconds();
  const auto steps = static_cast<double>(frame.info.sequence - waiting_->info.sequence);
  const double told_hz = steps / between_s;
  const bool sound = told_hz >= 1 && told_hz <= 1000;
  if (auto begun = begin_film(sound ? std::round(10 * told_hz) / 10 : kUsualRateHz); !begun) return begun;
  return write_frame(frame);
}

Result<void> RecordingWriter::begin_film(double rate_hz) {
  const wire::VideoFrame first = *std::exchange(waiting_, std::nullopt);
  if (auto begun = begin_video(first, rate_hz); !begun) return begun;
  ++figures_.videos.back().frames;
  return film_->add(*first.rgb);
}

Result<void> RecordingWriter::end_film() {
  auto finished = film_->finish();
  film_.reset();
  whole_ = whole_ && finished;
  if (!finished) return finished;
  // The bytes are the encoder's: they are summed as soon as they are whole.
  const std::string& name = figures_.videos.back().file;
  const auto sum = files_sha256(settings_.folder / name);
  whole_ = whole_ && sum;
  if (!sum) return sum.error();
  files_.wrote(name, *sum);
  return {};
}

void RecordingWriter::keep_sums(SequenceWriter& sequence) {
  const auto sums = sequence.sums();
  if (!sums) {
    damage_.push_back(sums.error().what);
    return;
  }
  for (const auto& [name, sum] : *sums) files_.wrote(name, sum);
}

Result<void> RecordingWriter::end_video() {
  // By its path nothing may be written any more, for that may be another folder now.
  if (auto there = files_.check_folder(); !there) {
    waiting_.reset();
    film_.reset();
    for (SequenceWriter& sequence : sequence_) (void)sequence.sync();
    sequence_.clear();
    return there;
  }
  if (waiting_) {
    auto begun = begin_film(kUsualRateHz);
    whole_ = whole_ && begun;
    if (!begun) return begun;
  }
  if (film_) return end_film();
  if (sequence_.empty()) return {};
  SequenceWriter& sequence = sequence_[0];
  const auto whole = sequence.check();
  if (!whole) damage_.push_back(whole.error().what);
  bool joined = false;
  if (!settings_.pair && whole) {
    const auto one = sequence.join();
    joined = one.has_value();
    // Two files are as good to read: not worth losing the recording for.
    if (!joined) notes_.push_back(one.error().what);
    figures_.videos.back().file = sequence.path().filename().string();
  }
  // Joining has brought the one file onto the disk.
  Result<void> synced = joined ? Result<void>() : sequence.sync();
  whole_ = whole_ && synced;
  if (whole) keep_sums(sequence);
  sequence_.clear();
  return synced;
}

void RecordingWriter::look_through_folder() {
  for (const auto& whole : {events_.check(events_at_), tracker_.check()}) {
    if (!whole) damage_.push_back(whole.error().what);
  }
  if (!damage_.empty()) return;  // and nothing is signed
  files_.wrote(kRecordingEvents, events_sum_.hex());
  keep_sums(tracker_);
  if (damage_.empty()) damage_ = files_.damage();
  auto others = files_.others();
  if (!damage_.empty() || others.empty()) return;
  constexpr std::size_t kMostNamed = 5;
  const std::string more =
      others.size() > kMostNamed ? fmt::format(" and {} more", others.size() - kMostNamed) : std::string();
  others.resize(std::min(others.size(), kMostNamed));
  notes_.push_back(
      fmt::format("{} holds what this recording did not write, and what nobody signs: {}{}; move it away, or the "
                  "recording is refused",
                  settings_.folder.string(), fmt::join(others, ", "), more));
}

Result<void> RecordingWriter::finish(const std::string& why) {
  if (auto written = write_measurement(); !written) notes_.push_back(written.error().what);
  auto there = files_.check_folder();
  if (!there) damage_.push_back(there.error().what);
  Result<void> ended = end_video();
  if (!ended && there) notes_.push_back(ended.error().what);
  for (const auto& synced : {events_.sync(), tracker_.sync()}) {
    whole_ = whole_ && synced;
    if (!synced) notes_.push_back(synced.error().what);
  }
  if (!there) return there;
  if (settings_.machine) look_through_folder();
  if (auto written = write_sheet(why, true); !written) {  // and with it the names in the folder
    notes_.push_back(written.error().what);
    return written;
  }
  if (!damage_.empty()) return Error{Errc::bad_format, damage_.front()};
  return ended;
}

Result<void> RecordingWriter::write_sheet(const std::string& why, bool ended) {
  using nlohmann::json;
  json videos = json::array(), instruments = json::array();
  for (const RecordedVideo& video : figures_.videos) {
    videos.push_back({{"file", video.file}, {"width_px", video.width_px}, {"height_px", video.height_px}});
    if (ended) videos.back()["frames"] = video.frames;
    if (video.rate_hz > 0) videos.back()["film_rate_hz"] = video.rate_hz;
  }
  json sheet = {{"birdseye_recording", kRecordingVersion},
                {"ended", ended},
                {"why", why},
                {"source", settings_.source},
                {"events", {{"file", kRecordingEvents}}},
                {"tracker", {{"file", std::string(kRecordingTracker) + ".igs.mha"}}},
                {"video", videos},
                {"clock", {{"stamps", "the appliance's CLOCK_MONOTONIC, ns; in the sequences s"}}},
                {"notes", notes_}};
  if (!damage_.empty()) sheet["damage"] = damage_;
  if (ended) {
    sheet["made_utc"] = utc_now();
    sheet["seconds"] = figures_.seconds();
    sheet["frames"] = figures_.frames;
    sheet["frames_missing"] = figures_.frames_missing;
    sheet["events"]["count"] = figures_.events;
    sheet["tracker"]["measurements"] = figures_.measurements;
    sheet["tracker"]["poses"] = figures_.poses;
  }
  if (figures_.first) {
    sheet["clock"]["first_ns"] = figures_.first->ns;
    sheet["clock"]["last_ns"] = figures_.last->ns;
  }
  if (health_) {
    for (const wire::InstrumentHealth& one : health_->instruments)
      instruments.push_back({{"name", one.name}, {"text", one.text}, {"identity", one.identity}});
    sheet["instruments"] = instruments;
    sheet["clock"]["source"] = health_->clock.source;
    sheet["clock"]["synchronised"] = health_->clock.synchronised;
    sheet["clock"]["wall_minus_monotonic_ns"] = health_->clock.wall_minus_monotonic_ns;
    sheet["appliance_frames_dropped"] = health_->frames_dropped;
    sheet["appliance_messages_shed"] = health_->messages_shed;
  }
  if (!rests_on_.empty()) sheet["rests_on"]["unsigned"] = rests_on_;
  if (ended && settings_.machine && damage_.empty() && whole_) sign_recording(sheet, files_.sums(), *settings_.machine);
  return write_file(settings_.folder / kRecordingSheet, calibration::text_of_json(sheet, 2) + "\n");
}

}  // namespace birdseye::host
