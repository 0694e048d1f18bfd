#pragma once

#include <utility>
#include <vector>

#include "calibration/latency/latency.hpp"
#include "calibration/latency/motion_stream.hpp"

namespace birdseye::calibration {

/// From when to when, seconds.
using Stretch = std::pair<double, double>;

/// When a stream tells something: a hole of over half a second parts two stretches, and so one of several intervals
/// between samples, where these are longer.
std::vector<Stretch> stretches_of(const MotionSamples& samples);
std::vector<Stretch> stretches_of(const std::vector<ImageMotion>& samples);

/// When both do.
std::vector<Stretch> common_stretches(const std::vector<Stretch>& a, const std::vector<Stretch>& b);
double seconds_of(const std::vector<Stretch>& stretches);

/// Of what lies between two times: how long a stream is silent at most.
double longest_gap_s(const MotionSamples& samples, double from_s, double to_s);
double longest_gap_s(const std::vector<ImageMotion>& samples, double from_s, double to_s);

/// Leaves out the samples that are further than `margin_s` from all stretches.
void keep_near(const std::vector<Stretch>& stretches, double margin_s, MotionSamples& samples);
void keep_near(const std::vector<Stretch>& stretches, double margin_s, std::vector<ImageMotion>& samples);

}  // namespace birdseye::calibration
