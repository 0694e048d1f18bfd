#pragma once

#include <optional>
#include <string>
#include <vector>

#include "device/wire/messages.hpp"
#include "host/operation/instruments.hpp"

namespace birdseye::host {

/// Something that a recording is replayed by, and the instruments that it was found with.
struct ReplayBinding {
  std::string of;  ///< what it is, as "the calibration record"
  Instruments found_with;
  DependsOn depends_on = DependsOn::tracker_and_camera;
  std::string remedy;  ///< where the recording has other instruments
};

/// The instruments of a recording, as its events tell of them, and whether what it is replayed by holds with them.
class ReplayHardware {
 public:
  ReplayHardware() = default;
  /// first_told: the first identities in the recording, which hold from its beginning on. by_own_record: it is replayed
  /// by the calibration record that the appliance had in force.
  ReplayHardware(std::vector<ReplayBinding> bindings, Instruments first_told, bool by_own_record);

  void take(const wire::Event& event);
  /// Why nothing may be drawn over frames that come now; empty: it may.
  [[nodiscard]] const std::string& why_not() const { return withdrawn_.empty() ? misfit_ : withdrawn_; }
  /// And what to do about it.
  [[nodiscard]] const std::string& remedy() const { return remedy_; }
  /// What nothing tells, neither the recording nor what it is replayed by. Whoever replays answers for it.
  [[nodiscard]] const std::vector<std::string>& unproven() const { return unproven_; }

 private:
  void judge();
  void judge(const ReplayBinding& binding, const std::string& what, const calibration::Identity& found,
             const calibration::Identity& told);

  std::vector<ReplayBinding> bindings_;
  Instruments told_;
  bool by_own_record_ = false, was_in_force_ = false;
  std::string misfit_, withdrawn_, remedy_;
  std::vector<std::string> unproven_;
};

}  // namespace birdseye::host
