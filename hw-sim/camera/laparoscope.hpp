#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/camera/hollow.hpp"
#include "hw-sim/phantom/mesh.hpp"

namespace birdseye::hw_sim {

/// A chessboard by its inner corners; the first of them is the origin of Marker, x along the columns, z into the board.
struct Chessboard {
  int columns = 11, rows = 8;
  double square_mm = 6;
};

/// What an organ's surface looks like, and what is behind it.
enum class Coat {
  liver,  ///< dark red and wet, with capsular vessels, in a cavity of peritoneum
  skin,   ///< a plastic head's, among surgical drapes
};

struct Cavity {
  Mesh organ = {};                            ///< as the scope sees it, in the patient frame
  std::vector<Eigen::Vector3f> rest_mm = {};  ///< of each vertex before the organ was deformed, or empty where it was
                                              ///< not: the texture stays on the tissue
  Coat coat = Coat::liver;
  std::optional<Eigen::Vector3d> wall_centre_mm =
      {};                       ///< of a round wall about everything; empty: the background is black
  double wall_radius_mm = 300;  ///< must reach beyond every place to look from
  Mesh instruments = {};        ///< of grey metal, in front of the organ; empty: none
  double texture = 1;           ///< the contrast of the organ's pattern, as a multiple of the usual
  double wet = 1;               ///< the strength of highlights, as a multiple of the usual
  double blood = 0;             ///< the share of the organ's surface that blood covers, which stays on the tissue
};

/// How the organ differs from that of the cavity.
struct OrganChange {
  std::optional<Hollow> hollow = {};
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();  ///< of all of it, hollow too
  bool operator==(const OrganChange&) const = default;
};

struct LaparoscopeSettings {
  CameraModel lens = {};
  std::uint64_t seed = 1;  ///< of texture and noise
  Eigen::Vector3d lamp_in_camera_mm = {0, 0, 0};
  double well_lit_mm = 100;  ///< the distance at which the exposure is right
  double noise = 1;          ///< of the sensor, as a multiple of the usual; 0 is none
  double field = 0.53;       ///< the radius of the round field, by the picture's width
  double blur_px = 0;        ///< of the lens: a Gaussian's standard deviation
};

/// The lens, light and sensor of a laparoscope before a scene, by ray tracing (Embree). Its image formation is its own
/// and shares nothing with the host's renderer: solid texture, wet highlights, a light at the lens that falls with the
/// square of the distance, the round field of the rod optics, lens distortion, shot and read noise.
class Laparoscope {
 public:
  /// Fails where the camera model does not pass check() or the ray tracer cannot start.
  static Result<std::unique_ptr<Laparoscope>> create(const LaparoscopeSettings& settings);
  virtual ~Laparoscope() = default;

  virtual void set_cavity(const Cavity& cavity) = 0;
  virtual void set_bench(const Chessboard& board) = 0;
  /// Changes the organ of the cavity that was set, from how it was set: changes do not add up.
  virtual void change_organ(const OrganChange& change) = 0;
  /// Magnifies the picture about the lens's centre, from the lens of the settings, the field's edge with it: what a
  /// zoom between the scope and its chip does.
  virtual void zoom(double factor) = 0;

  /// RGB, width * height * 3 bytes. The same pose and sequence give the same bytes. Not for two threads at once.
  virtual std::vector<std::uint8_t> look_into_cavity(const Transform<Camera, Patient>& camera_from_patient,
                                                     std::uint64_t sequence) = 0;
  virtual std::vector<std::uint8_t> look_at_bench(const Transform<Camera, Marker>& camera_from_marker,
                                                  std::uint64_t sequence) = 0;

  /// 255 at pixels that the round field of the lens shows whole, else 0.
  [[nodiscard]] virtual std::vector<std::uint8_t> lens_circle() const = 0;
  /// Whether a point of the organ's surface with this normal faces the lens, lies in the lens's field, and is not
  /// hidden by anything in the cavity.
  [[nodiscard]] virtual bool sees(const Transform<Camera, Patient>& camera_from_patient,
                                  const Eigen::Vector3d& point_in_patient_mm, const Eigen::Vector3d& normal) const = 0;
};

/// The lens of the simulated laparoscope for a picture of this size: a wide rod lens with the barrel distortion such
/// lenses have, its centre a little off that of the chip.
CameraModel laparoscope_lens(int width_px, int height_px);

}  // namespace birdseye::hw_sim
