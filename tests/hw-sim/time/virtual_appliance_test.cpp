// The appliance, its tracker and a client in virtual time: the objects that the programs are made of.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "device/birdseyed/appliance.hpp"
#include "device/wire/client.hpp"
#include "hw-sim/local/local_line.hpp"
#include "hw-sim/local/local_link.hpp"
#include "hw-sim/minibird/motion.hpp"
#include "hw-sim/minibird/tracker_loop.hpp"
#include "hw-sim/time/virtual_time.hpp"

namespace birdseye::hw_sim {
namespace {

/// What a client heard of a bird on a circle.
struct Heard {
  std::uint64_t birds = 0, healths = 0;
  double worst_mm = 0, longest_gap_s = 0;
  std::vector<std::string> states;                   ///< of the tracker, as Health told them
  std::uint64_t hash = 14'695'981'039'346'656'037U;  ///< of all poses and times
  VirtualTimeFigures figures;
};

void enter(Heard& heard, std::int64_t value) {
  heard.hash = (heard.hash ^ static_cast<std::uint64_t>(value)) * 1'099'511'628'211U;
}

Heard listen_for(double seconds, std::uint64_t seed, const std::vector<Fault>& faults = {}) {
  Heard heard;
  const Circle circle;
  const auto ran = run_in_virtual_time({.seed = seed}, [&] {
    const std::int64_t zero_ns = device_now().ns;
    const LocalLine line("sim:tracker");
    TrackerSettings tracker;
    tracker.seed = seed;
    tracker.faults = faults;
    const TrackerLoop unit(line.instrument(), TrackerScript(tracker, circle_motion(circle, zero_ns), zero_ns), {});
    const LocalNetwork network({.delay = Duration::from_ms(1)});
    const auto server = wire::Server::over(network.listener());
    device::Config config;
    config.tracker.line.device = "/sim/tracker";
    config.tracker.open_line = [&line](const auto&) { return line.open(); };
    config.open_camera = [](const auto&) -> Result<std::unique_ptr<drivers::FrameSource>> {
      return Error{Errc::not_found, "sim:camera: is not there"};
    };
    const auto appliance = *device::Appliance::start(config, *server);
    const auto client = wire::Client::over(network.connect(), "the simulated appliance");
    DeviceTime last{};
    for (const DeviceTime end = device_now() + Duration::from_seconds(seconds); device_now() < end;) {
      const auto event = client->next(end);
      ASSERT_TRUE(event) << event.error().what;
      if (!*event) continue;
      if (const auto* const health = std::get_if<wire::Health>(&**event)) {
        ++heard.healths;
        const std::string state = health->instruments.empty() ? "" : health->instruments.front().state;
        if (heard.states.empty() || heard.states.back() != state) heard.states.push_back(state);
      }
      const auto* const birds = std::get_if<wire::Birds>(&**event);
      if (birds == nullptr) continue;
      ++heard.birds;
      const double at_s = static_cast<double>(birds->acquired.ns - zero_ns) * 1e-9;
      const auto& told_mm = birds->birds.at(0).tracker_from_sensor.translation();
      heard.worst_mm = std::max(heard.worst_mm, (told_mm - circle.pose(0, at_s).position_mm).norm());
      if (last.ns != 0) heard.longest_gap_s = std::max(heard.longest_gap_s, (birds->acquired - last).seconds());
      last = birds->acquired;
      enter(heard, birds->acquired.ns);
      for (int axis = 0; axis < 3; ++axis) enter(heard, std::llround(told_mm[axis] * 1e6));
    }
  });
  EXPECT_TRUE(ran) << ran.error().what;
  if (ran) heard.figures = *ran;
  return heard;
}

TEST(VirtualAppliance, TenMinutesOfATrackerComeOverTheWireAsTheyWere) {
  const Heard heard = listen_for(600, 1);
  EXPECT_NEAR(static_cast<double>(heard.birds) / 600, 103.3, 1.5);
  EXPECT_GT(heard.healths, 590U);
  // 628 mm/s by the time that a pose is stamped with, which is known to some ms.
  EXPECT_LT(heard.worst_mm, 3);
  EXPECT_LT(heard.longest_gap_s, 0.05);
}

TEST(VirtualAppliance, ATrackerThatIsUnpluggedIsNamedAndComesBack) {
  Fault pulled;
  pulled.kind = FaultKind::unplug;
  pulled.at_s = 20;
  pulled.for_s = 3;
  const Heard heard = listen_for(60, 2, {pulled});
  EXPECT_EQ(heard.states, (std::vector<std::string>{"starting", "running", "absent", "running"}));
  EXPECT_GT(heard.longest_gap_s, 3);
  EXPECT_LT(heard.longest_gap_s, 3 + 2) << "within 2 s of the fault's end all is well";
  EXPECT_LT(heard.worst_mm, 3);
}

TEST(VirtualAppliance, TheSameSeedIsHeardTheSameToTheBit) {
  const Heard first = listen_for(60, 5), again = listen_for(60, 5), other = listen_for(60, 6);
  EXPECT_EQ(first.hash, again.hash);
  EXPECT_EQ(first.figures.order_hash, again.figures.order_hash);
  EXPECT_EQ(first.figures.switches, again.figures.switches);
  EXPECT_NE(first.figures.order_hash, other.figures.order_hash);
}

}  // namespace
}  // namespace birdseye::hw_sim
