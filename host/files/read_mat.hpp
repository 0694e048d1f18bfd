#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>

namespace birdseye::host {

/// A picture as OpenCV reads it; empty where it is none, or cut short. OpenCV says nothing on standard error: the
/// caller names the file.
cv::Mat read_mat(const std::filesystem::path& path, cv::ImreadModes mode);

/// Why read_mat gives nothing: "the file is empty".
const char* why_no_picture(const std::filesystem::path& path);

}  // namespace birdseye::host
