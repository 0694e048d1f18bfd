#include "host/files/stored_matrix.hpp"

#include <cstdint>

namespace birdseye::host {

cv::Mat stored_matrix(const cv::FileNode& node) {
  if (node.empty()) return {};
  if (!node.isMap() || !node["rows"].isInt() || !node["cols"].isInt()) throw cv::Exception();
  const std::int64_t rows = static_cast<int>(node["rows"]);
  const std::int64_t cols = static_cast<int>(node["cols"]);
  if (rows < 0 || cols < 0 || rows * cols > static_cast<std::int64_t>(node["data"].size())) throw cv::Exception();
  cv::Mat matrix;
  node >> matrix;
  matrix.convertTo(matrix, CV_64F);
  return matrix;
}

}  // namespace birdseye::host
