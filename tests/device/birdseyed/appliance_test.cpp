#include "device/birdseyed/appliance.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "device/wire/client.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::device {
namespace {

/// Of each instrument that there is news of, what is said of it.
std::map<std::string, std::string> told_by(const wire::Health& health) {
  std::map<std::string, std::string> told;
  for (const wire::InstrumentHealth& one : health.instruments) told[one.name] = one.state + ": " + one.text;
  return told;
}

TEST(Appliance, EachChangeOfAnInstrumentIsToldInAHealthOfItsOwn) {
  const auto server = *wire::Server::listen("127.0.0.1", 0);
  const auto deadline = Deadline::after(Duration::from_ms(20'000));
  const auto client = *wire::Client::connect("127.0.0.1", server->port(), deadline);
  while (server->clients() == 0) ASSERT_FALSE(deadline.passed());

  Config config;
  config.tracker.line.device = "unix:/nowhere/tracker";
  config.camera.source = "unix:/nowhere/camera";
  const auto appliance = Appliance::start(config, *server);
  ASSERT_TRUE(appliance) << appliance.error().what;
  // From looking for the two to finding neither, which takes less than the second between one Health and the next.
  const std::map<std::string, std::string> looked_for{{"tracker", "starting: the tracker is being looked for"},
                                                      {"camera", "starting: the camera is being looked for"}};
  std::map<std::string, std::string> before;
  int changes = 0;
  const auto both_absent = [&] {
    return before.size() == 2 && before["tracker"].starts_with("absent") && before["camera"].starts_with("absent");
  };
  while (!both_absent()) {
    const auto event = client->next(deadline);
    ASSERT_TRUE(event) << event.error().what;
    ASSERT_TRUE(*event) << "Health says nothing of the instruments";
    const auto* const health = std::get_if<wire::Health>(&**event);
    if (health == nullptr) continue;
    std::map<std::string, std::string> now = told_by(*health);
    int changed = 0;
    for (const auto& [name, said] : now) {
      EXPECT_TRUE(before.contains(name) || said == looked_for.at(name)) << said << ": what came before was not told";
      changed += before.contains(name) && before[name] == said ? 0 : 1;
    }
    EXPECT_LE(changed, 1) << "changes were told together";
    changes += changed;
    before = std::move(now);
  }
  EXPECT_EQ(changes, 4) << "two instruments, each looked for and then absent";
}

}  // namespace
}  // namespace birdseye::device
