#pragma once

#include <string>

#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// A file of poses, and in which unit its times were read.
struct TimedFile {
  std::string name;    ///< for messages
  std::string option;  ///< that says the unit: "--time-unit"
  const PoseSet& set;
  double s_per_unit = 1;
};

/// Of two recordings of one motion that do not fit together in time: which of them is in another unit of time than it
/// was read in, for they would last equally long and overlap, with the option that says so. Empty where neither is.
std::string hint_on_time_units(const TimedFile& a, const TimedFile& b);

}  // namespace birdseye::host
