#include "host/bench/device_session.hpp"

#include <utility>
#include <variant>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::host {

namespace {

/// clients that take everything; then, where they are wanted, one that takes poses alone.
Result<std::vector<std::unique_ptr<DeviceListener>>> listen(const DeviceRig& rig, int clients, bool poses_alone) {
  std::vector<std::unique_ptr<DeviceListener>> listeners;
  for (int i = 0; i < clients; ++i) {
    auto client = wire::Client::connect("127.0.0.1", rig.port(), Deadline::after(Duration::from_seconds(15)));
    if (!client) return client.error();
    listeners.push_back(std::make_unique<DeviceListener>(*std::move(client)));
  }
  if (poses_alone) {
    auto client = wire::Client::connect("127.0.0.1", rig.port(), Deadline::after(Duration::from_seconds(15)));
    if (!client) return client.error();
    if (auto told =
            (*client)->subscribe({.frames = false, .tracking = true}, Deadline::after(Duration::from_seconds(1)));
        !told)
      return told.error();
    listeners.push_back(std::make_unique<DeviceListener>(*std::move(client)));
  }
  for (const auto deadline = Deadline::after(Duration::from_seconds(30)); !listeners.front()->posed();) {
    if (deadline.passed()) return Error{Errc::timeout, "no frame with a pose came within 30 s; see birdseyed.log"};
    sleep_for(Duration::from_ms(20));
  }
  return listeners;
}

}  // namespace

void DeviceListener::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    auto event = client_->next(Deadline::after(Duration::from_ms(100)));
    if (!event) {
      ended = event.error();
      return;
    }
    if (!*event) continue;
    const DeviceTime now = device_now();  // the appliance runs on this machine
    if (auto* frame = std::get_if<wire::VideoFrame>(&**event)) {
      frames.push_back({std::move(frame->info), now});
      posed_ = posed_ || frames.back().info.pose.tracker_from_sensor.has_value();
    } else if (const auto* some = std::get_if<wire::Birds>(&**event)) {
      birds.push_back(some->acquired);
      birds_at.push_back(now);
    } else if (auto* health = std::get_if<wire::Health>(&**event)) {
      healths.push_back(std::move(*health));
    }
  }
}

Result<DeviceSession> DeviceSession::start(const DeviceRigSettings& settings, int clients, bool poses_alone) {
  auto rig = DeviceRig::start(settings);
  if (!rig) return rig.error();
  auto listeners = listen(**rig, clients, poses_alone);
  if (!listeners) return listeners.error();
  return DeviceSession{*std::move(rig), *std::move(listeners)};
}

}  // namespace birdseye::host
