#include "host/guide/live_poses.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <set>

#include "drivers/system/clock.hpp"
#include "drivers/system/interrupt.hpp"
#include "host/link/appliance_link.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kPoseSilence = Duration::from_ms(5000);
constexpr Duration kPoseLook = Duration::from_ms(200);  // how soon an interruption is seen

}  // namespace

Result<PoseSet> collect_poses(const std::string& server, const std::string& bird, double seconds, Progress& progress) {
  wire::ForeignSettings foreign;
  foreign.scope_bird.clear();  // bird is the name that the server gives
  auto client = connect_appliance(server, foreign);
  if (!client) return client.error();
  if (const std::string who = answered_words(server, (*client)->machine()); !who.empty()) progress.keep(who);
  if (const auto done = (*client)->subscribe({.frames = false, .tracking = true}, Deadline::after(kPoseSilence)); !done)
    return done.error();
  note_interrupts();
  PoseSet set;
  set.timed = true;
  std::set<std::string> others;
  std::string status;
  std::size_t index = 0;
  std::optional<DeviceTime> first;
  HostTime heard = host_now();
  for (double since_s = 0; since_s < seconds && !interrupted();) {
    const auto event = (*client)->next(Deadline::after(kPoseLook));
    if (!event) return event.error();
    if (host_now() - heard > kPoseSilence) {
      return Error{Errc::timeout,
                   fmt::format("{}: no pose of \"{}\" for {} s{}{}", server, bird, kPoseSilence.ns / 1'000'000'000,
                               others.empty() ? "" : fmt::format("; it tells of {}", fmt::join(others, ", ")),
                               status.empty() ? "" : "; it says: " + status)};
    }
    if (!*event) continue;
    if (const auto* told = std::get_if<wire::Status>(&**event)) status = told->text;
    const auto* birds = std::get_if<wire::Birds>(&**event);
    if (birds == nullptr) continue;
    ++index;
    for (const wire::Bird& one : birds->birds) {
      if (one.name != bird) {
        others.insert(one.name);
        continue;
      }
      heard = host_now();
      if (!first) first = birds->acquired;
      since_s = (birds->acquired - *first).seconds();
      set.poses.push_back({fmt::format("pose {}", index), index - 1, since_s, since_s, one.tracker_from_sensor});
      // Once a second: the progress does not repeat a line.
      progress(fmt::format("poses of {} for {:.0f} of {:.0f} s", bird, std::floor(since_s), seconds));
    }
  }
  return set;
}

}  // namespace birdseye::host
