#pragma once

#include <algorithm>
#include <utility>

#include "host/overlay/field_watch.hpp"
#include "host/overlay/scope_setup.hpp"
#include "host/overlay/sudden_motion.hpp"
#include "host/overlay/trust.hpp"
#include "host/overlay/video_motion.hpp"

namespace birdseye::host {

/// What the video itself says about the setup that the overlay is drawn by: whether it moves as the scope's poses, and
/// whether its round field is as large as when the lens was calibrated.
class VideoWatch {
 public:
  /// A pose of the scope's sensor, as they come.
  void take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
    single_poses_ = true;
    motion_.take(acquired, tracker_from_sensor);
    sudden_.take(acquired, tracker_from_sensor);
  }
  struct News {
    bool motion = false, field = false;  ///< that it says something else now
    bool contradicted = false;           ///< VideoMotion::contradicted(), where it had not differed before
    bool again = false;                  ///< where it had
    [[nodiscard]] bool any() const { return motion || field; }
  };
  /// A frame, as they come, and the scope that took it. Where no single poses come, as in a sequence of PLUS, the poses
  /// of the frames take their place. target_in_camera_mm: where the target is drawn; empty: it is not.
  News take(const wire::VideoFrame& frame, const ScopeSetup& scope,
            const std::optional<Eigen::Vector3d>& target_in_camera_mm) {
    if (const auto& pose = frame.info.pose.tracker_from_sensor; !single_poses_ && pose) {
      motion_.take(frame.info.acquired, *pose);
      sudden_.take(frame.info.acquired, *pose);
    }
    const VideoAgreement before = motion_.state();
    // Of another size it is not looked at, and may be as flat as a line.
    const bool fits = frame.width_px == scope.camera().width_px && frame.height_px == scope.camera().height_px;
    const PictureToFollow picture = fits ? picture_to_follow(frame) : PictureToFollow{};
    const auto target_mm = target_in_camera_mm ? std::optional(target_in_camera_mm->norm()) : std::nullopt;
    motion_.take(frame, picture, scope, farthest_mm(target_in_camera_mm));
    if (sudden_.take(frame, picture, scope, target_mm)) motion_.doubt(frame.info.acquired);
    const bool differed = before == VideoAgreement::differs;
    // Poses may have changed it too, since the last frame.
    const bool news = std::exchange(told_, motion_.state()) != motion_.state();
    return {news, field_.take(frame, scope), motion_.contradicted() && !differed, motion_.contradicted() && differed};
  }

  /// A frame that is not to be looked at: what agreed is in doubt until a later one agrees.
  void look_away(DeviceTime acquired) { motion_.doubt(acquired); }

  /// The poses are in another frame from now on: from one to the next they would leap.
  void forget_motion() {
    motion_ = VideoMotion();
    sudden_ = SuddenMotion();
  }

  [[nodiscard]] VideoAgreement motion() const { return motion_.state(); }
  [[nodiscard]] calibration::FieldSize field() const { return field_.state(); }
  void enter(TrustFigures& figures) const {
    figures.video = motion();
    figures.field = field();
  }

 private:
  /// Half of what is seen lies no farther. A scope that has the target ahead is in the patient, or before him.
  static double farthest_mm(const std::optional<Eigen::Vector3d>& target_in_camera_mm) {
    constexpr double kAhead = 0.7;      // the cosine of the angle to the line of sight
    constexpr double kCavity_mm = 150;  // also where the target is near, the wall behind it need not be
    if (!target_in_camera_mm || target_in_camera_mm->z() < kAhead * target_in_camera_mm->norm())
      return kFarthestSeen_mm;
    return std::clamp(2 * target_in_camera_mm->norm(), kCavity_mm, kFarthestSeen_mm);
  }

  bool single_poses_ = false;
  VideoAgreement told_ = VideoAgreement::untold;  ///< by the last frame
  VideoMotion motion_;
  SuddenMotion sudden_;
  FieldWatch field_;
};

}  // namespace birdseye::host
