#include "host/files/text_files.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <sstream>

#include "calibration/geometry/rigid_matrix.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

struct NumberRow {
  int line = 0;
  std::vector<double> numbers;
};

/// The lines of numbers in a text; with headed, its first line may be one of names.
Result<std::vector<NumberRow>> rows_of(const std::string& all, const fs::path& path, bool headed = false) {
  std::istringstream in(all);
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

}  // namespace

Result<Eigen::Matrix4d> check_rigid(const Eigen::Matrix4d& m, const std::string& where) {
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  const bool last_row = (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() <= 1e-9;
  if (last_row && is_rigid(m, 1e-3)) return m;
  if (const double most_mm = m.topRightCorner<3, 1>().cwiseAbs().maxCoeff(); last_row && most_mm > kFarthestMm) {
    return Error{Errc::bad_value,
                 fmt::format("{}: is {:.6g} mm away, further than {:.0f} m: give the translation in mm", where, most_mm,
                             kFarthestMm / 1000)};
  }
  if (m.allFinite() && (r * r.transpose()).isIdentity(1e-3) && r.determinant() < 0) {
    return Error{Errc::bad_value, where +
                                      ": is a mirror (determinant -1), as of a left-handed frame or with two axes "
                                      "exchanged: have the program that writes it write a right-handed frame"};
  }
  if (m.allFinite() && (r * r.transpose()).isIdentity(1e-3) && m.topRightCorner<3, 1>().isZero(0) && m(3, 3) == 1) {
    return Error{Errc::bad_value, where +
                                      ": is written column by column, as OpenGL and MATLAB do: write it row by row, "
                                      "last row 0 0 0 1"};
  }
  return Error{Errc::bad_value,
               where + ": is no rigid transform; give rotation and translation in mm, last row 0 0 0 1"};
}

Result<Eigen::Matrix4d> read_pose(const fs::path& path) {
  const auto text = read_whole_file(path, kMostTextBytes);
  if (!text) return text.error();
  return parse_pose(*text, path);
}

Result<Eigen::Matrix4d> parse_pose(const std::string& text, const fs::path& path) {
  const auto rows = rows_of(text, path);
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
  return check_rigid(m, path.string());
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
    const auto text = read_whole_file(path, kMostTextBytes);
    if (!text) return text.error();
    const auto rows = rows_of(*text, path, true);
    if (!rows) return rows.error();
    for (const NumberRow& row : *rows) {
      const std::string where = fmt::format("{}: line {}", path.string(), row.line);
      if (row.numbers.size() != 16 && row.numbers.size() != 18) {
        return Error{Errc::bad_format,
                     fmt::format("{}: {} numbers where a pose has 16, row by row", where, row.numbers.size())};
      }
      using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
      const auto pose = check_rigid(Eigen::Map<const RowMajor>(&row.numbers[row.numbers.size() - 16]), where);
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

}  // namespace birdseye::host
