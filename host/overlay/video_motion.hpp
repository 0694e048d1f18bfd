#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "calibration/time/pose_history.hpp"
#include "device/wire/messages.hpp"
#include "host/overlay/followed_places.hpp"
#include "host/overlay/scope_setup.hpp"
#include "host/overlay/target_jitter.hpp"
#include "host/overlay/trust.hpp"

namespace birdseye::host {

/// Whether the video moves as the scope's poses, by its calibration, say that it must. Places of the tissue are
/// followed from a picture to later ones; where a place may lie in the later picture, at whatever depth, the poses
/// tell: on a line (the epipolar line). Needs no registration; how far what is seen may lie it can tell.
///
/// A picture that agrees tells only of what would have been seen otherwise: agreement is said once, about each axis, a
/// hand-eye that is turned by 15 degrees would have had the places off their lines. After a picture that did not agree,
/// twice as much is asked for.
class VideoMotion {
 public:
  VideoMotion();
  ~VideoMotion();
  VideoMotion(VideoMotion&&) noexcept;
  VideoMotion& operator=(VideoMotion&&) noexcept;

  /// A pose of the scope's sensor, as they come.
  void take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor);
  /// A frame, as they come, that frame small and grey, and the scope that took it; of another than before all is
  /// forgotten. In each the places are followed; ten a second are looked at, each once the poses after it have come.
  /// farthest_mm: half of what the frame shows lies no farther from the camera. True: state() is another now.
  bool take(const wire::VideoFrame& frame, const PictureToFollow& picture, const ScopeSetup& scope, double farthest_mm);

  /// Something else speaks against a frame of that time: what agreed is in doubt until a picture that was taken then or
  /// later agrees. True: state() is another now.
  bool doubt(DeviceTime since);

  [[nodiscard]] VideoAgreement state() const { return state_; }
  /// Whether by the last frame taken something has moved other than the poses say; where state() does not say so, it
  /// may be that places were followed wrongly. Where state() has said so before, something may have moved again.
  [[nodiscard]] bool contradicted() const { return contradicted_; }
  /// Of the last picture that could tell, the median of how far the places lie off their lines; empty before one could.
  [[nodiscard]] const std::optional<double>& off_px() const { return off_px_; }

 private:
  void reset();
  void forget_agreement();
  struct Key;
  struct Waiting;
  /// Where a picture was seen from.
  struct SeenFrom {
    DeviceTime at;
    Transform<Camera, Tracker> camera_from_tracker;
    double unsure_px = 0;  ///< how far the camera's motion may have places off
  };

  [[nodiscard]] std::optional<SeenFrom> seen_from(const Waiting& waiting, const ScopeSetup& scope) const;
  void wait(const wire::VideoFrame& frame, const PictureToFollow& picture, double farthest_mm);
  void look(const Waiting& waiting, const ScopeSetup& scope);
  void note_noise(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor);
  [[nodiscard]] double noise_of_average_px(const CameraModel& camera) const;
  static double fastest_px_s(const SeenFrom& then, const SeenFrom& now, const CameraModel& camera);
  void begin_key(const Waiting& waiting, const PictureToFollow& picture, const std::optional<SeenFrom>& from);
  void follow(DeviceTime at, const PictureToFollow& picture);
  std::size_t keep(const std::vector<std::optional<cv::Point2f>>& found);
  enum class Judged { not_odd, odd, of_what_is_left };
  Judged judge(const Waiting& waiting, const SeenFrom& now, const ScopeSetup& scope);

  std::optional<ScopeSetup> of_;  ///< that the last frame was taken with
  PoseHistory poses_;
  std::optional<Eigen::Vector3d> watched_mm_;  ///< a place in the tracker's frame, whose jitter_ is
  TargetJitter jitter_;
  double between_poses_s_ = 0;  ///< on the average of the last few; 0: there were none
  std::optional<DeviceTime> looked_at_, doubted_since_;
  std::unique_ptr<Waiting> waiting_;  ///< the newest picture that is looked at, until the poses after it have come
  std::unique_ptr<Key> key_;          ///< the picture in which the places that are followed were chosen
  std::array<int, 3> told_{};         ///< how often it agreed, by axis of the camera
  int wanted_ = 1;  ///< so often about each; of this scope twice as often each time that it has differed
  int odd_ = 0;     ///< pictures in a row that do not agree
  bool contradicted_ = false;
  VideoAgreement state_ = VideoAgreement::untold;
  std::optional<double> off_px_;
};

}  // namespace birdseye::host
