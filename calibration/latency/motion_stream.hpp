#pragma once

#include <span>
#include <string>
#include <vector>

#include "calibration/latency/latency.hpp"
#include "calibration/latency/latency_scan.hpp"
#include "calibration/latency/motion_spline.hpp"

/// What find_latency makes of its streams before anything is compared.
namespace birdseye::calibration {

using MotionSamples = std::vector<MotionSpline::Sample>;

/// Rows that are finite, in the order of their times, each time once; what was put right goes into motion.odd. Errors:
/// less than 20 such rows, times that jump back or are out of order in more than one row of a hundred. name: "a".
Result<MotionSamples> clean(std::span<const TimedMotionPose> rows, const std::string& name, StreamMotion& motion);
Result<std::vector<ImageMotion>> clean(std::span<const ImageMotion> rows, const std::string& name,
                                       StreamMotion& motion);

/// Fills in of motion what is of these samples by themselves: how many, how often, how fast.
void measure(const MotionSamples& samples, StreamMotion& motion);
void measure(const std::vector<ImageMotion>& samples, StreamMotion& motion);

/// Rates at the samples' own times, rad/s in the body's axes, by lines through the samples within half_window_s.
/// Samples without neighbours on both sides are left out.
RateSignal turn_rates(const MotionSamples& samples, double half_window_s);
/// At half time of each pair of pictures, px/s.
RateSignal image_rates(const std::vector<ImageMotion>& samples);
/// On a grid: turns only (3 columns, rad/s), or turns and shifts (6, mm/s), in the body's axes.
RateGrid rate_grid(const MotionSpline& spline, double begin_s, double end_s, bool with_shifts);

}  // namespace birdseye::calibration
