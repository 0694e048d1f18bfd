#include "host/guide/live_hand_eye.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>

#include "drivers/system/clock.hpp"
#include "drivers/system/interrupt.hpp"
#include "host/link/appliance_link.hpp"
#include "host/link/event_stream.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kStationSilence = Duration::from_ms(6000);
constexpr Duration kLook = Duration::from_ms(200);  // how soon an interruption is seen

/// Whether frames and the scope's poses come, and what the appliance says of it if not.
class Silence {
 public:
  explicit Silence(const LivePlan& plan) : plan_(plan) {}

  void hear(const wire::Event& event) {
    if (std::holds_alternative<wire::VideoFrame>(event)) heard_ = host_now();
    if (const auto* status = std::get_if<wire::Status>(&event)) status_ = status->text;
    const auto* birds = std::get_if<wire::Birds>(&event);
    if (birds == nullptr) return;
    for (const wire::Bird& bird : birds->birds) {
      if (bird.name == plan_.guide.bird) {
        posed_ = host_now();
      } else if (others_.find(bird.name) == std::string::npos) {
        others_ += (others_.empty() ? "" : ", ") + bird.name;
      }
    }
  }

  [[nodiscard]] Result<void> check() const {
    const std::int64_t seconds = kStationSilence.ns / 1'000'000'000;
    if (host_now() - heard_ > kStationSilence) {
      return Error{Errc::timeout, fmt::format("{}: no frame has come for {} s{}{}", plan_.server, seconds,
                                              status_.empty() ? "" : ": ", status_)};
    }
    if (host_now() - posed_ > kStationSilence) {
      return Error{Errc::timeout, fmt::format("{}: no pose of \"{}\" has come for {} s{}{}", plan_.server,
                                              plan_.guide.bird, seconds, others_.empty() ? "" : "; there is " + others_,
                                              status_.empty() ? "" : "; it says: " + status_)};
    }
    return {};
  }

 private:
  const LivePlan& plan_;
  HostTime heard_ = host_now(), posed_ = heard_;
  std::string status_, others_;
};

Result<GuidedStations> lead(const LivePlan& plan, EventStream& stream, Progress& progress) {
  HandEyeGuide guide(plan.guide, {[&](const std::string& line) { progress(line); },
                                  [&](const std::string& line) { progress.keep(line); }});
  Silence silence(plan);
  const HostTime ends = host_now() + Duration::from_seconds(plan.seconds);
  std::string said;
  while (!guide.ended()) {
    auto event = stream.next(Deadline::after(kLook));
    if (!event) return event.error();
    if (*event) {
      silence.hear(**event);
      if (const auto* status = std::get_if<wire::Status>(&**event)) {
        if (!status->ok && status->text != said) progress.keep("the appliance says: " + status->text);
        said = status->text;
      }
      if (auto taken = guide.take(**event); !taken) return taken.error();
    }
    if (const auto heard = silence.check(); !heard) return heard.error();
    if (interrupted()) guide.end("interrupted");
    if (host_now() > ends) guide.end(words("guide_time_over", plan.seconds));
  }
  // What comes while the solver works is of no use to it.
  if (const std::string words = stream.drops().words(); !words.empty()) progress.keep(words);
  return guide.finish();
}

}  // namespace

Result<GuidedStations> guide_hand_eye(const LivePlan& plan, Progress& progress) {
  if (const auto sound = HandEyeGuide::check(plan.guide); !sound) return sound.error();
  auto client = connect_appliance(plan.server);
  if (!client) return client.error();
  if (const std::string who = answered_words(plan.server, (*client)->machine()); !who.empty()) progress.keep(who);
  // Focus or exposure that changes from view to view would be another lens.
  if (const auto locked = (*client)->lock_camera(true, Deadline::after(Duration::from_ms(2000))); !locked)
    return locked.error();
  note_interrupts();
  EventStream stream(*std::move(client), 60);
  return lead(plan, stream, progress);
}

Result<GuidedStations> stations_of_recording(EventSource& recording, const GuidePlan& asked, Progress& progress) {
  if (const auto sound = HandEyeGuide::check(asked); !sound) return sound.error();
  GuidePlan plan = asked;
  plan.fewest_stations = plan.most_stations;  // a verdict of pass does not end it: the recording holds what it holds
  bool begun = false;                         // what to do with the hands is nothing to say to a recording
  HandEyeGuide guide(plan, {[](const std::string&) {},
                            [&](const std::string& line) {
                              if (begun) progress.keep(line);
                            }});
  begun = true;
  note_interrupts();
  std::map<std::string, std::size_t> poses;
  while (!guide.ended()) {
    if (interrupted()) return Error{Errc::disconnected, "interrupted; nothing is left running"};
    const auto event = recording.next(Deadline::after(kStationSilence));
    if (!event && event.error().code != Errc::disconnected) return event.error();
    if (!event) {
      guide.end(words("guide_recording_ended"));
    } else if (*event) {
      if (const auto* birds = std::get_if<wire::Birds>(&**event)) {
        for (const wire::Bird& bird : birds->birds) ++poses[bird.name];
      }
      if (const auto taken = guide.take(**event); !taken) return taken.error();
    }
  }
  if (poses.contains(plan.bird)) return guide.finish();
  std::vector<std::string> names;
  names.reserve(poses.size());
  for (const auto& [name, count] : poses) names.push_back(name);
  return Error{Errc::not_found,
               fmt::format("the recording has no poses of \"{}\", but of {}: say by --bird which are the scope's",
                           plan.bird, names.empty() ? "nobody" : fmt::format("{}", fmt::join(names, ", ")))};
}

}  // namespace birdseye::host
