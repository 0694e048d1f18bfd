#include "device/wire/foreign_feed.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "device/wire/igtl_bytes.hpp"

namespace birdseye::wire {

namespace {

constexpr Duration kUnstampedSigma = Duration::from_ms(50);
/// Poses of a picture's time often follow it; a picture that waits longer grows old.
constexpr Duration kPatience = Duration::from_ms(40);
constexpr Duration kSilence = Duration::from_ms(2000);
/// No tracker measures the same to the last digit for so long: what repeats itself is no measurement.
constexpr Duration kFrozen = Duration::from_ms(1000);
constexpr Duration kWayBack = Duration::from_ms(1000);
constexpr std::size_t kMostWaiting = 4, kMostNames = 32, kMostWords = 200;

/// Trackers that others speak for are slower than ours; what a hole of this width hides is in the pose's sigma.
PoseHistory::Settings history_settings() {
  PoseHistory::Settings settings;
  settings.max_gap = Duration::from_ms(120);
  return settings;
}

template <typename Names>
std::string list_of(const Names& names) {
  return fmt::format("\"{}\"", fmt::join(names, "\", \""));
}

std::string frozen_words(const std::string& name) {
  return fmt::format("the pose of \"{}\" stands still to the last digit: does its tracker still measure?", name);
}

}  // namespace

void ForeignFeed::pass_over(const std::string& what) {
  if (passed_over_.size() < kMostNames) passed_over_.insert(what);
}

/// The message's time on the server's clock. Without a stamp, by when it came.
DeviceTime ForeignFeed::time_of(const Header& header, HostTime arrived) {
  if (header.time.ns == 0) return relation_.device_from_host(arrived).value_or(DeviceTime{arrived.ns});
  if (const auto step = relation_.push(header.time, arrived)) {
    events_.emplace_back(ClockChange{header.time, "server", to_string(step->kind), {step->by_ns}, 0});
    for (auto& [name, tool] : tools_) tool.poses = PoseHistory(history_settings());
  }
  return header.time;
}

bool ForeignFeed::is_other_video(const std::string& device) {
  if (!settings_.video_device.empty() && device != settings_.video_device) {
    pass_over(fmt::format("IMAGE \"{}\"", device));
    if (videos_.size() < kMostNames) videos_.insert(device);
    return true;
  }
  if (videos_.size() < kMostNames) videos_.insert(device);
  return settings_.video_device.empty() && videos_.size() > 1;
}

void ForeignFeed::push(const Header& received, std::span<const std::uint8_t> body, HostTime arrived) {
  Header header = received;
  header.device = readable(header.device);
  auto read = read_foreign(header, body);
  if (!read) {
    if (read.error().code == Errc::unsupported) {
      if (!is_other_video(header.device)) picture_fault_ = read.error().what;
    } else {
      ++damaged_;
      damage_ = read.error().what;
    }
  } else if (auto* picture = std::get_if<ForeignPicture>(&*read)) {
    take(header, std::move(*picture), arrived);
  } else if (const auto* poses = std::get_if<ForeignPoses>(&*read)) {
    take(header, *poses, arrived);
  } else if (const auto* status = std::get_if<ForeignStatus>(&*read)) {
    server_says_ = status->words.substr(0, kMostWords);
  } else if (std::holds_alternative<ForeignAnswer>(*read)) {
    return;
  } else if (std::holds_alternative<ForeignVolume>(*read)) {
    pass_over("IMAGE of several slices");
  } else {
    pass_over(header.type);
  }
}

void ForeignFeed::take(const Header& header, ForeignPicture picture, HostTime arrived) {
  if (is_other_video(header.device)) return;
  picture_fault_.clear();
  pictured_ = arrived;
  pictures_stamped_ = header.time.ns != 0;
  Waiting waiting;
  waiting.stamped = pictures_stamped_;
  waiting.due = arrived + kPatience;
  VideoFrame& frame = waiting.frame;
  frame.info.acquired = time_of(header, arrived);
  frame.info.sequence = pictures_++;
  frame.info.acquired_sigma = waiting.stamped ? kForeignStampSigma : kUnstampedSigma;
  frame.info.arrived = relation_.device_from_host(arrived).value_or(DeviceTime{arrived.ns});
  frame.width_px = picture.width_px;
  frame.height_px = picture.height_px;
  frame.rgb = std::move(picture.rgb);
  waiting_.push_back(std::move(waiting));
}

void ForeignFeed::take(const Header& header, const ForeignPoses& poses, HostTime arrived) {
  const DeviceTime time = time_of(header, arrived);
  const bool stamped = header.time.ns != 0;
  const auto tool_of = [&](const std::string& name) -> Tool* {
    // By its name it takes the tracker's points to the tool: no pose of the tool.
    if (name.starts_with("TrackerTo")) {
      pass_over(fmt::format("\"{}\", which by its name is the way back", name));
      return nullptr;
    }
    if (tools_.size() >= kMostNames && !tools_.contains(name)) return nullptr;
    return &tools_.try_emplace(name, Tool{PoseHistory(history_settings()), std::nullopt, std::nullopt, {}, stamped})
                .first->second;
  };
  for (const std::string& name : poses.doubled)
    pass_over(fmt::format("\"{}\", which stands twice in one list: give the tools names whose first {} bytes differ",
                          name, kMostBirdNameBytes));
  for (const std::string& name : poses.no_poses) (void)tool_of(name);
  Birds birds{time, {}};
  for (const Bird& bird : poses.birds) {
    Tool* const tool = tool_of(bird.name);
    if (tool == nullptr) continue;
    tool->heard = arrived;
    const bool repeated = tool->last && time >= tool->still_since &&
                          tool->last->tracker_from_sensor.matrix() == bird.tracker_from_sensor.matrix();
    if (!repeated) {
      tool->still_since = time;
      tool->last = bird;
    }
    tool->stamped = stamped;
    const auto newest = tool->poses.newest();
    if (newest && *newest - time > kWayBack) tool->poses = PoseHistory(history_settings());
    // One that is sent twice, as by TRANSFORM and by TDATA, is one measurement.
    if (stamped && !tool->poses.push(time, kForeignStampSigma, bird.tracker_from_sensor)) continue;
    birds.birds.push_back(bird);
  }
  if (settings_.scope_bird.empty()) {
    if (!birds.birds.empty()) events_.emplace_back(std::move(birds));
    return;
  }
  const Scope chosen = scope();
  std::erase_if(birds.birds, [&](const Bird& bird) {
    return bird.name == settings_.scope_bird && (chosen.name == nullptr || *chosen.name != bird.name);
  });
  for (Bird& bird : birds.birds) {
    if (chosen.name != nullptr && bird.name == *chosen.name) bird.name = settings_.scope_bird;
  }
  if (!birds.birds.empty()) events_.emplace_back(std::move(birds));
}

ForeignFeed::Scope ForeignFeed::scope() const {
  std::vector<std::string> names;
  names.reserve(tools_.size());
  for (const auto& [name, tool] : tools_) {
    if (name != settings_.not_scope) names.push_back(name);
  }
  if (names.empty()) {
    return {nullptr, nullptr,
            tools_.empty() ? "the server sends video and no poses (TRANSFORM or TDATA messages)"
                           : fmt::format("of poses only the pointer's come, \"{}\"", settings_.not_scope)};
  }
  const std::string& wanted = settings_.scope_device;
  const auto found = tools_.find(wanted.empty() ? names.front() : wanted);
  if (found == tools_.end()) {
    return {nullptr, nullptr,
            fmt::format("no poses of \"{}\" come; there are those of {}: say by --scope-device which are the scope's",
                        wanted, list_of(names))};
  }
  if (wanted.empty() && names.size() > 1) {
    return {nullptr, nullptr,
            fmt::format("several devices send poses, {}: say by --scope-device which are the scope's", list_of(names))};
  }
  if (!found->second.stamped) {
    return {&found->first, nullptr,
            fmt::format("\"{}\" gives its poses no time, so that which of them belongs to a picture is not known",
                        found->first)};
  }
  return {&found->first, &found->second, ""};
}

PoseAnswer ForeignFeed::pose_of(const Waiting& waiting, const Scope& scope) const {
  PoseAnswer refused;
  if (!waiting.stamped) {
    refused.reason = "the server gives its pictures no time, so that which pose belongs to one is not known";
    return refused;
  }
  if (scope.tool == nullptr) {
    refused.reason = scope.why;
    return refused;
  }
  if (scope.tool->last && waiting.frame.info.acquired - scope.tool->still_since > kFrozen) {
    refused.reason = frozen_words(*scope.name);
    return refused;
  }
  return scope.tool->poses.at(waiting.frame.info.acquired);
}

std::optional<HostTime> ForeignFeed::due() const {
  if (waiting_.empty()) return std::nullopt;
  return waiting_.front().due;
}

std::optional<Event> ForeignFeed::next(HostTime now) {
  std::string trouble_now = trouble(now);
  if (trouble_now != told_) {
    told_ = std::move(trouble_now);
    return Event(Status{told_.empty(), told_});
  }
  if (!events_.empty()) {
    Event event = std::move(events_.front());
    events_.pop_front();
    return event;
  }
  if (waiting_.empty()) return std::nullopt;
  Waiting& first = waiting_.front();
  const Scope chosen = scope();
  // At first no tool may have been heard of yet.
  const bool settled = !first.stamped || (chosen.tool == nullptr ? !tools_.empty() || now - began_ > kSilence
                                                                 : chosen.tool->poses.newest().value_or(DeviceTime{}) >=
                                                                       first.frame.info.acquired);
  if (!settled && now < first.due && waiting_.size() <= kMostWaiting) return std::nullopt;
  first.frame.info.pose = pose_of(first, chosen);
  Event event(std::move(first.frame));
  waiting_.pop_front();
  return event;
}

std::string ForeignFeed::video_trouble(HostTime now) const {
  if (!picture_fault_.empty()) return picture_fault_;
  if (settings_.video_device.empty() && videos_.size() > 1) {
    return fmt::format("several devices send video, {}: say by --video-device which is the scope's", list_of(videos_));
  }
  if (now - pictured_.value_or(began_) > kSilence) {
    if (!videos_.empty() && !pictured_) {
      return fmt::format("no video of \"{}\" comes; there is that of {}: say by --video-device which is the scope's",
                         settings_.video_device, list_of(videos_));
    }
    return tools_.empty() ? "the server sends neither video nor poses"
                          : "the server sends poses and no video (IMAGE messages)";
  }
  if (pictured_ && !pictures_stamped_)
    return "the server gives its pictures no time: they are shown as they come, and nothing is drawn over them";
  return {};
}

std::string ForeignFeed::trouble(HostTime now) const {
  if (auto video = video_trouble(now); !video.empty()) return video;
  if (const auto behind = relation_.behind()) {
    return fmt::format(
        "what the server sends comes {:.1f} s later than it did: the network does not carry it; send "
        "smaller pictures, or fewer",
        behind->seconds());
  }
  if (tools_.empty() && now - began_ <= kSilence) return {};
  const Scope chosen = scope();
  if (chosen.tool == nullptr) return chosen.why;
  if (now - chosen.tool->heard.value_or(began_) > kSilence)
    return fmt::format("\"{}\" sends no poses now; is it in sight of its tracker?", *chosen.name);
  if (const auto newest = chosen.tool->poses.newest(); newest && *newest - chosen.tool->still_since > kFrozen)
    return frozen_words(*chosen.name);
  return {};
}

std::optional<RelatedTime<HostTime>> ForeignFeed::host_from_device(DeviceTime time) const {
  if (const auto related = relation_.host_from_device(time)) return related;
  if (!pictured_ && tools_.empty()) return std::nullopt;
  return RelatedTime<HostTime>{{time.ns}, kUnstampedSigma};
}

std::string ForeignFeed::words() const {
  std::string words = "an OpenIGTLink server that is no appliance of Birdseye";
  if (!passed_over_.empty()) words += fmt::format("; passed over: {}", fmt::join(passed_over_, ", "));
  if (!server_says_.empty()) words += fmt::format("; it says: {}", server_says_);
  if (damaged_ > 0) words += fmt::format("; {} damaged messages, the last: {}", damaged_, damage_);
  return words;
}

}  // namespace birdseye::wire
