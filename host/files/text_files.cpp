#include "host/files/text_files.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <fstream>
#include <opencv2/core.hpp>
#include <sstream>

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

struct NumberRow {
  int line = 0;
  std::vector<double> numbers;
};

/// The lines of numbers in a file; with headed, its first line may be one of names.
Result<std::vector<NumberRow>> read_rows(const fs::path& path, bool headed = false) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file", path.string())};
  std::ifstream in(path);
  if (!in) return Error{Errc::unreadable, fmt::format("{}: cannot be opened; check its permissions", path.string())};
  std::vector<NumberRow> rows;
  std::string text;
  for (int line = 1; std::getline(in, text); ++line) {
    std::replace(text.begin(), text.end(), ',', ' ');
    std::istringstream words(text);
    std::string word;
    NumberRow row;
    row.line = line;
    while (words >> word && word[0] != '#') {
      std::size_t used = 0;
      try {
        row.numbers.push_back(std::stod(word, &used));
      } catch (const std::exception&) {
        used = 0;
      }
      if (used != word.size() && headed && line == 1) {
        row.numbers.clear();
        break;
      }
      if (used != word.size()) {
        return Error{Errc::bad_format, fmt::format("{}: line {}: \"{}\" is not a number", path.string(), line, word)};
      }
    }
    if (!row.numbers.empty()) rows.push_back(std::move(row));
  }
  return rows;
}

/// m, or that what stands at `where` is no pose.
Result<Eigen::Matrix4d> rigid(const Eigen::Matrix4d& m, const std::string& where) {
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  if (m.allFinite() && (r * r.transpose()).isIdentity(1e-3) && r.determinant() > 0 &&
      (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() <= 1e-9) {
    return m;
  }
  return Error{Errc::bad_value,
               where + ": is no rigid transform; give rotation and translation in mm, last row 0 0 0 1"};
}

}  // namespace

Result<std::vector<Eigen::Vector3d>> read_points(const fs::path& path) {
  const auto rows = read_rows(path);
  if (!rows) return rows.error();
  std::vector<Eigen::Vector3d> points;
  for (const NumberRow& row : *rows) {
    if (row.numbers.size() != 3) {
      return Error{Errc::bad_format, fmt::format("{}: line {}: {} numbers where a point has three", path.string(),
                                                 row.line, row.numbers.size())};
    }
    points.emplace_back(row.numbers[0], row.numbers[1], row.numbers[2]);
  }
  if (points.empty()) return Error{Errc::bad_format, fmt::format("{}: holds no points", path.string())};
  return points;
}

Result<Eigen::Matrix4d> read_pose(const fs::path& path) {
  const auto rows = read_rows(path);
  if (!rows) return rows.error();
  if (rows->size() != 4) {
    return Error{Errc::bad_format,
                 fmt::format("{}: {} rows of numbers where a 4x4 matrix has four", path.string(), rows->size())};
  }
  Eigen::Matrix4d m;
  for (int i = 0; i < 4; ++i) {
    const NumberRow& row = (*rows)[static_cast<std::size_t>(i)];
    if (row.numbers.size() != 4) {
      return Error{Errc::bad_format, fmt::format("{}: line {}: {} numbers where a row has four", path.string(),
                                                 row.line, row.numbers.size())};
    }
    for (int j = 0; j < 4; ++j) m(i, j) = row.numbers[static_cast<std::size_t>(j)];
  }
  return rigid(m, path.string());
}

Result<std::vector<Transform<Camera, Patient>>> read_path(const fs::path& path) {
  std::vector<Transform<Camera, Patient>> keys;
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(path, ignored)) {
      if (entry.path().filename().string()[0] != '.') files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) {
      const auto pose = read_pose(file);
      if (!pose) return pose.error();
      keys.push_back(Transform<Camera, Patient>::from_matrix(*pose));
    }
  } else {
    const auto rows = read_rows(path, true);
    if (!rows) return rows.error();
    for (const NumberRow& row : *rows) {
      const std::string where = fmt::format("{}: line {}", path.string(), row.line);
      if (row.numbers.size() != 16 && row.numbers.size() != 18) {
        return Error{Errc::bad_format,
                     fmt::format("{}: {} numbers where a pose has 16, row by row", where, row.numbers.size())};
      }
      using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
      const auto pose = rigid(Eigen::Map<const RowMajor>(&row.numbers[row.numbers.size() - 16]), where);
      if (!pose) return pose.error();
      keys.push_back(Transform<Camera, Patient>::from_matrix(*pose));
    }
  }
  if (keys.size() >= 2) return keys;
  return Error{Errc::bad_format,
               fmt::format("{}: holds {} poses where a camera's way needs two or more", path.string(), keys.size())};
}

std::string pose_text(const Eigen::Matrix4d& m) {
  std::string text;
  for (int i = 0; i < 4; ++i)
    text += fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}\n", m(i, 0), m(i, 1), m(i, 2), m(i, 3));
  return text;
}

Result<CameraModel> read_camera(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file", path.string())};
  CameraModel camera;
  cv::Mat matrix, distortion;
  try {
    const cv::FileStorage file(path.string(), cv::FileStorage::READ);
    if (!file["image_width"].isInt() || !file["image_height"].isInt()) {
      return Error{Errc::bad_format, fmt::format("{}: lacks image_width and image_height; add the size the lens was "
                                                 "calibrated at",
                                                 path.string())};
    }
    camera.width_px = static_cast<int>(file["image_width"]);
    camera.height_px = static_cast<int>(file["image_height"]);
    file["camera_matrix"] >> matrix;
    file["distortion_coefficients"] >> distortion;
    matrix.convertTo(matrix, CV_64F);
    distortion.convertTo(distortion, CV_64F);
  } catch (const cv::Exception&) {
    return Error{Errc::bad_format, fmt::format("{}: is no camera file in OpenCV's YAML", path.string())};
  }
  if (matrix.rows != 3 || matrix.cols != 3) {
    return Error{Errc::bad_format, fmt::format("{}: lacks camera_matrix, 3x3", path.string())};
  }
  if (distortion.total() != 0 && distortion.total() != 4 && distortion.total() != 5) {
    return Error{Errc::unsupported, fmt::format("{}: has {} distortion_coefficients; 4 or 5 are read (k1 k2 p1 p2 k3)",
                                                path.string(), distortion.total())};
  }
  const cv::Mat_<double> k = matrix;
  if (k(0, 1) != 0 || k(1, 0) != 0 || k(2, 0) != 0 || k(2, 1) != 0 || k(2, 2) != 1) {
    return Error{Errc::unsupported,
                 fmt::format("{}: camera_matrix has a skew, or a last row other than 0 0 1", path.string())};
  }
  camera.fx_px = matrix.at<double>(0, 0);
  camera.fy_px = matrix.at<double>(1, 1);
  camera.cx_px = matrix.at<double>(0, 2);
  camera.cy_px = matrix.at<double>(1, 2);
  double* const terms[] = {&camera.k1, &camera.k2, &camera.p1, &camera.p2, &camera.k3};
  for (int i = 0; i < static_cast<int>(distortion.total()); ++i) *terms[i] = distortion.at<double>(i);
  if (auto sound = check(camera); !sound) {
    return sound.error().with_context(path.string());
  }
  return camera;
}

std::string camera_text(const CameraModel& c) {
  return fmt::format(
      "%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ {:.17g}, 0., {:.17g}, 0., {:.17g}, {:.17g}, 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
      "   data: [ {:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g} ]\n",
      c.width_px, c.height_px, c.fx_px, c.cx_px, c.fy_px, c.cy_px, c.k1, c.k2, c.p1, c.p2, c.k3);
}

Result<std::optional<CameraCovariance>> read_camera_covariance(const fs::path& path) {
  cv::Mat matrix;
  try {
    const cv::FileStorage file(path.string(), cv::FileStorage::READ);
    if (file["camera_covariance"].empty()) return std::optional<CameraCovariance>();
    file["camera_covariance"] >> matrix;
    matrix.convertTo(matrix, CV_64F);
  } catch (const cv::Exception&) {
    return Error{Errc::bad_format, fmt::format("{}: camera_covariance cannot be read", path.string())};
  }
  if (matrix.rows != CameraModel::kParameters || matrix.cols != CameraModel::kParameters)
    return Error{Errc::bad_format, fmt::format("{}: camera_covariance is {}x{}, of 9x9; take it out to work without",
                                               path.string(), matrix.rows, matrix.cols)};
  CameraCovariance out;
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

std::string camera_covariance_text(const CameraCovariance& covariance) {
  std::vector<double> numbers(covariance.data(), covariance.data() + covariance.size());
  return fmt::format("camera_covariance: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {:.17g} ]\n",
                     covariance.rows(), covariance.cols(), fmt::join(numbers, ", "));
}

}  // namespace birdseye::host
