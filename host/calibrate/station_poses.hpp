#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// Reads poses and finds each station's, in the stations' order; none where there is no pose that could be used. They
/// pair by the pictures' names where the table has a column of these; else by their order, where there are as many of
/// one as of the other; else by time, where the pictures' names are times and the poses have some. whose: "the sensor";
/// of_what: "pictures", both for messages. What is odd goes into notes.
Result<std::vector<std::optional<TimedPose>>> poses_of_stations(const std::filesystem::path& path,
                                                                const PoseReading& how,
                                                                std::span<const calibration::HandEyeStation> stations,
                                                                const std::string& whose, const std::string& of_what,
                                                                std::vector<std::string>& notes);

}  // namespace birdseye::host
