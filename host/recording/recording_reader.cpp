#include "host/recording/recording_reader.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "device/wire/foreign_feed.hpp"
#include "drivers/system/next_line.hpp"
#include "drivers/system/wait.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/files/pose_collector.hpp"
#include "host/recording/recording_writer.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestLine = std::size_t{1} << 20U;
constexpr double kMostNumber = 1e15;  // a double counts so far by ones

/// Of a time that was text in between, and in a double: frames are a thousand times farther apart.
constexpr std::int64_t kRounding_ns = 1000;

/// "StylusToTracker" -> "stylus".
std::string bird_name(std::string transform) {
  constexpr std::string_view kTo = "ToTracker";
  if (transform.ends_with(kTo) && transform.size() > kTo.size()) transform.resize(transform.size() - kTo.size());
  transform[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(transform[0])));
  return transform;
}

void add(calibration::Sha256& sum, const std::string& text) {
  sum.add({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

/// A field that tells seconds, where it tells a time that can be.
std::optional<Duration> span_in(std::string_view field) {
  const ReadNumber read = read_number(field);
  if (!read.problem.empty() || std::abs(read.value) * 1e9 >= static_cast<double>(kFarthest_ns)) return std::nullopt;
  return Duration{std::llround(read.value * 1e9)};
}

/// The time of a frame, or of birds.
std::optional<DeviceTime> time_of(const wire::Event& event) {
  if (const auto* frame = std::get_if<wire::VideoFrame>(&event))
    return std::max(frame->info.acquired, frame->info.arrived);
  if (const auto* birds = std::get_if<wire::Birds>(&event)) return birds->acquired;
  return std::nullopt;
}

}  // namespace

Result<std::unique_ptr<RecordingReader>> RecordingReader::open(const fs::path& path, const Settings& settings) {
  std::unique_ptr<RecordingReader> reader(new RecordingReader(path, settings));
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return Error{Errc::not_found, fmt::format("{}: no such recording", path.string())};
  if (auto opened = fs::is_directory(path, ignored) ? reader->open_folder() : reader->open_sequence(); !opened)
    return opened.error();
  return reader;
}

Result<void> RecordingReader::open_folder() {
  const auto events = open_file(path_ / kRecordingEvents);
  if (!events && events.error().code != Errc::not_found) return events.error();
  if (events) lines_.open(path_ / kRecordingEvents);
  if (!lines_.is_open()) {
    return Error{Errc::not_found,
                 fmt::format("{}: holds no recording ({}); give a folder that birdseye record made, or "
                             "a .igs.mha",
                             path_.string(), kRecordingEvents)};
  }
  const auto text = read_whole_file(path_ / kRecordingSheet, kMostTextBytes);
  if (!text && text.error().code != Errc::not_found) return text.error();
  const auto sheet = text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
  if (!sheet.is_object()) {
    notes_.push_back(fmt::format("{} is missing or damaged; the rest is read without it", kRecordingSheet));
    return {};
  }
  const auto version = sheet.find("birdseye_recording");
  if (version == sheet.end() || !version->is_number_integer() || *version != kRecordingVersion) {
    return Error{Errc::unsupported, fmt::format("{}: is of another version than {}", (path_ / kRecordingSheet).string(),
                                                kRecordingVersion)};
  }
  const auto ended = sheet.find("ended");
  ended_whole_ = ended != sheet.end() && *ended == true;
  if (ended != sheet.end() && *ended == false) notes_.emplace_back("it was cut short while it was recorded");
  return {};
}

Result<void> RecordingReader::open_sequence() {
  auto opened = SequenceReader::open(path_);
  if (!opened) return opened.error();
  sequence_ = *std::move(opened);
  const auto& transforms = sequence_->header().transforms;
  if (transforms.size() > kMostBirds) {
    return Error{Errc::unsupported,
                 fmt::format("{}: has transforms of {} names where a tracker has {} sensors at most; keep those of the "
                             "scope and the other tools, and leave the rest out",
                             path_.string(), transforms.size(), kMostBirds)};
  }
  scope_ = settings_.transform;
  if (scope_.ends_with(kTransformField)) scope_.resize(scope_.size() - kTransformField.size());
  if (scope_.empty()) scope_ = transforms.size() == 1 ? *transforms.begin() : transform_name("scope");
  if (!transforms.contains(scope_)) {
    return Error{
        Errc::bad_value,
        fmt::format("{}: say by name which transform is the scope's (--transform); it holds {}", path_.string(),
                    transforms.empty() ? "none" : fmt::format("{}", fmt::join(transforms, ", ")))};
  }
  const bool timed = std::any_of(sequence_->header().frames.begin(), sequence_->header().frames.end(),
                                 [](const auto& frame) { return frame.second.contains(kTimestampField); });
  if (!timed) return Error{Errc::bad_format, fmt::format("{}: its frames have no Timestamp", path_.string())};
  return {};
}

Result<void> RecordingReader::check_events() {
  if (settings_.events_sha256.empty() || lines_sum_.hex() == settings_.events_sha256) return {};
  return Error{Errc::bad_format,
               fmt::format("{}: was changed after it was verified: nothing that was made of it holds; "
                           "take a copy that is as it was written",
                           (path_ / kRecordingEvents).string())};
}

Result<std::optional<EventOfLine>> RecordingReader::take_line() {
  std::string line;
  const bool there = next_line(lines_, line, kLongestLine);
  if (lines_.bad())
    return Error{Errc::unreadable, fmt::format("{}: {}", (path_ / kRecordingEvents).string(), kNotReadToItsEnd)};
  // What was cut lacks its end.
  const bool cut = lines_.eof();
  if (!there && !cut) {
    return Error{
        Errc::bad_format,
        fmt::format("{}: line {} is longer than any event; take a copy of the recording that is as it was written",
                    (path_ / kRecordingEvents).string(), line_ + 1)};
  }
  if (there) add(lines_sum_, cut ? line : line + '\n');
  if (!there || cut) {
    if (auto same = check_events(); !same) return same.error();
  }
  if (!there) return std::optional<EventOfLine>();
  ++line_;
  auto event = parse_event_line(line);
  if (event && !cut) return std::optional(*std::move(event));
  if (cut) {
    notes_.push_back(fmt::format("{} is cut short in line {}", kRecordingEvents, line_));
    return std::optional<EventOfLine>();
  }
  return event.error().with_context(fmt::format("{}: line {}", (path_ / kRecordingEvents).string(), line_));
}

Result<void> RecordingReader::make_events(std::size_t number, const SequenceHeader::Fields& fields) {
  const auto since_zero = span_in(value_of(fields, kTimestampField));
  if (!since_zero) {
    notes_.push_back(fmt::format("frame {} has no time and is passed over", number));
    return {};
  }
  const DeviceTime acquired{since_zero->ns};
  wire::Birds birds{acquired, {}};
  wire::VideoFrame frame;
  frame.info.pose.reason = scope_ + " missing";
  for (const auto& [key, text] : fields) {
    if (!key.ends_with(kTransformField)) continue;
    const std::string transform = key.substr(0, key.size() - kTransformField.size());
    const std::string_view status = value_of(fields, transform + std::string(kTransformStatusField));
    const ReadPose pose =
        status.empty() || status == kStatusOk ? read_matrix(text, 1) : ReadPose{{}, std::string(status)};
    if (pose.problem.empty()) birds.birds.push_back({bird_name(transform), pose.tracker_from_sensor});
    if (transform != scope_) continue;
    frame.info.pose.reason = pose.problem.empty() ? "" : scope_ + " " + pose.problem;
    if (!pose.problem.empty()) continue;
    // PLUS interpolates the tracker's poses at the times of its frames.
    frame.info.pose.kind = PoseKind::interpolated;
    frame.info.pose.tracker_from_sensor = pose.tracker_from_sensor;
  }
  made_.push_back({birds, {}});
  const std::string_view status = value_of(fields, kImageStatusField);
  if (sequence_->width_px() == 0 || (!status.empty() && status != kStatusOk)) return {};
  const ReadNumber counted = read_number(value_of(fields, kFrameNumberField));
  const bool countable = counted.problem.empty() && counted.value >= 0 && counted.value <= kMostNumber;
  frame.info.sequence = countable ? static_cast<std::uint64_t>(counted.value) : number;
  frame.info.acquired = frame.info.arrived = acquired;
  // As RecordingWriter has them; PLUS says nothing of the kind, and its times are no better than its server's.
  const auto sigma = span_in(value_of(fields, "TimestampSigma"));
  frame.info.acquired_sigma = sigma && sigma->ns >= 0 ? *sigma : wire::kForeignStampSigma;
  if (const ReadNumber sigma_mm = read_number(value_of(fields, "PoseSigmaMm"));
      sigma_mm.problem.empty() && sigma_mm.value >= 0)
    frame.info.pose.position_sigma_mm = sigma_mm.value;
  frame.info.latency = span_in(value_of(fields, "Latency"));
  frame.width_px = sequence_->width_px();
  frame.height_px = sequence_->height_px();
  made_.push_back({frame, {"", number}});
  return {};
}

Result<std::optional<EventOfLine>> RecordingReader::take_of_sequence() {
  const auto& frames = sequence_->header().frames;
  while (made_.empty()) {
    const auto found = frames.lower_bound(next_frame_);
    if (found == frames.end()) return std::optional<EventOfLine>();
    next_frame_ = found->first + 1;
    if (auto made = make_events(found->first, found->second); !made) return made.error();
  }
  std::optional<EventOfLine> event = std::move(made_.front());
  made_.pop_front();
  return event;
}

Result<void> RecordingReader::open_video(const std::string& name, const wire::VideoFrame& frame) {
  sequence_.reset();
  film_.reset();
  video_ = name;
  std::error_code ignored;
  for (const char* extension : {".igs.mha", ".igs.mhd"}) {
    const fs::path file = path_ / (name + extension);
    if (!fs::exists(file, ignored)) continue;
    auto opened = SequenceReader::open(file);
    if (!opened) return opened.error();
    // One that was cut short may lack more of its header than of its pixels.
    if (opened->has_more() && ended_whole_)
      return Error{Errc::bad_format,
                   fmt::format("{}: has more pixels than its header tells of: its size or its channels are not those "
                               "of the pixels; take a copy of the recording that is as it was written",
                               file.string())};
    sequence_ = *std::move(opened);
    return {};
  }
  const fs::path file = path_ / (name + ".mp4");
  if (!fs::exists(file, ignored)) {
    return Error{Errc::not_found,
                 fmt::format("{}: lacks the video, {}.igs.mha, .igs.mhd or .mp4", path_.string(), name)};
  }
  auto film = FilmReader::open(file, frame.width_px / 2 * 2, frame.height_px / 2 * 2);
  if (!film) return film.error();
  film_ = *std::move(film);
  return {};
}

Result<bool> RecordingReader::compare(const wire::VideoFrame& frame, std::size_t index) const {
  const auto& frames = sequence_->header().frames;
  const auto found = frames.find(index);
  if (found == frames.end()) return true;
  // Fields that are not there say nothing: earlier versions, or another program, may have left them away.
  const std::string_view number = value_of(found->second, kFrameNumberField);
  const std::string_view time = value_of(found->second, kTimestampField);
  const auto acquired = span_in(time);
  const bool same = (number.empty() || number == std::to_string(frame.info.sequence)) &&
                    (time.empty() || (acquired && std::abs(acquired->ns - frame.info.acquired.ns) <= kRounding_ns));
  const std::string_view status = value_of(found->second, kImageStatusField);
  const auto shown = [](std::string_view text) { return text.empty() ? "?" : text.substr(0, 40); };
  if (same) return status.empty() || status == kStatusOk;
  return Error{Errc::bad_format,
               fmt::format("{}: the pictures of {} are not those of its events: frame {} is number {} of {} s in {}, "
                           "and there it is number {} of {} s; take a copy of the recording that is as it was written",
                           path_.string(), video_, index, frame.info.sequence, seconds_text(frame.info.acquired.ns),
                           kRecordingEvents, shown(number), shown(time))};
}

/// False: the frame is not there, or not whole.
Result<bool> RecordingReader::fetch_pixels(wire::VideoFrame& frame, const FramePlace& place) {
  if (place.file != video_ || (!sequence_ && !film_)) {
    if (fs::path(place.file).has_parent_path())
      return Error{Errc::bad_value, fmt::format("{}: names a file elsewhere, {}", path_.string(), place.file)};
    if (auto opened = open_video(place.file, frame); !opened) return opened.error();
  }
  // The events of a lone sequence were made from it.
  if (sequence_ && lines_.is_open()) {
    if (auto pictured = compare(frame, place.index); !pictured || !*pictured) return pictured;
  }
  auto rgb = sequence_ ? sequence_->read(place.index) : film_->read(place.index);
  if (!rgb && rgb.error().code == Errc::bad_format) return false;
  if (!rgb) return rgb.error();
  if (film_) {  // whose sizes are even
    frame.width_px = frame.width_px / 2 * 2;
    frame.height_px = frame.height_px / 2 * 2;
  }
  const int width_px = sequence_ ? sequence_->width_px() : film_->width_px();
  const int height_px = sequence_ ? sequence_->height_px() : film_->height_px();
  if (frame.width_px != width_px || frame.height_px != height_px) {
    return Error{Errc::bad_format,
                 fmt::format("{}: frame {} is said to be {}x{}, and the file of its pixels is {}x{}", path_.string(),
                             place.index, frame.width_px, frame.height_px, width_px, height_px)};
  }
  frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(*std::move(rgb));
  return true;
}

Error RecordingReader::end() const {
  const std::string lost =
      frames_lost_ == 0 ? "" : fmt::format(" are whole, {} more are cut short or missing", frames_lost_);
  return {Errc::disconnected, fmt::format("{}: ends here; {} frames{}", path_.string(), frames_, lost)};
}

/// The next event into waiting_; false at the end.
Result<bool> RecordingReader::fetch_next() {
  for (;;) {
    auto taken = lines_.is_open() ? take_line() : take_of_sequence();
    if (!taken) return taken.error();
    if (!*taken) return false;
    if (auto* frame = std::get_if<wire::VideoFrame>(&(*taken)->event)) {
      const auto whole = settings_.pictures ? fetch_pixels(*frame, (*taken)->place) : Result<bool>(true);
      if (!whole) return whole.error();
      ++(*whole ? frames_ : frames_lost_);
      if (!*whole) continue;
    }
    waiting_ = std::move((*taken)->event);
    return true;
  }
}

std::optional<HostTime> RecordingReader::due(const wire::Event& event) {
  const auto time = time_of(event);
  if (!first_ && time) {
    first_ = last_ = time;
    began_ = host_now();
    return std::nullopt;
  }
  if (time) last_ = std::max(*last_, *time);
  if (!last_ || settings_.speed <= 0) return std::nullopt;
  const double since_s = (*last_ - *first_).seconds() / settings_.speed;
  return began_ + Duration::from_seconds(since_s);
}

Result<std::optional<wire::Event>> RecordingReader::next(Deadline deadline) {
  if (ended_) return *ended_;
  if (!waiting_) {
    const auto fetched = fetch_next();
    if (!fetched || !*fetched) {
      ended_ = fetched ? end() : fetched.error();
      return *ended_;
    }
  }
  if (const auto when = due(*waiting_)) {
    sleep_until(std::min(Deadline(*when), deadline));
    if (Deadline(*when) > deadline) return std::optional<wire::Event>();
  }
  return std::exchange(waiting_, std::nullopt);
}

}  // namespace birdseye::host
