#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/camera/camera_calibration.hpp"

namespace birdseye::calibration {

namespace {

namespace limits = camera_limits;

/// A figure of which more is better. Written so that a figure that is no number fails.
void judge_least(Verdict& verdict, const std::string& figure, double value, const std::string& unit, double pass_from,
                 double marginal_from, const std::string& next_step) {
  const std::string said = fmt::format("{} {:.3g}{}", figure, value, unit);
  if (value >= pass_from) {
    verdict.add(Grade::pass, fmt::format("{}, of at least {:g}{}", said, pass_from, unit));
  } else {
    const bool marginal = value >= marginal_from;
    verdict.add(marginal ? Grade::marginal : Grade::fail,
                fmt::format("{}, less than {:g}{}", said, marginal ? pass_from : marginal_from, unit), next_step);
  }
}

void judge_fit(const CameraCalibration& c, Verdict& verdict) {
  const double scale = c.camera.width_px / limits::kWidth_px;
  verdict.judge("held-out error", c.held_out_px, "px", scale * limits::kHeldOutPass_px,
                scale * limits::kHeldOutMarginal_px,
                "see in the report which views and regions are off: blur, a board that is not flat, a lens of more "
                "terms");
  if (c.refuted_by) {
    const auto held_out = [&](LensModel model) {
      return std::ranges::find(c.models, model, &LensModelFit::model)->held_out_px;
    };
    verdict.add(Grade::marginal,
                fmt::format("the views refute the lens model {}: held out, it is off by {:.4g} px, and {} by {:.4g} px",
                            name_of(c.model), held_out(c.model), name_of(*c.refuted_by), held_out(*c.refuted_by)),
                "leave --model out, so that the views decide");
  }
  const double share = c.points.empty() ? 0 : static_cast<double>(c.outliers) / static_cast<double>(c.points.size());
  if (c.outliers > 0) {
    const bool pass = share <= limits::kOutliersPass;
    verdict.add(
        pass                                 ? Grade::pass
        : share <= limits::kOutliersMarginal ? Grade::marginal
                                             : Grade::fail,
        fmt::format("{} of {} points left out as outliers ({:.1f} %)", c.outliers, c.points.size(), 100 * share),
        pass ? "" : "find out why in the report: glare, an occluded board, a blurred view");
  }
  if (c.folds) {
    verdict.add(Grade::fail,
                fmt::format("the lens model {} folds inside the picture: some pixels have no ray", name_of(c.model)),
                "bring the board into the picture's corners, or ask for a simpler --model");
  }
}

void judge_focus(const FocalHalves& halves, Verdict& verdict) {
  const double apart_px = std::abs(halves.second_px - halves.first_px);
  const double apart = 2 * apart_px / (halves.first_px + halves.second_px);
  // Written so that figures that are no numbers pass: the focal length itself is judged elsewhere.
  if (!(apart_px > limits::kFocusSigmas * halves.sigma_px && apart > limits::kFocalSigmaPass)) return;
  // The lens found lies between the two, off by half of that from either.
  verdict.add(apart / 2 > limits::kFocalSigmaMarginal ? Grade::fail : Grade::marginal,
              fmt::format("the lens was refocused or zoomed between views, or the lens model or a board that sags does "
                          "not hold for both halves: the focal length is {:.1f} px by the first half of the views and "
                          "{:.1f} px by the second, {:.1f} sigmas apart, of at most {:g}",
                          halves.first_px, halves.second_px, apart_px / halves.sigma_px, limits::kFocusSigmas),
              "take all views again, do not touch focus and zoom from the first view to the last, fix the board on "
              "something stiff, and mix tilts and places in the picture all along");
}

void judge_lens(const CameraCalibration& c, Verdict& verdict) {
  const CameraVector sigma = c.sigma();
  if (c.board_sag_mm > 0) {
    verdict.add(Grade::pass,
                fmt::format("the board seems to be bent: its middle stands {:.2g} mm off its edge", c.board_sag_mm),
                "fix the board on something flat and stiff");
  }
  if (!c.undetermined.empty()) {
    verdict.add(Grade::fail, fmt::format("the views leave {} open: another lens fits them as well", c.undetermined),
                "tilt the board to all sides, by 20 to 45 degrees");
  }
  const double focal = 100 * std::max(sigma[0] / c.camera.fx_px, sigma[1] / c.camera.fy_px);
  verdict.judge("focal length known to", focal, "%", 100 * limits::kFocalSigmaPass, 100 * limits::kFocalSigmaMarginal,
                "take more views with the board tilted by 20 to 45 degrees: facing it, focal length and distance "
                "look alike");
  if (c.focal_halves) judge_focus(*c.focal_halves, verdict);
  const double centre = 100 * std::max(sigma[2], sigma[3]) / c.camera.width_px;
  verdict.judge("picture centre known to", centre, "% of the width", 100 * limits::kCentreSigmaPass,
                100 * limits::kCentreSigmaMarginal,
                "turn the camera by quarter turns between views, with the board tilted");
  const double aspect = c.camera.fx_px / c.camera.fy_px, expected = 1 / c.pixel_aspect;
  // A pixel that is narrow has the larger focal length in pixels: alike for 1.2 and 1 / 1.2.
  const double stretch = std::max(aspect / expected, expected / aspect) - 1;
  if (!(stretch <= limits::kAspectPass)) {
    verdict.add(stretch <= limits::kAspectMarginal ? Grade::marginal : Grade::fail,
                fmt::format("wrong aspect: fx is {:.2f} of fy, where {} pixels have {:.3g}", aspect,
                            expected == 1 ? "square" : "these", expected),
                "check that the board's pitch is the same both ways; where the grabber stretches or squeezes the "
                "picture, give --pixel-aspect");
  }
}

void tell_rejected(std::span<const RejectedView> rejected, Verdict& verdict) {
  for (const RejectedView& view : rejected) verdict.add(Grade::pass, view.name + " rejected: " + view.reason);
}

void judge_views(const CameraCalibration& c, Verdict& verdict) {
  judge_least(verdict, "views used:", static_cast<double>(c.views.size()), "", static_cast<double>(limits::kViewsPass),
              static_cast<double>(limits::kViewsMarginal), fmt::format("take at least {} views", limits::kViewsPass));
  tell_rejected(c.rejected, verdict);
  if (c.rejected.size() > c.views.size()) {
    verdict.add(Grade::marginal,
                fmt::format("{} of {} views rejected", c.rejected.size(), c.rejected.size() + c.views.size()),
                "look why the views are rejected before you take more");
  }
  judge_least(verdict, "coverage of the picture", 100 * c.coverage, " %", 100 * limits::kCoveragePass,
              100 * limits::kCoverageMarginal, "bring the board to the picture's borders and corners");
  const bool parallel = c.tilt_spread_deg < limits::kTiltSpreadMarginal_deg;
  judge_least(verdict, parallel ? "all boards lie parallel: their tilts differ by" : "tilts differ by up to",
              c.tilt_spread_deg, " degrees", limits::kTiltSpreadPass_deg, limits::kTiltSpreadMarginal_deg,
              "tilt the board to all sides, by 20 to 45 degrees");
  if (!(c.mean_distance_mm >= limits::kNearest_mm && c.mean_distance_mm <= limits::kFarthest_mm)) {
    verdict.add(
        Grade::fail,
        fmt::format("the board would be {:.3g} mm away on average: is its size in other units?", c.mean_distance_mm),
        "give the board's pitch in mm, as measured with a ruler over many squares");
  }
}

}  // namespace

Verdict judge_camera(const CameraCalibration& calibration) {
  Verdict verdict;
  judge_fit(calibration, verdict);
  judge_lens(calibration, verdict);
  judge_views(calibration, verdict);
  return verdict;
}

Verdict judge_no_camera(const Error& error, std::span<const RejectedView> rejected) {
  Verdict verdict;
  verdict.add(Grade::fail, error.what,
              fmt::format("take {} or more sharp views, the board tilted by 20 to 45 degrees to all sides and brought "
                          "into all corners of the picture",
                          limits::kViewsPass));
  tell_rejected(rejected, verdict);
  if (!rejected.empty()) {
    verdict.next_steps.insert(verdict.next_steps.begin(),
                              "see above why each view is rejected: is --board the pattern in the pictures, counted as "
                              "it says (inner corners of a chessboard)?");
  }
  return verdict;
}

}  // namespace birdseye::calibration
