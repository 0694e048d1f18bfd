#pragma once

#include <optional>
#include <string>

#include "calibration/record/calibration_record.hpp"
#include "device/birdseyed/raw_event.hpp"
#include "device/wire/messages.hpp"

namespace birdseye::device {

/// Whether the calibration record that the appliance was told of is of the instruments that are here. One of another
/// camera or tracker is not passed on: an overlay by it would be wrong.
class CalibrationGuard {
 public:
  /// record: as record_text() makes it; empty: there is none. One that cannot be read is never in force.
  explicit CalibrationGuard(const std::string& record);

  void note(const InstrumentChanged& changed);
  void note_frame(int width_px, int height_px);
  /// When it became another than was last taken.
  std::optional<wire::Calibration> take_change();
  /// Why it is refused, in words; empty where it is not, or where the instruments have yet to come.
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
