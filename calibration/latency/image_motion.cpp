#include "calibration/latency/image_motion.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <vector>

#include "calibration/picture/field_mask.hpp"
#include "calibration/picture/picture_mat.hpp"

namespace birdseye::calibration {

namespace {

constexpr int kWorkingWidthPx = 384;  // more tells no more of the motion of the whole, and takes longer
constexpr int kCorners = 120, kFewestFollowed = 12;
constexpr double kLeastShareAgreed = 0.4;
constexpr double kLongestHoleS = 0.2;

}  // namespace

struct ImageMotionTracker::State {
  double time_s = 0, scale = 1;
  std::vector<cv::Mat> pyramid;
  std::vector<cv::Point2f> corners;
  cv::Size size;
  cv::Mat mask;
};

ImageMotionTracker::ImageMotionTracker() = default;
ImageMotionTracker::~ImageMotionTracker() = default;

std::optional<ImageMotion> ImageMotionTracker::push(double time_s, const GreyView& picture) {
  const cv::Size window(21, 21);
  constexpr int kLevels = 3;
  auto next = std::make_unique<State>();
  next->time_s = time_s;
  next->size = {picture.width_px, picture.height_px};
  next->scale = std::max(1.0, static_cast<double>(picture.width_px) / kWorkingWidthPx);
  cv::Mat small;
  cv::resize(mat_of(picture), small, {}, 1 / next->scale, 1 / next->scale, cv::INTER_AREA);
  next->mask = state_ && state_->size == next->size ? state_->mask : field_mask(small.size());
  cv::buildOpticalFlowPyramid(small, next->pyramid, window, kLevels);
  cv::goodFeaturesToTrack(small, next->corners, kCorners, 0.01, 8, next->mask);
  std::swap(state_, next);
  const std::unique_ptr<State>& before = next;

  why_.clear();
  if (!before) why_ = "the first picture";
  if (before && before->size != state_->size) why_ = "its size differs from the one before";
  if (before && !(time_s > before->time_s && time_s - before->time_s < kLongestHoleS))
    why_ = "it does not follow the one before within 0.2 s";
  if (why_.empty() && before->corners.size() < kFewestFollowed) why_ = "too little to be seen";
  if (!why_.empty()) return std::nullopt;

  std::vector<cv::Point2f> moved;
  std::vector<std::uint8_t> found;
  std::vector<float> errors;
  cv::calcOpticalFlowPyrLK(before->pyramid, state_->pyramid, before->corners, moved, found, errors, window, kLevels);
  std::vector<cv::Point2f> from, to;
  const cv::Point2f centre(0.5F * static_cast<float>(small.cols), 0.5F * static_cast<float>(small.rows));
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] == 0) continue;
    from.push_back(before->corners[i] - centre);
    to.push_back(moved[i] - centre);
  }
  why_ = "too little of it can be followed";
  if (from.size() < kFewestFollowed) return std::nullopt;
  std::vector<std::uint8_t> agreed;
  constexpr double kAgreePx = 1.0;
  cv::setRNGSeed(1);  // the same pictures give the same motion
  const cv::Mat similarity = cv::estimateAffinePartial2D(from, to, agreed, cv::RANSAC, kAgreePx);
  const auto votes = static_cast<double>(std::count(agreed.begin(), agreed.end(), 1));
  if (similarity.empty() || votes < kLeastShareAgreed * static_cast<double>(from.size())) return std::nullopt;
  why_.clear();
  const double c = similarity.at<double>(0, 0), s = similarity.at<double>(1, 0);
  const double radius_px = kFieldShare * picture.height_px;
  ImageMotion motion{before->time_s, time_s, {}};
  motion.motion_px = {state_->scale * similarity.at<double>(0, 2), state_->scale * similarity.at<double>(1, 2),
                      radius_px * std::atan2(s, c), radius_px * std::log(std::hypot(c, s))};
  return motion;
}

}  // namespace birdseye::calibration
