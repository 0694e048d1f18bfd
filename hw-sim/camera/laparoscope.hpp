#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/phantom/mesh.hpp"

namespace birdseye::hw_sim {

/// A chessboard by its inner corners; the first of them is the origin of Marker, x along the columns, z into the board.
struct Chessboard {
  int columns = 11, rows = 8;
  double square_mm = 6;
};

/// The lens, light and sensor of a laparoscope before a scene, by ray tracing (Embree). Its image formation is its own
/// and shares nothing with the host's renderer: solid texture, wet highlights, a light at the lens that falls with the
/// square of the distance, the round field of the rod optics, lens distortion, shot and read noise.
class Laparoscope {
 public:
  /// Fails where the camera model does not pass check() or the ray tracer cannot start.
  static Result<std::unique_ptr<Laparoscope>> create(const CameraModel& camera, std::uint64_t seed);
  virtual ~Laparoscope() = default;

  /// The cavity: the liver's surface in the patient frame, before a wall of peritoneum around centre.
  virtual void set_cavity(const Mesh& liver_in_patient, const Eigen::Vector3d& centre_in_patient_mm) = 0;
  virtual void set_bench(const Chessboard& board) = 0;

  /// RGB, width * height * 3 bytes. The same pose and sequence give the same bytes. Not for two threads at once.
  virtual std::vector<std::uint8_t> look_into_cavity(const Transform<Camera, Patient>& camera_from_patient,
                                                     std::uint64_t sequence) = 0;
  virtual std::vector<std::uint8_t> look_at_bench(const Transform<Camera, Marker>& camera_from_marker,
                                                  std::uint64_t sequence) = 0;
};

/// The lens of the simulated laparoscope for a picture of this size: a wide rod lens with the barrel distortion such
/// lenses have, its centre a little off that of the chip.
CameraModel laparoscope_lens(int width_px, int height_px);

}  // namespace birdseye::hw_sim
