#pragma once

#include <cstdint>
#include <string>

#include "calibration/record/identity.hpp"
#include "device/wire/messages.hpp"

namespace birdseye::host {

/// The instruments that something was found with. An identity is empty where nobody has told it.
struct Instruments {
  calibration::Identity tracker, camera;
  std::uint64_t link = 0;   ///< by which of this window's connections they were told; 0: an earlier window's
  std::string reference{};  ///< the bird of that tracker that poses were relative to; empty: none
};

/// What a picture was taken with; empty where nobody has told it.
struct PictureHardware {
  calibration::Identity tracker, camera;
  std::string scope;  ///< its name, as its owner calls it
};

/// Enters what the appliance tells of them; of what it does not tell, what was known stays.
void take_identities(const wire::Health& health, Instruments& told);

/// What was found with `found` holds with what is connected now: it stands for that from now on. What nobody tells now
/// stays as it was told before, so that it can still turn out to be another.
Instruments taken_over(const Instruments& found, const Instruments& now);

/// What a finding depends on: hand-eye and lens on both instruments, a registration by touches on the tracker alone,
/// and on the reference sensor.
enum class DependsOn : std::uint8_t { tracker, tracker_and_camera };

/// Whether what was found with some hardware holds with what is connected now.
struct InstrumentMatch {
  bool holds = false;
  bool person_may_say = false;  ///< nothing tells what is connected now, or what it was: only a person can know
  std::string why_not;          ///< in words; empty where it holds
};

/// The instruments that are connected now, as the appliance tells them.
class ConnectedInstruments {
 public:
  /// The link came or went. Of the instruments behind another connection nothing is known before they are told.
  void set_link(bool connected);
  void take(const wire::Health& health);
  /// The reference that poses are relative to from now on; empty: none. A person's word does not make one of another.
  void set_reference(const std::string& name) { now_.reference = name; }
  /// A person says that the instruments are those from before, of whatever nobody tells of.
  void vouch() { vouched_ = true; }

  [[nodiscard]] const Instruments& now() const { return now_; }
  [[nodiscard]] bool connected() const { return connected_; }
  /// What tells no identity while it is connected is taken for the same instrument; after a reconnection it is not.
  [[nodiscard]] InstrumentMatch match(const Instruments& found_with, DependsOn depends_on) const;

 private:
  Instruments now_;
  bool connected_ = false, vouched_ = false;
};

}  // namespace birdseye::host
