#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/base/counted.hpp"
#include "calibration/base/units.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"

namespace birdseye::calibration {

namespace {

/// Three stations determine hand-eye; with ten, one that is off shows, and leaving one out tells something.
constexpr std::size_t kEnoughStations = 10;
constexpr std::size_t kFewStations = 5;
/// One sigma of what the calibration adds to where a point at the board is drawn: it is to stay below what a tracker of
/// the miniBIRD's kind adds at every frame (its 1.8 mm, and half a degree over the length of the scope).
constexpr double kNearestMm = 5, kFarthestMm = 5000;  // no scope focuses nearer or farther
constexpr double kFineSigmaMm = 1;
constexpr double kUsableSigmaMm = 2.5;
constexpr double kFineSigmaDeg = 0.25;
constexpr double kUsableSigmaDeg = 0.75;
/// Tracked overlay on a station that was not used: hand-eye and one pose of the tracker together.
constexpr double kFineHeldOutMm = 5;
constexpr double kUsableHeldOutMm = 10;
/// One station in five that does not fit is no accident.
constexpr double kManyOutliers = 0.2;
/// Residuals against the stated noise, as a ratio of sigmas.
constexpr double kNoisier = 1.5;
constexpr double kMuchNoisier = 4;
/// Corners against the board where they fit it best.
constexpr double kFineRmsPx = 1.5;
constexpr double kUsableRmsPx = 4;
/// By how much sensor or board may have moved between two stations.
constexpr double kFineStepMm = 0.5, kUsableStepMm = 2;

std::string joined(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 8;
  std::string out;
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i) out += (i > 0 ? ", " : "") + names[i];
  return names.size() > kMost ? fmt::format("{} and {} more", out, names.size() - kMost) : out;
}

void judge_rejected(const HandEyeResult& r, Verdict& verdict) {
  std::vector<std::string> named;
  for (const HandEyeStationFit& s : r.stations) {
    constexpr std::string_view kRejected = "rejected: ";
    if (s.why_not.starts_with(kRejected)) named.push_back(s.name + " (" + s.why_not.substr(kRejected.size()) + ")");
  }
  if (named.empty()) return;
  verdict.add(2 * named.size() > r.stations.size() ? Grade::marginal : Grade::pass,
              fmt::format("{} of {} stations cannot be used: {}", named.size(), r.stations.size(), joined(named)));
}

void judge_stations(const HandEyeResult& r, Verdict& verdict) {
  const std::size_t used = r.observability.stations - r.outliers.size();
  const std::string count = fmt::format("{} used", counted(used, "station", "stations"));
  if (used >= kEnoughStations) {
    verdict.add(Grade::pass, count);
  } else {
    verdict.add(used >= kFewStations ? Grade::marginal : Grade::fail,
                used >= kFewStations
                    ? fmt::format("{}; {} are needed for a pass", count, kEnoughStations)
                    : fmt::format("{}; at least {} are needed ({} for a pass)", count, kFewStations, kEnoughStations),
                fmt::format("take {} more, each turned another way", kEnoughStations - used));
  }
  if (r.outliers.empty()) return;
  const double part = static_cast<double>(r.outliers.size()) / static_cast<double>(r.observability.stations);
  verdict.add(
      part > 2 * kManyOutliers ? Grade::fail
      : part > kManyOutliers   ? Grade::marginal
                               : Grade::pass,
      fmt::format("{} left out: {}",
                  counted(r.outliers.size(), "station does not fit the others and is",
                          "stations do not fit the others and are"),
                  joined(r.outliers)),
      part > kManyOutliers ? "hold the scope still at each station, away from metal, and take those again" : "");
}

/// Stations that are used and stand out all the same. Of good ones, one in 500 does so by
/// chance (200 simulated calibrations each of 12, 20 and 40 stations; of six stations, one in 120).
constexpr double kTimesMedian = 3, kLeastOddPx = 5;

void name_odd(const HandEyeResult& r, Verdict& verdict) {
  std::vector<std::string> odd;
  for (const HandEyeStationFit& s : r.stations) {
    if (!is_odd(r, s)) continue;
    odd.push_back(fmt::format("{} ({:.0f} px)", s.name, s.held_out_px));
  }
  if (odd.empty()) return;
  verdict.add(Grade::pass,
              fmt::format("odd: off by more than {:.0f} times the usual {:.1f} px, by the hand-eye of the others: {}",
                          kTimesMedian, r.held_out_median_px, joined(odd)),
              "look at those pictures and poses, and take those stations again");
}

void judge_noise(const HandEyeResult& r, Verdict& verdict) {
  if (r.noise_estimated) {
    verdict.add(Grade::pass,
                fmt::format("the tracker's noise, by the residuals: {:.2f} mm and {:.2f} deg per axis",
                            r.tracker_noise.position_sigma_mm, r.tracker_noise.angle_sigma_rad * kDegPerRad));
    return;
  }
  const double ratio = std::sqrt(r.variance_factor);
  if (ratio > kNoisier) {
    verdict.add(ratio > kMuchNoisier ? Grade::fail : Grade::marginal,
                fmt::format("residuals are {:.1f} times what the stated noise of the tracker allows", ratio),
                "hold the scope still at each station and keep metal away, or state the tracker's noise as it is");
  }
}

void judge_step(const HandEyeStep& step, Verdict& verdict) {
  const double shift_mm = step.least_shift_mm(), turn_deg = step.least_turn_deg();
  if (shift_mm <= kFineStepMm && turn_deg <= kFineSigmaDeg) return;
  const bool far = shift_mm > kUsableStepMm || turn_deg > kUsableSigmaDeg;
  verdict.add(
      far ? Grade::fail : Grade::marginal,
      fmt::format("the sensor slid on the scope, or the board moved, between {} and {}, or the tracker's field "
                  "differs there: by {:.1f} mm at the board (at least {:.1f}) and {:.1f} deg (at least {:.1f}), "
                  "{:.1f} sigmas where chance allows {:.1f}",
                  step.before, step.after, step.shift_mm, shift_mm, step.turn_deg, turn_deg, step.sigmas,
                  step.limit_sigmas),
      "fix the sensor to the scope, and the board to its place, and calibrate again; if both were firm, keep "
      "metal away or map the field (birdseye calibrate field), and take the stations by turns here and there, "
      "not all of one side first");
}

/// Several findings may give the same advice.
void keep_once(std::vector<std::string>& steps) {
  std::vector<std::string> out;
  for (std::string& step : steps) {
    if (std::find(out.begin(), out.end(), step) == out.end()) out.push_back(std::move(step));
  }
  steps = std::move(out);
}

}  // namespace

bool is_odd(const HandEyeResult& r, const HandEyeStationFit& s) {
  return s.used && r.held_out_median_px > 0 &&
         s.held_out_px >= std::max(kLeastOddPx, kTimesMedian * r.held_out_median_px);
}

Verdict judge(const HandEyeResult& r) {
  Verdict verdict;
  for (const Finding& f : r.observability.findings) verdict.add(f.grade, f.reason, f.next_step);
  judge_rejected(r, verdict);
  if (!r.solved) {
    if (verdict.grade != Grade::fail) verdict.add(Grade::fail, "hand-eye is not determined", "take more stations");
    return verdict;
  }
  if (!(r.working_distance_mm >= kNearestMm && r.working_distance_mm <= kFarthestMm)) {
    verdict.add(Grade::fail,
                fmt::format("the board is {:.3g} mm from the camera: lengths in metres, taken for millimetres?",
                            r.working_distance_mm),
                "give --unit m for poses in metres, and the board's squares in mm");
  }
  judge_stations(r, verdict);
  if (r.held_out_median_px > 0) name_odd(r, verdict);
  judge_noise(r, verdict);
  if (r.step) judge_step(*r.step, verdict);
  const std::string more = "take more stations, and turn the scope more between them";
  verdict.judge("hand-eye's part of the error at the board (one sigma)", r.sigma_at_board_mm(), "mm", kFineSigmaMm,
                kUsableSigmaMm, more);
  verdict.judge("sigma of the rotation", r.rotation_sigma_deg().maxCoeff(), "deg", kFineSigmaDeg, kUsableSigmaDeg,
                more);
  verdict.judge("held-out error", r.held_out_mm, "mm", kFineHeldOutMm, kUsableHeldOutMm,
                "hold the scope still at each station, and keep metal away from the tracker");
  if (r.rms_px > 0) {
    verdict.judge("error of the corners", r.rms_px, "px", kFineRmsPx, kUsableRmsPx,
                  "calibrate the lens anew, and see that the board is flat and the right one");
  }
  keep_once(verdict.next_steps);
  return verdict;
}

}  // namespace birdseye::calibration
