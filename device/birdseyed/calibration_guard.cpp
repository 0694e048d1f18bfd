#include "device/birdseyed/calibration_guard.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "device/wire/json.hpp"

namespace birdseye::device {

namespace {

constexpr std::size_t kMostMessageBytes = 65'000;  // of OpenIGTLink's STRING, whose length has 16 bits

}  // namespace

CalibrationGuard::CalibrationGuard(const std::string& record, const std::string& refused) : text_(record) {
  changed_ = true;  // also that there is none: who had one before must not go on with it
  if (record.empty()) {
    awaited_ = "no calibration record is configured; see [calibration] record";
    return;
  }
  auto parsed = calibration::parse_record(record);
  // In the message that carries it, quotes and other characters take more room than in the file.
  const std::size_t bytes = wire::text_of(wire::Calibration{true, "", record}).size();
  if (!parsed) {
    fault_ = "calibration: " + parsed.error().what;
  } else if (!refused.empty()) {
    fault_ = "calibration: " + refused;
  } else if (bytes > kMostMessageBytes) {
    fault_ = fmt::format("calibration: the record takes {} bytes of a message that holds {}; shorten its names", bytes,
                         kMostMessageBytes);
  } else {
    record_ = *std::move(parsed);
  }
  judge();
}

void CalibrationGuard::note(const InstrumentChanged& changed) {
  if (!record_ || changed.state != InstrumentState::running) return;
  if (changed.instrument == Instrument::tracker) tracker_ = changed.identity;
  if (changed.instrument == Instrument::camera) {
    camera_ = changed.identity;
    width_px_ = height_px_ = 0;  // another camera may have come
  }
  judge();
}

void CalibrationGuard::note_frame(int width_px, int height_px) {
  if (!record_ || (width_px == width_px_ && height_px == height_px_)) return;
  width_px_ = width_px;
  height_px_ = height_px;
  judge();
}

void CalibrationGuard::judge() {
  if (!record_) return;
  std::string fault, awaited;
  const auto compare = [&](const char* what, const calibration::Identity& recorded,
                           const std::optional<calibration::Identity>& told) {
    if (!fault.empty()) return;
    if (told) {
      fault = calibration::misfit(what, recorded, *told);
    } else if (awaited.empty()) {
      awaited = fmt::format("the {} has not come yet", what);
    }
  };
  compare("tracker", record_->tracker, tracker_);
  compare("camera", record_->camera, camera_);
  if (fault.empty() && record_->lens) {
    const CameraModel& camera = record_->lens->camera;
    if (width_px_ == 0) {
      if (awaited.empty()) awaited = "no frame has come yet";
    } else if (width_px_ != camera.width_px || height_px_ != camera.height_px) {
      fault = fmt::format("the record is of frames of {} x {}; these are {} x {}", camera.width_px, camera.height_px,
                          width_px_, height_px_);
    }
  }
  if (!fault.empty()) fault = fmt::format("calibration of scope \"{}\" is not used: {}", record_->scope, fault);
  const bool in_force = fault.empty() && awaited.empty();
  changed_ = changed_ || in_force != in_force_ || fault != fault_ || awaited != awaited_;
  in_force_ = in_force;
  fault_ = std::move(fault);
  awaited_ = std::move(awaited);
}

std::optional<wire::Calibration> CalibrationGuard::take_change() {
  if (!std::exchange(changed_, false)) return std::nullopt;
  return wire::Calibration{in_force_, fault_.empty() ? awaited_ : fault_, in_force_ ? text_ : ""};
}

}  // namespace birdseye::device
