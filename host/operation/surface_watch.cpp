#include "host/operation/surface_watch.hpp"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <cmath>
#include <exception>
#include <utility>

#include "host/registration/geometry/organ_surface.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

Result<PinholeView> seen_by(const KeptView& view, const CameraModel& camera) {
  const wire::VideoFrame& frame = view.frame;
  return view_to_check(camera, view.camera_from_patient, {*frame.rgb, frame.width_px, frame.height_px});
}

Result<SurfaceCheck> check_of(const WatchedSurface& surface) {
  std::vector<PinholeView> kept;
  for (const KeptView& view : surface.views) {
    auto pinhole = seen_by(view, surface.camera);
    if (!pinhole) return pinhole.error();
    kept.push_back(*std::move(pinhole));
  }
  return SurfaceCheck(deformed_distance(surface.organ->distance, surface.deformed->field), std::move(kept));
}

}  // namespace

/// The thread's alone, but for the pointer.
struct SurfaceWatch::Shown {
  WatchedSurface surface;
  std::optional<Result<SurfaceCheck>> check;  ///< made by the first frame

  SurfaceFinding find(const KeptView& frame, const std::optional<double>& pose_mm) {
    SurfaceFinding out;
    if (!surface.deformed->seen_rms_mm || !pose_mm) {
      out.words = pose_mm ? words("check_unknown_surface") : words("check_unknown_hand_eye");
      return out;
    }
    if (!check) check = check_of(surface);
    const auto now = seen_by(frame, surface.camera);
    if (!*check || !now) {
      out.words = *check ? now.error().what : check->error().what;
      return out;
    }
    // The error is of three axes, and one of them is along the normal.
    return (*check)->check(*now, {*surface.deformed->seen_rms_mm / std::sqrt(3.0), *pose_mm});
  }
};

void SurfaceWatch::show(WatchedSurface surface) {
  shown_ = std::make_shared<Shown>(Shown{std::move(surface), std::nullopt});
  last_.reset();
}

void SurfaceWatch::offer(const KeptView& frame, const std::optional<double>& pose_mm, HostTime now) {
  constexpr Duration kEvery = Duration::from_ms(1000);
  if (!shown_ || checking_.running() || (last_ && now - *last_ < kEvery)) return;
  last_ = now;
  checking_.start([shown = shown_, frame, pose_mm, now](const std::stop_token&, const auto&) {
    // On one core: the others have the live picture to draw.
    tbb::task_arena one(1);
    try {
      return one.execute([&] { return Outcome{{shown->find(frame, pose_mm), now}, shown}; });
    } catch (const std::exception& problem) {  // of a library: it must not end the operation
      SurfaceFinding none;
      none.words = words("check_broke_off", problem.what());
      return Outcome{{std::move(none), now}, shown};
    }
  });
}

std::optional<CheckedSurface> SurfaceWatch::tick() {
  auto outcome = checking_.take();
  if (!outcome || outcome->of != shown_) return std::nullopt;
  return std::move(outcome->checked);
}

}  // namespace birdseye::host
