#pragma once

#include <optional>
#include <string>

#include "calibration/record/calibration_record.hpp"
#include "device/birdseyed/raw_event.hpp"
#include "device/wire/messages.hpp"

namespace birdseye::device {

/// Decides whether the calibration record that the configuration names belongs to the instruments that are here. A
/// record of another camera or tracker is not passed on: an overlay by it would be wrong.
class CalibrationGuard {
 public:
  /// record: a calibration record as record_text() makes it; empty: there is none. A record that cannot be read is
  /// never in force. refused: why this one is not used with any instrument; empty: it may be.
  explicit CalibrationGuard(const std::string& record, const std::string& refused = "");

  void note(const InstrumentChanged& changed);
  void note_frame(int width_px, int height_px);
  /// What to tell clients, if it differs from what was last taken; else empty.
  std::optional<wire::Calibration> take_change();
  /// What is left between the times of frames and poses, by the record in force; null: nobody measured it.
  [[nodiscard]] const calibration::LatencyEntry* latency() const {
    return in_force_ && record_->latency ? &*record_->latency : nullptr;
  }
  /// Why the record is refused, in words; empty where it is in force, or where the instruments have yet to come.
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  void judge();

  std::string text_;
  std::optional<calibration::CalibrationRecord> record_;
  std::optional<calibration::Identity> tracker_, camera_;
  int width_px_ = 0, height_px_ = 0;
  bool in_force_ = false, changed_ = false;
  std::string fault_, awaited_;
};

}  // namespace birdseye::device
