#include "host/operation/connection_step.hpp"

#include <fmt/format.h>

#include "host/texts/texts.hpp"

namespace birdseye::host {

void ConnectionStep::set_link(bool connected, const std::string& words, bool video, bool may_retry) {
  link_.connected = connected;
  link_.words = words;
  link_.may_retry = may_retry;
  if (!connected) {
    link_.health.reset();
    link_.appliance_says.clear();
    link_.appliance_notes.clear();
  }
  const auto& health = link_.health;
  note_.done = connected && (health ? health->state == "ready" : video && link_.appliance_says.empty());
  note_.line = words;
  if (connected && health && !note_.done) note_.line = host::words("note_appliance_is", health->state);
  if (connected && !health && !link_.appliance_says.empty()) note_.line = link_.appliance_says;
}

}  // namespace birdseye::host
