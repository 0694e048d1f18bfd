#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// A picture in grey, which OpenCV decodes in a process of its own, confined
/// (docs/decisions/0039-confined-decoders.md). Errors, without the file's name: bad_format: it is no picture, or cut
/// short; others: how its decoder ended.
Result<cv::Mat> read_grey_mat(const std::filesystem::path& path);
/// The same in OpenCV's blue, green and red.
Result<cv::Mat> read_bgr_mat(const std::filesystem::path& path);

}  // namespace birdseye::host
