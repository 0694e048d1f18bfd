#include "host/overlay/field_watch.hpp"

#include <utility>

#include "host/files/picture.hpp"

namespace birdseye::host {

bool FieldWatch::take(const wire::VideoFrame& frame, const ScopeSetup& scope) {
  using calibration::FieldSize;
  constexpr Duration kEvery = Duration::from_ms(200);
  if (of_ != scope.round_field()) {
    const bool changes = state_ != FieldSize::cannot_tell;
    *this = FieldWatch();
    of_ = scope.round_field();
    if (changes) return true;
  }
  const CameraModel& camera = scope.camera();
  if (!of_ || frame.width_px != camera.width_px || frame.height_px != camera.height_px) return false;
  const DeviceTime at = frame.info.acquired;
  if (looked_at_ && at >= *looked_at_ && at - *looked_at_ < kEvery) return false;
  looked_at_ = at;
  const auto grey = grey_of(RgbView{*frame.rgb, frame.width_px, frame.height_px});
  const FieldSize now = calibration::compare_round_field(GreyView{grey, frame.width_px, frame.height_px}, *of_);
  // A dark picture takes nothing back.
  if (now == FieldSize::cannot_tell || std::exchange(last_, now) != now || now == state_) return false;
  state_ = now;
  return true;
}

}  // namespace birdseye::host
