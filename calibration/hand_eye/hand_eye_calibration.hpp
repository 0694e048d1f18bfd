#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/detect/pattern_view.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/camera_parameters.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/hand_eye/board_symmetry.hpp"
#include "calibration/hand_eye/tracked_chain.hpp"
#include "calibration/hand_eye/view_pose.hpp"

namespace birdseye::calibration {

/// One moment with both a picture through the scope and a tracked pose of it.
struct HandEyeStation {
  std::string name;  ///< for messages, as of its picture
  PatternView view;
  std::optional<PatternView> right_view;                        ///< of the second lens of a stereo scope
  std::optional<Transform<Camera, Marker>> camera_from_marker;  ///< instead of views: what another program found
  Transform<Tracker, Sensor> tracker_from_sensor;
  std::optional<Transform<Tracker, TrackedBody>> tracker_from_body;  ///< of a board that moves and is tracked
  Motion sensor_motion, body_motion;                                 ///< needed for the time offset only
  std::optional<double> time_s;  ///< of a stream, in which neighbours err together; none where taken one by one
};

struct HandEyeInput {
  std::vector<HandEyeStation> stations;
  std::optional<CameraModel> camera;  ///< none is needed where stations hold camera_from_marker
  std::optional<StereoLens> right;
  /// Of the first lens's nine parameters, in CameraModel's order; none: the lens is taken for exact.
  std::optional<CameraMatrix> camera_covariance;
  std::optional<TrackerNoise> tracker_noise;  ///< none: estimated from the residuals
  TrackerNoise view_noise;                    ///< of camera_from_marker, where that is given instead of corners
  std::optional<double> corner_sigma_px;      ///< per axis; none: estimated from the residuals
  std::optional<BoardSymmetry> symmetry;      ///< of a board whose pictures do not tell which way round it lies
  bool estimate_time_offset = false;          ///< the stations then hold their motions
  /// Poses were turned round as they were read, for somebody said that they are the inverse: for advice on them.
  bool sensor_inverted = false, eye_inverted = false;
};

/// Something that the person who holds the scope should know.
struct Finding {
  Grade grade = Grade::pass;
  std::string reason, next_step;
};

/// What the stations determine, found before anything is solved.
struct HandEyeObservability {
  std::size_t stations = 0;  ///< that are used
  /// Principal axes of the turns between stations, the most turned about first, in the sensor's frame and the camera's
  /// (columns), and the root mean square turn about each.
  Eigen::Matrix3d axes_in_sensor = Eigen::Matrix3d::Identity(), axes_in_camera = Eigen::Matrix3d::Identity();
  Eigen::Vector3d turns_deg = Eigen::Vector3d::Zero();
  double greatest_turn_deg = 0;
  /// By how much tracker and pictures disagree about the angle of the same turn: median over all pairs of stations.
  double angle_mismatch_deg = 0;
  /// True size of the board over its stated size, by the tracker's distances against the camera's; 0 if not determined.
  double board_scale = 0, board_scale_sigma = 0;
  bool solvable = false;
  std::vector<Finding> findings;
};

/// A closed form's answer.
struct HandEyeStart {
  std::string method;
  std::string failed;  ///< why it has none; empty if it has
  Transform<Camera, Sensor> camera_from_sensor;
  double score = std::numeric_limits<double>::infinity();  ///< tracked reprojection, px; without pictures, mm
};

/// How one station fits.
struct HandEyeStationFit {
  std::string name;
  bool used = false;
  std::string why_not;                        ///< "outlier: ..", "rejected: .."; empty if used
  std::size_t corners_left_out = 0;           ///< that do not fit the board, of its first lens and its second
  double view_rms_px = 0;                     ///< of its other corners, with the board's pose that they fit best
  double tracked_px = 0;                      ///< of its corners, with the board where the tracker says that it is
  double held_out_px = 0;                     ///< the same with the hand-eye of all the other stations
  double held_out_mm = 0;                     ///< the same across the line of sight, at the board
  double turn_off_deg = 0, shift_off_mm = 0;  ///< tracked pose against the one through the picture, with all stations
  double distance_squared = 0;  ///< Mahalanobis distance of its held-out residual, squared: six on average
  Transform<Camera, Marker> camera_from_marker;
  std::vector<Eigen::Vector2d> seen_px, tracked_corner_px;  ///< held out
};

/// Between two stations something moved that calibration takes for fixed, or the tracker's field differs.
struct HandEyeStep {
  std::string before, after;  ///< the stations' names
  /// By how much what is drawn at the board is off then, with one standard deviation.
  double shift_mm = 0, shift_sigma_mm = 0;
  double turn_deg = 0, turn_sigma_deg = 0;
  double sigmas = 0, limit_sigmas = 0;  ///< how far from chance, and how far chance goes

  /// What 97.5 % of such estimates bear out: where the stations tell a direction badly, the estimate alone is large.
  [[nodiscard]] double least_shift_mm() const { return std::max(0.0, shift_mm - 2 * shift_sigma_mm); }
  [[nodiscard]] double least_turn_deg() const { return std::max(0.0, turn_deg - 2 * turn_sigma_deg); }
};

struct HandEyeResult {
  bool solved = false;  ///< otherwise only observability, and of the stations what was rejected, are filled
  Transform<Camera, Sensor> camera_from_sensor;
  /// Of (rotation, rad; translation, mm): the true one is exp(rotation) R, t + translation, in the camera's frame.
  Matrix6d covariance = Matrix6d::Zero();
  /// The 95 % region: errors e with e^T covariance^-1 e up to this.
  double region_limit = 0;
  Transform<TrackedBody, Marker> body_from_marker;  ///< tracker_from_marker for a board at rest
  std::optional<double> time_offset_s;
  double time_offset_sigma_s = 0;

  double corner_sigma_px = 0;
  TrackerNoise tracker_noise;  ///< stated, or as estimated
  bool noise_estimated = false;
  double of_lens_at_board_mm = 0;  ///< the lens's part of sigma_at_board_mm()
  double variance_factor =
      1;              ///< of the residuals, over what the stated noise lets expect; multiplies the covariance if > 1
  double rms_px = 0;  ///< corners against the fit, in which the tracked poses may err
  double tracked_px = 0, held_out_px = 0, held_out_mm = 0;  ///< over the stations used, as above
  double held_out_median_px = 0;                            ///< over the stations, which one bad pose does not move
  double working_distance_mm = 0;                           ///< median, camera to board
  /// On how many errors held out rest, each with hand-eye from the others: the stations used, or of a stream the blocks
  /// of its neighbours. Empty: not solved.
  std::optional<int> independent_stations;

  HandEyeObservability observability;
  std::vector<HandEyeStart> starts;
  std::string start;                        ///< the one that was refined
  std::vector<HandEyeStationFit> stations;  ///< in the order of the input
  std::vector<std::string> outliers;
  std::optional<HandEyeStep> step;  ///< the most likely, where chance is no excuse
  std::vector<double> cost_trace;   ///< of the last refinement, per iteration

  [[nodiscard]] Eigen::Vector3d rotation_sigma_deg() const;
  [[nodiscard]] Eigen::Vector3d translation_sigma_mm() const;
  /// How far off a point straight ahead at the working distance is: one sigma, root mean square over the directions
  /// across the line of sight.
  [[nodiscard]] double sigma_at_board_mm() const { return sigma_at_board_mm(covariance); }
  /// The same of a covariance that is a part of the whole.
  [[nodiscard]] double sigma_at_board_mm(const Matrix6d& part) const;
};

/// Where the camera sits on its sensor, from stations at which scope and board were seen together. All closed forms
/// start; the best by reprojection is refined to the most likely solution over all corners and tracked poses
/// (hand_eye_refinement.hpp). Does not depend on the order of the stations.
/// What cannot be used is an error: no stations, stations unlike each other (some with a tracked board, some without),
/// no camera for corners, a camera that fails its check. Where the stations do not determine hand-eye, the result is
/// not `solved` and its observability says why. May be called again and again while stations come in.
Result<HandEyeResult> calibrate_hand_eye(const HandEyeInput& input);

/// Whether a station that is used stands out all the same, as the verdict names it.
bool is_odd(const HandEyeResult& result, const HandEyeStationFit& station);

/// The verdict on a result; the limits are constants in hand_eye_verdict.cpp.
Verdict judge(const HandEyeResult& result);

}  // namespace birdseye::calibration
