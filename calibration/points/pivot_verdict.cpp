#include "calibration/points/pivot_verdict.hpp"

#include <fmt/format.h>

#include <cmath>

namespace birdseye::calibration {

namespace {

/// A figure that should be large has to reach these.
struct Floors {
  double pass, marginal;
};

/// Twenty poses bring the tip's error down to a quarter of one pose's; fewer than eight show no outlier.
constexpr Floors kPoses{20, 8};
/// The tip's length is known about as well as one pose divided by the sine of half of this and by the root of the
/// poses' number; below the second it is four times worse than a pose.
constexpr Floors kTilt_deg{40, 25};
/// Tilts of 40 degrees to all sides swing every direction by 10 and more; along one that swings less, errors grow by
/// the ratio.
constexpr Floors kWeakest_deg{6, 3};
/// The miniBIRD's own 1.8 mm and 0.5 degrees make 2.2 mm at a tip 150 mm away. What is beyond is the hand, the divot or
/// metal near by.
constexpr double kRms_mm = 2.5, kWorstRms_mm = 5;
/// A tip must be a small part of the 2 mm that a touch may be off.
constexpr double kSigma_mm = 0.5, kWorstSigma_mm = 1.5;
constexpr double kOutliers_percent = 15, kMostOutliers_percent = 35;
/// A slide is told from chance by three sigma; a field bent by metal feigns one of a millimetre where the pointer was
/// tilted slowly from side to side.
constexpr double kSlid_mm = 1.5, kWorstSlid_mm = 3, kChance = 3;
/// No pointer is shorter, from its sensor to its tip, or longer.
constexpr double kShortest_mm = 5, kLongest_mm = 1500;

/// A tool spun by hand in a divot wobbles by a degree or two.
constexpr double kWobble_deg = 2, kWorstWobble_deg = 5;
constexpr Floors kTurned_deg{180, 90};
/// Half a degree is 1.3 mm over a shaft of 150 mm.
constexpr double kAxisSigma_deg = 0.3, kWorstAxisSigma_deg = 1;

void judge_floor(Verdict& verdict, const std::string& figure, double value, const char* unit, Floors floors,
                 const std::string& next_step) {
  const auto reason = [&](const char* words, double limit) {
    return fmt::format("{} {:.0f}{}, {} {:.0f}", figure, value, unit, words, limit);
  };
  if (value >= floors.pass) return verdict.add(Grade::pass, reason("of at least", floors.pass));
  if (value >= floors.marginal) return verdict.add(Grade::marginal, reason("less than", floors.pass), next_step);
  verdict.add(Grade::fail, reason("less than", floors.marginal), next_step);
}

std::string text_of(const Eigen::Vector3d& v) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", v.x(), v.y(), v.z());
}

double percent(std::size_t part, std::size_t whole) {
  return 100 * static_cast<double>(part) / static_cast<double>(std::max<std::size_t>(1, whole));
}

void judge_length(Verdict& verdict, double length_mm) {
  if (length_mm < kShortest_mm) {
    verdict.add(Grade::fail, fmt::format("the tip is {:.3f} mm from the sensor, which no pointer is", length_mm),
                "if the poses are in metres, say so: --unit m");
  } else if (length_mm > kLongest_mm) {
    verdict.add(Grade::fail, fmt::format("the tip is {:.0f} mm from the sensor, which no pointer is", length_mm),
                "if the poses are in mm, take --unit m away");
  }
}

void judge_tilt(Verdict& verdict, const PivotTilt& tilt) {
  judge_floor(verdict, "tilted through", tilt.widest_deg, " degrees", kTilt_deg,
              fmt::format("tilt the pointer further, by {:.0f} degrees and more from side to side", kTilt_deg.pass));
  const double swing_deg = tilt.weakest_swing_deg;
  if (swing_deg >= kWeakest_deg.pass) return;
  const bool fail = swing_deg < kWeakest_deg.marginal;
  // With hardly any tilt every direction is weak: naming one of them would tell nothing.
  if (tilt.widest_deg < kTilt_deg.marginal && fail) return;
  verdict.add(
      fail ? Grade::fail : Grade::marginal,
      fmt::format("turned about {} one axis, {} of the sensor: along it, which swung by {:.1f} degrees where {:.0f} "
                  "are needed, the tip is {}",
                  fail ? "no more than" : "little more than", text_of(tilt.weakest_in_sensor), swing_deg,
                  kWeakest_deg.pass, fail ? "unknown" : "known badly"),
      "tilt the pointer across the plane in which it was tilted, too: to all sides, as a stirred spoon");
}

}  // namespace

Verdict judge_pivot(const Pivot& pivot) {
  Verdict verdict;
  const std::size_t poses = pivot.residuals_mm.size();
  judge_floor(verdict, "poses that differ", static_cast<double>(pivot.distinct_poses), "", kPoses,
              fmt::format("record more poses, {:.0f} and more, while the pointer is tilted", kPoses.pass));
  judge_length(verdict, pivot.robust.tip_in_sensor_mm.norm());
  judge_tilt(verdict, pivot.tilt);
  verdict.judge(
      "poses that do not agree with the others", percent(pivot.outliers.size(), poses), "%", kOutliers_percent,
      kMostOutliers_percent,
      "keep the tip pressed into the divot from the first pose to the last; where the recording holds several "
      "divots, say which frames belong to which (--phases)");
  verdict.judge("distance of the tip from its pivot", pivot.robust.rms_mm, "mm rms", kRms_mm, kWorstRms_mm,
                "use a divot that fits the tip, keep metal away and the sensor firmly on the pointer");
  if (std::isnan(pivot.held_out_mm)) {
    verdict.add(Grade::marginal, "no held-out error: without the poses that lean to one side too few are left",
                "tilt to all sides");
  } else {
    verdict.judge("held-out error", pivot.held_out_mm, "mm rms", kRms_mm, kWorstRms_mm,
                  "tilt to all sides, so that no side is told by the others alone");
  }
  if (std::isfinite(pivot.tip_sigma_mm)) {
    verdict.judge("standard error of the tip", pivot.tip_sigma_mm, "mm", kSigma_mm, kWorstSigma_mm,
                  "tilt further and record more poses");
  } else {
    verdict.add(Grade::fail,
                fmt::format("no standard error of the tip: along {} of the sensor the poses leave it open",
                            text_of(pivot.tilt.weakest_in_sensor)),
                "tilt to all sides");
  }
  if (pivot.slid_mm > kChance * pivot.slid_sigma_mm && pivot.slid_mm > kSlid_mm) {
    verdict.add(
        pivot.slid_mm > kWorstSlid_mm ? Grade::fail : Grade::marginal,
        fmt::format("the tip slid by {:.1f} mm in divot {} while poses were recorded (its place in the last third "
                    "of the time against the first)",
                    pivot.slid_mm, pivot.slid_divot + 1),
        "use a deeper divot that cannot move, and check that the sensor is firm on the pointer; where the tip was put "
        "into another divot, say which poses belong to which (--phases)");
  }
  return verdict;
}

Verdict judge_spin_axis(const SpinAxis& axis) {
  Verdict verdict;
  judge_floor(verdict, "spun through", axis.turned_deg, " degrees", kTurned_deg,
              "spin the pointer further about its shaft, by half a turn and more");
  verdict.judge("wobble of the spun shaft", axis.wobble_deg, "degrees rms", kWobble_deg, kWorstWobble_deg,
                "spin the pointer without tilting it: its tip in the divot, its shaft in a notch");
  verdict.judge("poses of the spin that do not agree", percent(axis.outliers.size(), axis.residuals_deg.size()), "%",
                kOutliers_percent, kMostOutliers_percent, "record the spin again, without pauses to turn your hand");
  verdict.judge("standard error of the axis", axis.sigma_deg, "degrees", kAxisSigma_deg, kWorstAxisSigma_deg,
                "record more poses while the pointer is spun");
  return verdict;
}

}  // namespace birdseye::calibration
