#include "host/operation/decision_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "drivers/system/durable.hpp"
#include "drivers/system/next_line.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/simulated/simulated_truth.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr const char* kFile = "frames.csv";
constexpr const char* kHeader =
    "sequence,age_ms,strength,shape,expected_mm,reason,said,grade,circle_mm,fiducials_mm,hand_eye_mm,lens_mm,pose_mm,"
    "time_mm,motion_mm,pose,pose_sigma_mm,pose_age_ms,camera_from_patient (16 numbers, row by row; none: no overlay)";
constexpr std::size_t kBeforeMatrix = 18;
constexpr std::size_t kLongestLine = 1 << 16;

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> out(1);
  for (const char c : line) {
    if (c == ',') {
      out.emplace_back();
    } else {
      out.back() += c;
    }
  }
  return out;
}

std::string in_a_cell(std::string words) {
  std::ranges::replace(words, ',', ';');
  std::ranges::replace(words, '\n', ' ');
  return words;
}

template <typename Number>
std::optional<Number> read_in(const std::string& cell) {
  Number out = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), out);
  if (error != std::errc() || end != cell.data() + cell.size()) return std::nullopt;
  return out;
}

std::optional<double> number_in(const std::string& cell) {
  return read_in<double>(cell);
}

std::optional<std::uint64_t> count_in(const std::string& cell) {
  return read_in<std::uint64_t>(cell);
}

std::optional<ErrorBudget> budget_of(const std::vector<std::string>& cells) {
  ErrorBudget out;
  const auto circle_mm = number_in(cells[8]);
  const std::array parts{&out.fiducials_mm, &out.hand_eye_mm, &out.lens_mm, &out.pose_mm, &out.time_mm};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto part_mm = number_in(cells[9 + i]);
    if (!part_mm) return std::nullopt;
    *parts[i] = *part_mm;
  }
  if (!circle_mm) return std::nullopt;
  if (cells[14].empty()) return out;
  const auto motion_mm = number_in(cells[14]);
  if (!motion_mm) return std::nullopt;
  const double rigid_mm = out.radius95_mm();  // the circle's, but for the motion
  out.motion = MotionError{*motion_mm, std::sqrt(std::max(0.0, *circle_mm * *circle_mm - rigid_mm * rigid_mm))};
  return out;
}

std::optional<LoggedDecision> decision_of(const std::vector<std::string>& cells) {
  if (cells.size() != kBeforeMatrix && cells.size() != kBeforeMatrix + 16) return std::nullopt;
  LoggedDecision out;
  const auto sequence = count_in(cells[0]), shape = count_in(cells[3]);
  const auto age_ms = number_in(cells[1]), strength = number_in(cells[2]);
  if (!sequence || !age_ms || !strength || !shape) return std::nullopt;
  out.sequence = *sequence;
  out.age_ms = *age_ms;
  out.strength = *strength;
  out.shape = *shape;
  if (!cells[4].empty() && !(out.expected = budget_of(cells))) return std::nullopt;
  out.reason = cells[5];
  out.said = cells[6];
  for (const Grade grade : {Grade::pass, Grade::marginal, Grade::fail})
    if (cells[7] == name_of(grade)) out.grade = grade;
  for (const PoseKind kind : {PoseKind::exact, PoseKind::interpolated, PoseKind::predicted})
    if (cells[15] == to_string(kind)) out.pose = kind;
  out.pose_sigma_mm = number_in(cells[16]).value_or(0);
  out.pose_age_ms = number_in(cells[17]).value_or(0);
  if (cells.size() == kBeforeMatrix) return out;
  Eigen::Matrix4d m;
  for (std::size_t i = 0; i < 16; ++i) {
    const auto number = number_in(cells[kBeforeMatrix + i]);
    if (!number) return std::nullopt;
    m(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) = *number;
  }
  out.camera_from_patient = Transform<Camera, Patient>::from_matrix(m);
  return out;
}

/// The log of the window before, which a window that goes on in its folder may not write over.
Result<void> keep_former(const std::filesystem::path& folder) {
  std::error_code error;
  if (!std::filesystem::exists(folder / kFile, error)) return {};
  std::filesystem::path kept;
  for (int n = 1; kept.empty() || std::filesystem::exists(kept, error); ++n)
    kept = folder / fmt::format("frames-{}.csv", n);
  std::filesystem::rename(folder / kFile, kept, error);
  if (!error) return {};
  return Error{Errc::io, fmt::format("{}: cannot be kept as {} ({}); choose another --out", (folder / kFile).string(),
                                     kept.filename().string(), error.message())};
}

}  // namespace

Result<DecisionLog> DecisionLog::open(const std::filesystem::path& folder) {
  if (auto made = make_folder_durably(folder); !made) return made.error();
  if (auto kept = keep_former(folder); !kept) return kept.error();
  DecisionLog log;
  log.folder_ = folder;
  log.file_.open(folder / kFile, std::ios::trunc);
  if (!log.file_) return Error{Errc::unreadable, folder.string() + ": cannot be written; choose another --out"};
  log.file_ << kHeader << '\n';
  return log;
}

void DecisionLog::add(const LoggedDecision& decision) {
  const auto& expected = decision.expected;
  file_ << fmt::format("{},{:.2f},{:.3f},{},{},{},{},{}", decision.sequence, decision.age_ms, decision.strength,
                       decision.shape, expected ? fmt::format("{:.3f}", expected->rms_mm()) : "",
                       in_a_cell(decision.reason), in_a_cell(decision.said),
                       decision.grade ? name_of(*decision.grade) : "");
  if (expected) {
    file_ << fmt::format(",{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{}", expected->radius95_mm(),
                         expected->fiducials_mm, expected->hand_eye_mm, expected->lens_mm, expected->pose_mm,
                         expected->time_mm, expected->motion ? fmt::format("{:.3f}", expected->motion->rms_mm) : "");
  } else {
    file_ << ",,,,,,,";
  }
  if (decision.pose == PoseKind::refused) {
    file_ << fmt::format(",{},,", to_string(decision.pose));
  } else {
    file_ << fmt::format(",{},{:.3f},{:.2f}", to_string(decision.pose), decision.pose_sigma_mm, decision.pose_age_ms);
  }
  if (decision.camera_from_patient) {
    const Eigen::Matrix4d m = decision.camera_from_patient->matrix();
    for (int i = 0; i < 16; ++i) file_ << fmt::format(",{:.9g}", m(i / 4, i % 4));
  }
  file_ << '\n';
}

Result<void> DecisionLog::close() {
  file_.close();
  if (file_) return {};
  return Error{Errc::io, (folder_ / kFile).string() + ": not all of it could be written; is the disk full?"};
}

Result<std::vector<LoggedDecision>> read_decisions(const std::filesystem::path& path) {
  const std::filesystem::path file = std::filesystem::is_directory(path) ? path / kFile : path;
  if (const auto there = open_file(file); !there && there.error().code != Errc::not_found) return there.error();
  std::ifstream in(file);
  if (!in) return Error{Errc::not_found, file.string() + ": no such file; give the folder that live --out wrote"};
  std::string line;
  const Error unread{Errc::unreadable, fmt::format("{}: {}", file.string(), kNotReadToItsEnd)};
  const bool begun = next_line(in, line, kLongestLine);
  if (in.bad()) return unread;
  if (!begun || line != kHeader)
    return Error{Errc::bad_format,
                 file.string() + ": is no table of a live window's decisions; give the folder that live --out wrote"};
  std::vector<LoggedDecision> out;
  while (next_line(in, line, kLongestLine)) {
    auto decision = decision_of(cells_of(line));
    // A window that was killed leaves its last line cut short.
    if (!decision && in.peek() == std::ifstream::traits_type::eof()) break;
    if (!decision)
      return Error{Errc::bad_format,
                   fmt::format("{}: line {} is no frame's decision; give the file as the window wrote it",
                               file.string(), out.size() + 2)};
    out.push_back(*std::move(decision));
  }
  if (in.bad()) return unread;
  if (in.fail() && !in.eof())
    return Error{Errc::bad_format, fmt::format("{}: line {} is longer than any; give the file as the window wrote it",
                                               file.string(), out.size() + 2)};
  return out;
}

Result<std::map<std::uint64_t, LoggedErrors>> logged_target_errors(
    const std::filesystem::path& log_folder, const std::filesystem::path& truth_folder, const CameraModel& camera,
    const std::function<Eigen::Vector3d(std::uint64_t shape)>& tumour_in_patient_mm) {
  const auto truth = read_simulated_truth(truth_folder);
  if (!truth) return truth.error();
  const auto decisions = read_decisions(log_folder);
  if (!decisions) return decisions.error();
  std::map<std::uint64_t, LoggedErrors> errors;
  for (const LoggedDecision& decision : *decisions) {
    if (!decision.camera_from_patient) continue;
    const auto error = overlay_error(*truth, decision.sequence, camera, *decision.camera_from_patient,
                                     tumour_in_patient_mm(decision.shape));
    if (!error)
      return Error{Errc::bad_format, fmt::format("the truth lacks frame {}, which was overlaid", decision.sequence)};
    errors[decision.shape].mm.push_back(error->target_mm);
    if (decision.expected) errors[decision.shape].expected_mm.push_back(decision.expected->rms_mm());
  }
  return errors;
}

std::string why_not_judged(const std::map<std::uint64_t, LoggedErrors>& errors_by_shape) {
  std::size_t frames = 0;
  for (const auto& [shape, errors] : errors_by_shape) frames += errors.mm.size();
  if (frames == 0) return words("verdict_no_frame");
  return words("verdict_frames_before", frames);
}

}  // namespace birdseye::host
