#include "calibration/hand_eye/hand_eye_observability.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/base/counted.hpp"
#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/hand_eye/hand_eye_handedness.hpp"
#include "calibration/hand_eye/hand_eye_start.hpp"

namespace birdseye::calibration {

namespace {

/// Below these root mean square turns about the second axis, hand-eye is open, or hardly held (R. Tsai and R. Lenz: its
/// error goes as one over the turns; ten times a tracker's half degree is where it is worth having).
constexpr double kOpenTurnDeg = 5;
constexpr double kWideTurnDeg = 10;
/// The angles of the same turns by tracker and picture, which no hand-eye can reconcile if they differ.
constexpr double kMismatchDeg = 4;
/// How many times better poses have to fit the pictures that come before or after, to be called theirs.
constexpr double kBetterShifted = 3;
/// The board's scale is off if by so many sigmas and so much; by as much as kWorthlessScale nothing else can be told.
constexpr double kHiddenMm =
    3;  // one sigma of the board's size at the board's distance; twice that is an overlay's worth
constexpr double kScaleSigmas = 4;
constexpr double kScaleOff = 0.015;
constexpr double kWorthlessScale = 0.2;
/// Nearer than this, by the picture, nothing new is seen: a shift of the board as a part of its distance, a turn.
constexpr double kSameShift = 1e-3;
constexpr double kSameTurnDeg = 0.05;
constexpr std::size_t kFewestStations = 3;

Eigen::Matrix3d body_from_sensor_rotation(const SummedStation& s) {
  return s.chain.tracker_from_body.rotation().transpose() * s.chain.tracker_from_sensor.rotation();
}

struct PrincipalAxes {
  Eigen::Matrix3d directions;
  Eigen::Vector3d turns_deg;
};

/// scatter: mean of turn * turn^T. The greatest first, each pointing along its greatest part.
PrincipalAxes principal(const Eigen::Matrix3d& scatter) {
  const SymmetricEigen<3> scattered = symmetric_eigen(scatter);
  PrincipalAxes out;
  for (int i = 0; i < 3; ++i) {
    Eigen::Vector3d axis = scattered.vectors.col(2 - i);
    Eigen::Index greatest = 0;
    axis.cwiseAbs().maxCoeff(&greatest);
    if (axis[greatest] < 0) axis = -axis;
    out.directions.col(i) = axis;
    out.turns_deg[i] = std::sqrt(std::max(0.0, scattered.values[2 - i])) * kDegPerRad;
  }
  return out;
}

void find_axes(std::span<const SummedStation> stations, HandEyeObservability& out) {
  Eigen::Matrix3d of_sensor = Eigen::Matrix3d::Zero(), of_camera = Eigen::Matrix3d::Zero();
  std::vector<double> mismatches;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const Eigen::Vector3d sensor =
          rotation_log(body_from_sensor_rotation(stations[i]).transpose() * body_from_sensor_rotation(stations[k]));
      const Eigen::Vector3d camera = rotation_log(stations[i].camera_from_marker.rotation() *
                                                  stations[k].camera_from_marker.rotation().transpose());
      of_sensor += sensor * sensor.transpose();
      of_camera += camera * camera.transpose();
      mismatches.push_back(std::abs(sensor.norm() - camera.norm()) * kDegPerRad);
      out.greatest_turn_deg = std::max(out.greatest_turn_deg, camera.norm() * kDegPerRad);
    }
  }
  const double pairs = static_cast<double>(std::max<std::size_t>(1, mismatches.size()));
  const PrincipalAxes sensor = principal(of_sensor / pairs), camera = principal(of_camera / pairs);
  out.axes_in_sensor = sensor.directions;
  out.axes_in_camera = camera.directions;
  // The picture's turns: the tracker's noise makes turns where there are none.
  out.turns_deg = camera.turns_deg;
  out.angle_mismatch_deg = median_of(mismatches);
}

std::string axis_in_words(const HandEyeObservability& found) {
  constexpr double kNear = 0.9;
  const Eigen::Vector3d axis = found.axes_in_sensor.col(0);
  std::string words = fmt::format("({:.2f}, {:.2f}, {:.2f}) of the sensor", axis.x(), axis.y(), axis.z());
  Eigen::Index greatest = 0;
  const double part = axis.cwiseAbs().maxCoeff(&greatest);
  if (part > kNear) words += fmt::format(", near its {} axis", "xyz"[greatest]);
  if (std::abs(found.axes_in_camera(2, 0)) > kNear) words += ", and near the camera's line of sight";
  return words;
}

void judge_axes(HandEyeObservability& found) {
  if (found.turns_deg[0] < kOpenTurnDeg) {
    found.findings.push_back(
        {Grade::fail,
         fmt::format("the scope hardly turned: {:.1f} degrees (root mean square) between stations, "
                     "of at least {:.0f}",
                     found.turns_deg[0], kOpenTurnDeg),
         "turn the scope between the stations by 30 degrees or more, about different axes"});
  } else if (found.turns_deg[1] < kOpenTurnDeg) {
    found.findings.push_back(
        {Grade::fail,
         fmt::format("all turns are about one axis, which lies along {}: the translation along it is open",
                     axis_in_words(found)),
         "tilt the scope across that axis by 30 degrees or more, to both sides"});
  } else {
    found.solvable = true;
    if (found.turns_deg[1] < kWideTurnDeg) {
      found.findings.push_back(
          {Grade::marginal,
           fmt::format("nearly all turns are about one axis, along {}: {:.1f} degrees about the next, of {:.0f}",
                       axis_in_words(found), found.turns_deg[1], kWideTurnDeg),
           "tilt the scope across that axis by 30 degrees or more, to both sides"});
    }
  }
}

/// Median disagreement of turns if each picture belonged to the pose `shift` later.
double shifted_mismatch_deg(const std::vector<const SummedStation*>& in_order, int shift) {
  std::vector<double> out;
  const int count = static_cast<int>(in_order.size());
  const auto at = [&](int i) -> const SummedStation& { return *in_order[static_cast<std::size_t>(i)]; };
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < i; ++k) {
      if (k + shift < 0 || i + shift < 0 || k + shift >= count || i + shift >= count) continue;
      const double tracker =
          rotation_angle_between(body_from_sensor_rotation(at(i + shift)), body_from_sensor_rotation(at(k + shift)));
      const double picture = rotation_angle_between(at(i).camera_from_marker.rotation().transpose(),
                                                    at(k).camera_from_marker.rotation().transpose());
      out.push_back(std::abs(tracker - picture) * kDegPerRad);
    }
  }
  constexpr std::size_t kEnoughPairs = 6;
  return out.size() < kEnoughPairs ? 1e9 : median_of(out);
}

void judge_pairing(const StationsInOrder& in, HandEyeObservability& found) {
  if (found.angle_mismatch_deg < kMismatchDeg) return;
  found.solvable = false;
  std::vector<const SummedStation*> in_order(in.stations.size());
  std::vector<std::size_t> index(in.stations.size());
  for (std::size_t i = 0; i < index.size(); ++i) index[i] = i;
  std::sort(index.begin(), index.end(), [&](std::size_t a, std::size_t b) { return in.rank[a] < in.rank[b]; });
  for (std::size_t i = 0; i < index.size(); ++i) in_order[i] = &in.stations[index[i]];
  Finding finding{Grade::fail,
                  fmt::format("poses and pictures do not belong together: they disagree by {:.1f} degrees about the "
                              "same turns",
                              found.angle_mismatch_deg),
                  "see that each picture has the pose of its own moment, in the same order"};
  for (const int shift : {1, -1, 2, -2, 3, -3}) {
    const double mismatch = shifted_mismatch_deg(in_order, shift);
    if (mismatch > kMismatchDeg || mismatch > found.angle_mismatch_deg / kBetterShifted) continue;
    finding.next_step = fmt::format("the pictures fit the poses that come {} {}: look for one that is missing",
                                    std::abs(shift), shift > 0 ? "later" : "earlier");
    break;
  }
  found.findings.push_back(finding);
}

constexpr double kNearUnit = 0.1;

/// Of two files of poses: which of them seems to be in another unit; empty where neither.
std::string units_in_words(double scale) {
  struct Unit {
    double per_mm;
    const char *name, *option;
  };
  for (const Unit& unit : {Unit{1e3, "metres", "m"}, Unit{10, "cm", "cm"}, Unit{25.4, "inches", "in"}}) {
    if (std::abs(scale / unit.per_mm - 1) < kNearUnit) {
      return fmt::format(
          "the camera's poses seem {:g} times too small against the tracker's: in {}, taken for mm? Give "
          "--eye-unit {}",
          unit.per_mm, unit.name, unit.option);
    }
    if (std::abs(scale * unit.per_mm - 1) < kNearUnit) {
      return fmt::format(
          "the tracker's poses seem {:g} times too small against the camera's: in {}, where the "
          "camera's are in mm? Give --unit {} --eye-unit mm",
          unit.per_mm, unit.name, unit.option);
    }
  }
  return {};
}

std::string scale_in_words(double scale, double sigma, const StationsInOrder& in) {
  const double square_mm = in.square_mm;
  const auto near = [&](double value) { return std::abs(scale / value - 1) < kNearUnit; };
  if (in.given_poses) {
    if (std::string words = units_in_words(scale); !words.empty()) return words;
  }
  if (near(1e-3))
    return "the board seems 1000 times smaller than stated: poses in metres, taken for millimetres? Give --unit m";
  if (near(1e3)) return "the board seems 1000 times larger than stated: its squares in metres, taken for millimetres?";
  if (near(0.1)) return "the board seems 10 times smaller than stated: poses in cm, taken for mm? Give --unit cm";
  if (near(10)) return "the board seems 10 times larger than stated: its squares in cm, taken for mm?";
  if (near(25.4)) return "the board seems 25.4 times larger than stated: its squares in inches?";
  if (near(1 / 25.4)) return "the board seems 25.4 times smaller than stated: poses in inches? Give --unit in";
  std::string words =
      fmt::format("by the tracker the board is {:.3f} +- {:.3f} times as large as stated", scale, sigma);
  if (square_mm > 0) words += fmt::format(": squares of {:.3g} mm, not {:.3g}", scale * square_mm, square_mm);
  return words;
}

/// Where the stations hardly tell the board's size, a wrong one passes unseen, and the camera is off by as much.
void judge_what_scale_hides(const StationsInOrder& in, double scale, double sigma, HandEyeObservability& found) {
  const char* remedy = "measure the board's squares; take stations nearer and further, by a third of the distance";
  std::vector<double> distances_mm;
  for (const SummedStation& s : in.stations) distances_mm.push_back(s.camera_from_marker.translation().norm());
  const double middle_mm = median_of(std::move(distances_mm));
  if (!(sigma * middle_mm < kHiddenMm)) {
    found.findings.push_back({Grade::marginal,
                              fmt::format("these stations do not tell the board's size: if that is stated wrongly, the "
                                          "camera is off by {:.0f} mm before it shows",
                                          2 * std::min(1.0, sigma) * middle_mm),
                              remedy});
  } else if (std::abs(scale - 1) > std::max(2 * sigma, kScaleOff)) {
    found.findings.push_back({Grade::marginal, scale_in_words(scale, sigma, in), remedy});
  }
}

void judge_scale(const StationsInOrder& in, const std::optional<TrackerNoise>& stated, HandEyeObservability& found) {
  const ChainFreedom freedom{in.time_offset, true};
  ChainFit fit;
  fit.state = translations_after(in.stations, rotation_by_axes(in.stations), true);
  for (const SummedStation& s : in.stations)
    fit.residuals.push_back(chain_residual(s.chain, s.camera_from_marker, fit.state).value);
  for (int round = 0; round < 4; ++round) {
    TrackerNoise noise = median_noise(fit.residuals, freedom);
    if (stated) {
      noise.position_sigma_mm = std::max(noise.position_sigma_mm, stated->position_sigma_mm);
      noise.angle_sigma_rad = std::max(noise.angle_sigma_rad, stated->angle_sigma_rad);
    }
    fit = fit_chain(in.stations, fit.state, noise, freedom, true);
    if (fit.residuals.empty()) return;
  }
  const double scale = fit.state.board_scale;
  const double sigma = std::sqrt(fit.covariance(freedom.parameters() - 1, freedom.parameters() - 1));
  if (!(scale > 0) || !(sigma < 0.1 * scale)) return judge_what_scale_hides(in, 1, sigma, found);
  found.board_scale = scale;
  found.board_scale_sigma = sigma;
  if (std::abs(scale - 1) < std::max(kScaleSigmas * sigma, kScaleOff))
    return judge_what_scale_hides(in, scale, sigma, found);
  if (std::abs(scale - 1) > kWorthlessScale) found.solvable = false;
  found.findings.push_back({Grade::fail, scale_in_words(scale, sigma, in),
                            in.given_poses ? "check the units of both files of poses"
                                           : "measure the board's squares, and check the units of board and poses"});
}

}  // namespace

HandEyeObservability observe_hand_eye(const StationsInOrder& in, const std::optional<TrackerNoise>& noise) {
  HandEyeObservability found;
  found.stations = in.stations.size();
  if (in.stations.size() < kFewestStations) {
    found.findings.push_back({Grade::fail,
                              fmt::format("{} with board and pose, of at least {}",
                                          counted(found.stations, "station", "stations"), kFewestStations),
                              "take more stations: ten or more, turned about different axes"});
    if (in.stations.size() == 2) find_axes(in.stations, found);
    return found;
  }
  find_axes(in.stations, found);
  judge_axes(found);
  judge_pairing(in, found);
  if (!found.solvable) return found;
  if (auto wrong = find_wrong_frames(in)) {
    found.solvable = false;
    found.findings.push_back(*std::move(wrong));
    return found;
  }
  judge_scale(in, noise, found);
  return found;
}

std::vector<std::string> find_repeats(std::span<const SummedStation> stations, std::span<const std::string> names) {
  std::vector<std::string> out(stations.size());
  for (std::size_t i = 0; i < stations.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const Transform<Camera, Camera> moved = stations[i].camera_from_marker * stations[k].camera_from_marker.inverse();
      const Eigen::Vector3d at_board = stations[k].camera_from_marker.translation();
      const double shift_mm = (moved * at_board - at_board).norm();
      const double turn_deg = rotation_log(moved.rotation()).norm() * kDegPerRad;
      const auto& a = stations[i].chain;
      const auto& b = stations[k].chain;
      const bool same_pose = a.tracker_from_sensor.matrix() == b.tracker_from_sensor.matrix() &&
                             a.tracker_from_body.matrix() == b.tracker_from_body.matrix();
      const bool same_picture = shift_mm < kSameShift * at_board.norm() && turn_deg < kSameTurnDeg;
      if (same_picture) {
        if (out[k].empty()) out[i] = fmt::format("the same pose as {}", names[k]);
      } else if (same_pose) {
        const std::string moved_by = fmt::format("though the board moved by {:.1f} mm", shift_mm);
        out[i] = fmt::format("its tracked pose is that of {} to the last digit, {}", names[k], moved_by);
        out[k] = fmt::format("its tracked pose is that of {} to the last digit, {}", names[i], moved_by);
      }
    }
  }
  return out;
}

}  // namespace birdseye::calibration
