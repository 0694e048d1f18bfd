#include "host/window/live_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "host/simulated/simulated_truth.hpp"

namespace birdseye::host {

Result<LiveLog> LiveLog::open(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  LiveLog log;
  log.folder_ = folder;
  log.file_.open(folder / "frames.csv", std::ios::trunc);
  if (error || !log.file_)
    return Error{Errc::unreadable, folder.string() + ": cannot be written; choose another --out"};
  log.file_
      << "sequence,age_ms,strength,shape,expected_mm,camera_from_patient (16 numbers, row by row; none: no overlay)\n";
  return log;
}

void LiveLog::add(std::uint64_t sequence, double age_ms, double strength, std::uint64_t shape, double expected_mm,
                  const std::optional<Transform<Camera, Patient>>& camera_from_patient) {
  file_ << fmt::format("{},{:.2f},{:.3f},{},{:.3f}", sequence, age_ms, strength, shape, expected_mm);
  if (camera_from_patient) {
    const Eigen::Matrix4d m = camera_from_patient->matrix();
    for (int i = 0; i < 16; ++i) file_ << fmt::format(",{:.9g}", m(i / 4, i % 4));
  }
  file_ << '\n';
}

Result<void> LiveLog::close() {
  file_.close();
  if (file_) return {};
  return Error{Errc::io, (folder_ / "frames.csv").string() + ": not all of it could be written; is the disk full?"};
}

Result<std::map<std::uint64_t, LoggedErrors>> logged_target_errors(
    const std::filesystem::path& log_folder, const std::filesystem::path& truth_folder, const CameraModel& camera,
    const std::function<Eigen::Vector3d(std::uint64_t shape)>& tumour_in_patient_mm) {
  const auto truth = read_simulated_truth(truth_folder);
  if (!truth) return truth.error();
  std::ifstream in(log_folder / "frames.csv");
  std::string line;
  std::getline(in, line);
  std::map<std::uint64_t, LoggedErrors> errors;
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream numbers(line);
    std::uint64_t sequence = 0, shape = 0;
    double age_ms = 0, strength = 0, expected_mm = 0;
    Eigen::Matrix4d m;
    numbers >> sequence >> age_ms >> strength >> shape >> expected_mm;
    for (int i = 0; i < 16; ++i) numbers >> m(i / 4, i % 4);
    if (!numbers) continue;  // without an overlay
    const auto error = overlay_error(*truth, sequence, camera, Transform<Camera, Patient>::from_matrix(m),
                                     tumour_in_patient_mm(shape));
    if (!error) return Error{Errc::bad_format, fmt::format("the truth lacks frame {}, which was overlaid", sequence)};
    errors[shape].mm.push_back(error->target_mm);
    if (expected_mm > 0) errors[shape].expected_mm.push_back(expected_mm);
  }
  return errors;
}

}  // namespace birdseye::host
