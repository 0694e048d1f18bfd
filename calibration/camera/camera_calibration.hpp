#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/detect/pattern_view.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/camera_parameters.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// How many of CameraModel's distortion terms are solved for, simplest first; the rest stay 0.
enum class LensModel { pinhole, radial1, radial2, radial2_tangential2, radial3_tangential2 };
inline constexpr std::array kLensModels{LensModel::pinhole, LensModel::radial1, LensModel::radial2,
                                        LensModel::radial2_tangential2, LensModel::radial3_tangential2};

const char* name_of(LensModel model);
std::optional<LensModel> lens_model_of(std::string_view name);
/// Which of CameraModel's nine parameters the model solves for.
std::array<bool, CameraModel::kParameters> solved_by(LensModel model);

/// The names of the nine, in CameraModel's order, with their units: "fx_px" .. "k3".
inline constexpr std::array kCameraParameterNames{"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"};

struct CameraCalibrationSettings {
  std::optional<LensModel> model;  ///< empty: chosen by held-out error
  /// Points and views that do not fit are found and left out. Without it: least squares of all that is given, as
  /// OpenCV's calibrateCamera.
  bool robust = true;
  int folds = 10;             ///< the views are held out in at most so many groups; one by one where there are fewer
  int columns = 8, rows = 6;  ///< cells of the picture, for coverage and regions
  /// Width of a pixel over its height, as fy over fx is to be: 0.5 where pixels are twice as tall as wide.
  double pixel_aspect = 1;
};

struct RejectedView {
  std::size_t index = 0;  ///< among the views given
  std::string name, reason;
};

/// A point of a view that was used, and what the fit leaves there: seen minus predicted.
struct FittedPoint {
  std::size_t view = 0;  ///< in CameraCalibration::views
  int id = 0;
  Eigen::Vector2d pixel_px, residual_px;
  bool outlier = false;  ///< left out of the fit
};

struct FittedView {
  std::size_t index = 0;  ///< among the views given
  std::string name;
  std::size_t points = 0, outliers = 0;
  double rms_px = 0;       ///< of the points without outliers, as all figures here
  double held_out_px = 0;  ///< rms with the lens of the views of the other groups
  double tilt_deg = 0;     ///< between the board's normal and the optical axis
  double distance_mm = 0;  ///< of the middle of its points, along the optical axis
};

struct LensModelFit {
  LensModel model = LensModel::pinhole;
  CameraModel camera;
  double rms_px = 0, held_out_px = 0, held_out_mm = 0;
  bool folds = false;  ///< some pixel of the picture has no ray
};

/// A cell of the picture.
struct RegionResidual {
  int column = 0, row = 0;
  std::size_t count = 0;
  double rms_px = 0;
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();  ///< what is left of a lens model that does not fit there
};

/// Of the first half of the views, in the order given, and of the second: fx and fy's mean, found from each alone.
struct FocalHalves {
  double first_px = 0, second_px = 0;
  double sigma_px = 0;  ///< one standard deviation of their difference
};

struct CameraCalibration {
  CameraModel camera;
  LensModel model = LensModel::pinhole;
  bool folds = false;  ///< the lens of the chosen model folds inside the picture
  /// Of the nine parameters: what one may believe of the lens. The noise's covariance, made larger where the views
  /// among themselves say more, and by how far the lenses of the other models that the views do not refute lie away:
  /// a model's own residuals do not tell what the model leaves out.
  CameraMatrix covariance = CameraMatrix::Zero();
  /// Rows and columns of parameters not solved for 0: the residuals' variance times the inverse of the normal matrix
  /// from which the boards' poses are eliminated. Holds where residuals are independent and the model is right.
  CameraMatrix noise_covariance = CameraMatrix::Zero();
  /// One standard deviation from how far the lens moves when groups of views are left out (grouped jackknife). Larger
  /// than the noise's where the points of a view err together: a board that is not flat, a view that is blurred.
  CameraVector sigma_between_views = CameraVector::Zero();
  /// Root mean square distance of the lens to those of the models that the views do not refute.
  CameraVector sigma_between_models = CameraVector::Zero();
  /// How far the board's middle seems to stand off its corners, mm, where the views tell it from flat, and it is over
  /// 0.05 mm or changes the lens noticeably; else 0. What any bend that the views tell does to the lens is in the
  /// covariance.
  double board_sag_mm = 0;
  /// The model with the least held-out error, where the views held out refute the one that was asked for.
  std::optional<LensModel> refuted_by;
  std::optional<FocalHalves> focal_halves;  ///< where there are views enough
  double pixel_aspect = 1;                  ///< as it was given
  std::string undetermined;                 ///< what the views leave open, in words; empty where they determine all
  std::vector<Transform<Camera, Marker>> camera_from_marker;  ///< one per used view
  std::vector<FittedView> views;                              ///< used, in the order given
  std::vector<RejectedView> rejected;
  std::vector<FittedPoint> points;  ///< of all used views, outliers too
  std::size_t outliers = 0;
  double noise_sigma_px = 0;  ///< per axis, from the residuals and their degrees of freedom
  double rms_px = 0;          ///< root mean square distance, over the used points
  double held_out_px = 0;     ///< the same, each view with the lens of the other groups; only its pose is fitted to it
  double held_out_mm = 0;     ///< at the board's mean distance
  std::vector<LensModelFit> models;
  int columns = 0, rows = 0;
  std::vector<RegionResidual> regions;  ///< row by row
  double coverage = 0;                  ///< share of cells that hold points
  double tilt_spread_deg = 0;           ///< the largest angle between the normals of two boards
  double least_distance_mm = 0, mean_distance_mm = 0, largest_distance_mm = 0;
  std::vector<double> convergence_px;  ///< rms after each step of the last refinement

  [[nodiscard]] CameraVector sigma() const { return covariance.diagonal().cwiseMax(0).cwiseSqrt(); }
  [[nodiscard]] CameraVector noise_sigma() const { return noise_covariance.diagonal().cwiseMax(0).cwiseSqrt(); }
};

/// Lens and boards' poses from views of a flat pattern (z = 0).
///
/// Z. Zhang's closed form (2000, through OpenCV) starts a least-squares fit over all corners (Ceres, analytic
/// derivatives). Residuals are first weighed by Cauchy's function at a scale from their median. A point is an outlier
/// if, by chance, the worst of so many points would lie that far out in only 1 % of cases. Views most of whose points
/// do not fit are rejected, and the rest is fitted plainly. Each lens model is fitted and held out; the one with the
/// least held-out error is taken, or a simpler one that is as good but for a third of the difference's standard error.
///
/// Views that cannot be used are named in `rejected`: numbers that are not finite, points outside the picture, the same
/// number twice, fewer than six points, the same pose as another view's. The order of views and of points in them
/// changes nothing.
/// Errors: Errc::bad_value for a size that is not positive and views whose vectors do not go together;
/// Errc::degenerate, naming why, where fewer than three views are left or they do not determine a camera.
Result<CameraCalibration> calibrate_camera(std::span<const PatternView> views, int width_px, int height_px,
                                           const CameraCalibrationSettings& settings = {});

/// The limits against which a calibration is judged. Those in pixels are for a picture 1920 wide and go with the width.
namespace camera_limits {
inline constexpr double kWidth_px = 1920;
// At 10 cm before a 70 degree lens a pixel is 0.07 mm, less than the tracker adds. Five pixels are 0.35 mm, which
// shows.
inline constexpr double kHeldOutPass_px = 1, kHeldOutMarginal_px = 5;
// Ten views let one in ten be held out; with fewer than five one bad view decides.
inline constexpr std::size_t kViewsPass = 10, kViewsMarginal = 5;
// Where no board was, distortion is extrapolated. A round picture in a wide frame covers no more than 0.5 of it.
inline constexpr double kCoveragePass = 0.5, kCoverageMarginal = 0.25;
// A focal length that is off by 0.5 % moves the far end of a scene from 100 to 150 mm by 0.25 mm in depth; one that is
// off by 3 %, by 1.5 mm.
inline constexpr double kFocalSigmaPass = 0.005, kFocalSigmaMarginal = 0.03;
// Halves of sound views differ by so many sigmas less often than once in a thousand calibrations.
inline constexpr double kFocusSigmas = 4;
inline constexpr double kCentreSigmaPass = 0.005, kCentreSigmaMarginal = 0.02;  ///< of the width
// Focal length and distance are told apart by foreshortening alone, which goes with the sine of the tilt.
inline constexpr double kTiltSpreadPass_deg = 25, kTiltSpreadMarginal_deg = 10;
inline constexpr double kAspectPass = 0.12, kAspectMarginal = 0.2;  ///< PAL's pixels are 1.07 times as wide as high
inline constexpr double kOutliersPass = 0.05, kOutliersMarginal = 0.2;
// No laparoscope focuses nearer or farther: the board's size was given in another unit.
inline constexpr double kNearest_mm = 5, kFarthest_mm = 5000;
}  // namespace camera_limits

Verdict judge_camera(const CameraCalibration& calibration);
/// The verdict where the views determine no camera: fail, with the error's words, each rejected view's reason and what
/// to do.
Verdict judge_no_camera(const Error& error, std::span<const RejectedView> rejected = {});

/// Whether some pixel of the picture, corners included, has no ray: the lens folds inside it.
bool folds_inside(const CameraModel& camera);

}  // namespace birdseye::calibration
