#pragma once

#include <opencv2/core.hpp>

namespace birdseye::host {

/// A matrix of OpenCV's YAML or XML, as doubles; empty where there is none. Throws cv::Exception, as OpenCV does, where
/// it says that it is of more numbers than are there: OpenCV makes room for what it says before it counts them.
cv::Mat stored_matrix(const cv::FileNode& node);

}  // namespace birdseye::host
