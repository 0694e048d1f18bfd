#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"

namespace birdseye::calibration {

/// How a body stands at a moment of its stream's own clock.
struct TimedRotation {
  double time_s = 0;
  Eigen::Quaterniond base_from_body = Eigen::Quaterniond::Identity();
};

/// The same with the body's place, for motion that is seen in pictures: there a shift looks like a turn.
struct TimedMotionPose {
  double time_s = 0;
  Eigen::Quaterniond base_from_body = Eigen::Quaterniond::Identity();
  Eigen::Vector3d origin_in_base_mm = Eigen::Vector3d::Zero();
};

/// By how much a picture moved since the one before (image_motion.hpp measures it).
struct ImageMotion {
  double from_s = 0, to_s = 0;  ///< the stamps of the two pictures
  /// Right, down, turned, grown: all in pixels, the last two at the radius of the part that was looked at.
  Eigen::Vector4d motion_px = Eigen::Vector4d::Zero();
};

struct LatencySettings {
  double most_offset_s = 1;  ///< offsets are sought from minus this to plus this
  /// So far either way is looked whether a lag beyond explains the streams better, for then the best within is no
  /// answer.
  double farthest_s = 4;
  bool find_drift = true;  ///< false: the two clocks are known to run at one rate
};

/// What a stream holds where the other is near, for judging it. Speeds are taken over 0.3 s, so that noise counts for
/// little.
struct StreamMotion {
  std::size_t samples = 0;       ///< that were used
  double seconds = 0;            ///< from the first to the last
  double recorded_s = 0;         ///< of all samples, from the first to the last
  double rate_hz = 0;            ///< by the median of the intervals
  double longest_gap_s = 0;      ///< from where both have begun to where one ends
  double turn_speed_deg_s = 0;   ///< root mean square; 0 where the stream tells no angles
  double shift_speed_mm_s = 0;   ///< root mean square; 0 where the stream tells no places
  double image_speed_px_s = 0;   ///< root mean square; 0 where the stream is not of pictures
  std::vector<std::string> odd;  ///< what was passed over or put right: "3 rows are not finite"
};

/// For pictures of what was found; all times are seconds since Latency::at_s by the clock of b.
struct LatencyCurves {
  std::vector<double> lag_s, correlation;  ///< the scan
  std::vector<double> a_s, a_speed;        ///< a's own times; speeds as b has them: rad/s, or px/s
  std::vector<double> b_s, b_speed;        ///< of pictures: a's is what the fit makes of the tracker's motion
  std::vector<double> part_s, part_offset_ms, part_sigma_ms;  ///< the offset that each part of the streams asks for
};

/// How late stream b is against stream a: what a's clock calls t happens in b at
/// t + offset_ms + drift_ppm * (t - at_s), with the units put right.
struct Latency {
  bool determined = false;  ///< false: nothing below but motion and correlation is meant; latency_verdict says why
  double offset_ms = 0, drift_ppm = 0;
  std::array<double, 2> offset_ci95_ms{0, 0}, drift_ci95_ppm{0, 0};
  double at_s = 0;  ///< the middle of the streams by b's clock, where offset_ms holds
  Eigen::Matrix3d b_from_a = Eigen::Matrix3d::Identity();  ///< of bodies (hand-eye); of two streams of rotations only
  double residual = 0;                                     ///< root mean square per axis: deg, or px per picture
  double outlier_share = 0;                                ///< of b's samples
  double correlation = 0;                                  ///< of the best lag, 0 to 1
  double lag_s = 0;                                        ///< the best of the scan
  bool at_edge = false;                                    ///< the best lag is the end of the range
  double rival_lag_s = 0;                                  ///< the second best peak; 0 where there is none
  double rival_correlation = 0;
  double rival_sigmas = 0;  ///< by how many standard errors the best lag explains the streams better than the rival
  double sought_s = 0;      ///< LatencySettings::most_offset_s
  double far_lag_s = 0;     ///< the best peak beyond what was sought; its correlation is 0 where there is none
  double far_correlation = 0;
  /// As rival_sigmas, of the far lag; below 0 where that one explains the streams better. Empty where the two were not
  /// compared: the best within is no answer, the far one explains plainly less, or too few samples are covered at both.
  std::optional<double> far_sigmas;
  double overlap_s = 0;  ///< where both streams tell something, without holes
  StreamMotion a, b;
  LatencyCurves curves;
};

/// Two streams of rotations of bodies that are rigidly joined (a bird and a camera), against bases that are both at
/// rest; neither of the two joints need be known. What lies further from the common part than the offset is sought is
/// left out of everything. Errors: streams of less than 20 usable rows, in all or there, times that run backwards, no
/// overlap.
Result<Latency> find_latency(std::span<const TimedRotation> a, std::span<const TimedRotation> b,
                             const LatencySettings& settings = {});

/// A tracker's poses of the scope and the motion of its picture. What turns one into the other (hand-eye, focal length,
/// distance) is taken to be linear and found on the way.
Result<Latency> find_latency(std::span<const TimedMotionPose> a, std::span<const ImageMotion> b,
                             const LatencySettings& settings = {});

/// What a latency is good for. a_name and b_name name the streams in the texts: "tracker", "video".
Verdict latency_verdict(const Latency& latency, const std::string& a_name, const std::string& b_name);

}  // namespace birdseye::calibration
