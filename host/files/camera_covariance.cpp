#include "host/files/camera_covariance.hpp"

#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <vector>

#include "host/files/stored_matrix.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

Result<std::optional<CameraMatrix>> read_camera_covariance(const fs::path& path) {
  // One camera of several, as "kalibr.yaml:cam0" names it, has none; OpenCV would print what it finds amiss.
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return std::optional<CameraMatrix>();
  cv::Mat matrix;
  try {
    const cv::FileStorage file(path.string(), cv::FileStorage::READ);
    if (file["camera_covariance"].empty()) return std::optional<CameraMatrix>();
    matrix = stored_matrix(file["camera_covariance"]);
  } catch (const cv::Exception&) {
    return std::optional<CameraMatrix>();  // ROS's or Kalibr's
  }
  if (matrix.rows != CameraModel::kParameters || matrix.cols != CameraModel::kParameters)
    return Error{Errc::bad_format, fmt::format("{}: camera_covariance is {}x{}, of 9x9; take it out to work without",
                                               path.string(), matrix.rows, matrix.cols)};
  CameraMatrix out;
  for (int i = 0; i < out.rows(); ++i) {
    for (int j = 0; j < out.cols(); ++j) out(i, j) = matrix.at<double>(i, j);
  }
  const bool sound = out.allFinite() && out.diagonal().minCoeff() >= 0 &&
                     (out - out.transpose()).cwiseAbs().maxCoeff() <= 1e-6 * out.diagonal().maxCoeff();
  if (!sound)
    return Error{Errc::bad_value,
                 fmt::format("{}: camera_covariance is no covariance; take it out to work without", path.string())};
  return std::optional(out);
}

std::string camera_covariance_text(const CameraMatrix& covariance) {
  std::vector<double> numbers(covariance.data(), covariance.data() + covariance.size());
  return fmt::format("camera_covariance: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {:.17g} ]\n",
                     covariance.rows(), covariance.cols(), fmt::join(numbers, ", "));
}

}  // namespace birdseye::host
