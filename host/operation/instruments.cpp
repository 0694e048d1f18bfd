#include "host/operation/instruments.hpp"

#include "host/texts/texts.hpp"

namespace birdseye::host {

void ConnectedInstruments::set_link(bool connected) {
  if (connected == connected_) return;
  connected_ = connected;
  // The first messages of a connection may have been taken before its word: what they told stays.
  now_ = connected ? Instruments{now_.tracker, now_.camera, now_.link + 1, now_.reference}
                   : Instruments{{}, {}, now_.link, now_.reference};
  vouched_ = false;
}

void take_identities(const wire::Health& health, Instruments& told) {
  for (const wire::InstrumentHealth& instrument : health.instruments) {
    if (instrument.identity.empty()) continue;
    if (instrument.name == "tracker") told.tracker = instrument.identity;
    if (instrument.name == "camera") told.camera = instrument.identity;
  }
}

Instruments taken_over(const Instruments& found, const Instruments& now) {
  Instruments out = now;
  if (out.tracker.empty()) out.tracker = found.tracker;
  if (out.camera.empty()) out.camera = found.camera;
  return out;
}

void ConnectedInstruments::take(const wire::Health& health) {
  take_identities(health, now_);
}

InstrumentMatch ConnectedInstruments::match(const Instruments& found_with, DependsOn depends_on) const {
  if (!connected_) return {false, false, words("held_no_link")};
  const auto match_one = [&](const std::string& what, const calibration::Identity& found,
                             const calibration::Identity& told) -> InstrumentMatch {
    if (!found.empty() && !told.empty()) {
      const auto other = calibration::first_difference(found, told);
      if (!other) return {true, false, ""};
      if (other->told.empty()) return {false, false, words("held_other_untold", what, other->name, other->recorded)};
      return {false, false, words("held_other", what, other->name, other->recorded, other->told)};
    }
    if (vouched_ || found_with.link == now_.link) return {true, false, ""};
    return {false, true, words("held_untold", what)};
  };
  if (depends_on == DependsOn::tracker && found_with.reference != now_.reference) {
    if (now_.reference.empty()) return {false, false, words("held_reference_gone", found_with.reference)};
    if (found_with.reference.empty()) return {false, false, words("held_reference_new", now_.reference)};
    return {false, false, words("held_reference_other", found_with.reference, now_.reference)};
  }
  InstrumentMatch tracker = match_one(words("instrument_tracker"), found_with.tracker, now_.tracker);
  if (depends_on == DependsOn::tracker) return tracker;
  InstrumentMatch camera = match_one(words("instrument_camera"), found_with.camera, now_.camera);
  if (tracker.holds) return camera;
  // Whoever is asked for the one instrument's sake must not let the other, known to be another, pass.
  return !camera.holds && !camera.person_may_say ? camera : tracker;
}

}  // namespace birdseye::host
