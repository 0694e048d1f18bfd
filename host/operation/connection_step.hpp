#pragma once

#include <string>

#include "device/wire/messages.hpp"
#include "host/operation/live_step.hpp"
#include "host/operation/step_states.hpp"

namespace birdseye::host {

/// The first step: done while the appliance is there and ready. What tells nothing of its health, as another server or
/// its recording, is ready when it sends video and says nothing against it.
class ConnectionStep {
 public:
  void take(const wire::Health& health) { link_.health = health; }
  void take(const wire::Status& status) {
    link_.appliance_says = status.ok ? "" : status.text;
    link_.appliance_notes = status.ok ? status.text : "";
  }
  /// The link came or went. video: a frame has come. may_retry: nobody tries any more, but a person may have it tried
  /// again.
  void set_link(bool connected, const std::string& words, bool video, bool may_retry = false);

  [[nodiscard]] const LinkState& link() const { return link_; }
  [[nodiscard]] const StepNote& note() const { return note_; }

 private:
  LinkState link_;
  StepNote note_;
};

}  // namespace birdseye::host
