#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

namespace birdseye::host {

/// A picture in grey; empty where it is none, or cut short: the caller names the file. OpenCV decodes it in a process
/// of its own, confined (docs/decisions/0039-confined-decoders.md).
cv::Mat read_grey_mat(const std::filesystem::path& path);
/// The same in OpenCV's blue, green and red.
cv::Mat read_bgr_mat(const std::filesystem::path& path);

/// Why they give nothing: "the file is empty".
const char* why_no_picture(const std::filesystem::path& path);

}  // namespace birdseye::host
