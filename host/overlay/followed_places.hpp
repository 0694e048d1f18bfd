#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "device/wire/messages.hpp"

/// Places of the tissue that are followed from one picture to the next, and where the poses say that they lie.
namespace birdseye::host {

inline constexpr int kPlaces = 80;          ///< are followed at most
inline constexpr double kFollowedPx = 1.5;  ///< of the small picture: how far a place that is followed may be off
/// From the camera: what a laparoscope sees lies between.
inline constexpr double kNearestSeen_mm = 15, kFarthestSeen_mm = 600;

/// A frame in grey and small: more tells no more of the motion, and takes longer.
struct PictureToFollow {
  cv::Mat grey;
  /// Of grey, with gradients; OpenCV would make it anew for each use. Empty where grey is the same all over, as without
  /// a signal: nothing is followed from there, nor to there.
  std::vector<cv::Mat> pyramid;
};
PictureToFollow picture_to_follow(const wire::VideoFrame& frame);

/// Places of such a picture that can be followed: within the round field, and away from reflections, which go with the
/// lamp.
std::vector<cv::Point2f> places_to_follow(const cv::Mat& grey, int at_most = kPlaces);
/// Of such places those that look as no other within reach of the search, as a board's squares do.
std::vector<cv::Point2f> distinct_places_to_follow(const cv::Mat& grey);

/// Where places of one picture lie in another. Empty: it is not found there, or leads back to another place. about:
/// where they are known to lie to within a few pixels, one each; without it, they are looked for some twenty pixels
/// about.
std::vector<std::optional<cv::Point2f>> follow_places(const PictureToFollow& from, const PictureToFollow& to,
                                                      const std::vector<cv::Point2f>& places,
                                                      const std::vector<cv::Point2f>* about = nullptr);

/// A place of the small picture of so many columns as a direction of unit Z; empty: no ray of the camera ends there.
std::optional<Eigen::Vector3d> ray_of(const CameraModel& camera, int small_columns, const cv::Point2f& place);

/// A place in two pictures, as directions of unit Z.
struct FollowedPlace {
  Eigen::Vector3d then, now;
};

/// Where a place may lie in the later picture, at whatever depth, the poses tell: on a line (the epipolar line), of
/// which the part from 15 mm to farthest_mm counts. How far each place is off it, of unit focal length, but for those
/// that would be behind the camera.
std::vector<double> off_line(const std::vector<FollowedPlace>& places, const Transform<Camera, Camera>& now_from_then,
                             double farthest_mm = kFarthestSeen_mm);
/// The median of these; empty where most places would be behind the camera.
std::optional<double> median_off_line(const std::vector<FollowedPlace>& places,
                                      const Transform<Camera, Camera>& now_from_then,
                                      double farthest_mm = kFarthestSeen_mm);

/// How far they would be off, the least of both ways, were hand-eye turned about an axis of the camera.
std::optional<double> median_off_if_turned(const std::vector<FollowedPlace>& places,
                                           const Transform<Camera, Camera>& now_from_then, Eigen::Index axis,
                                           double by_rad);

/// Whether the places go as one rigid scene before a camera that moves, whichever way it moves: there is an essential
/// matrix by which more of them lie within so much (Sampson's distance, of unit focal length) than do by chance where
/// many were followed wrongly.
bool go_as_one(const std::vector<FollowedPlace>& places, double within);

}  // namespace birdseye::host
