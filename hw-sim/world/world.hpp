#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/phantom/phantom.hpp"
#include "hw-sim/world/happenings.hpp"
#include "hw-sim/world/stroke_path.hpp"

namespace birdseye::hw_sim {

struct Stage {
  std::string name;  ///< sway, calibrate, touch, stroke, views, look or end
  double begins_s;
};

/// How long the operator takes over the board and the liver.
struct Pace {
  double sway_s = 0;     ///< how long the scope is turned to and fro over the board before anything else
  double dwell_s = 0.3;  ///< how long the scope is held still at each station
  double pause_s = 0;    ///< how long it stays at the last one, while the calibration is worked out
  bool strokes = false;  ///< whether the pointer strokes the liver's face after the fiducials
  bool views = false;    ///< whether the scope is first held still at places about the liver
  double look_s = 7;     ///< how long the scope sweeps over the liver
};

/// What a bird is fixed on that others are told relative to.
enum class ReferenceOn { nothing, patient, table };

/// The scripted operation: where everything truly is at any world time. If asked for, the scope is first turned to and
/// fro over a board. Then it is held still over the board at one station after another, then the pointer rests at each
/// fiducial in turn. Then, if asked for, the pointer strokes the liver's face, while the scope stays. Then, if asked
/// for, the scope is held still at places about the liver, 64 degrees apart as seen from it, as several ports let it.
/// Then, turning about one port in the abdominal wall, it sweeps over the liver.
/// Where the patient moves, with the table or on it, scope and pointer go with him: they are in his abdominal wall and
/// touch him.
class World {
 public:
  /// liver: the liver's surface in the patient frame as the CT has it, at which the scope looks. moved: the same as it
  /// lies now, which the pointer strokes; null: as in the CT. Refused where the script would take a bird out of the
  /// tracker's range, and where no part of the liver faces the hand that is to stroke it.
  static Result<World> create(const PhantomTruth& truth, const Mesh& liver, const CameraModel& lens, std::uint64_t seed,
                              const Pace& pace = {}, const Mesh* moved = nullptr, Happenings happenings = {},
                              ReferenceOn reference = ReferenceOn::nothing);

  [[nodiscard]] const std::vector<Stage>& stages() const { return stages_; }
  [[nodiscard]] double ends_s() const { return ends_s_; }
  [[nodiscard]] bool at_bench(double world_s) const { return world_s < touch_s_; }

  [[nodiscard]] Transform<Tracker, Camera> tracker_from_camera(double world_s) const;
  [[nodiscard]] Transform<Tracker, Sensor> tracker_from_sensor(double world_s) const;
  [[nodiscard]] Transform<Tracker, Pointer> tracker_from_pointer(double world_s) const;

  /// The bird that is fixed on patient or table. Only where there is one.
  [[nodiscard]] Transform<Tracker, Sensor> tracker_from_reference(double world_s) const;
  [[nodiscard]] ReferenceOn reference() const { return reference_; }

  [[nodiscard]] Transform<Camera, Sensor> camera_from_sensor(double world_s = 0) const;
  [[nodiscard]] Transform<Tracker, Patient> tracker_from_patient(double world_s = 0) const;
  [[nodiscard]] Transform<Tracker, Marker> tracker_from_marker(double world_s = 0) const;
  /// How the organ differs from that which the scope saw at first.
  [[nodiscard]] OrganChange organ(double world_s) const;
  /// How often as large as at first the picture is.
  [[nodiscard]] double zoom(double world_s) const { return happenings_.zoom(world_s); }
  /// Whether the pointer's tip goes along the liver's surface.
  [[nodiscard]] bool strokes(double world_s) const { return stroke_.on_surface(world_s - stroke_s_); }
  [[nodiscard]] const Eigen::Vector3d& tip_in_pointer_mm() const { return tip_in_pointer_mm_; }
  [[nodiscard]] const Chessboard& board() const { return board_; }
  [[nodiscard]] const PhantomTruth& truth() const { return truth_; }

 private:
  World() = default;
  void plan_views();
  [[nodiscard]] Result<void> check_range() const;
  [[nodiscard]] Transform<Tracker, Camera> sweep(double since_s) const;
  [[nodiscard]] Transform<Tracker, Camera> about(double since_s) const;
  [[nodiscard]] Transform<Tracker, Camera> sway(double world_s) const;
  [[nodiscard]] Transform<Tracker, Camera> scripted_camera(double world_s) const;
  [[nodiscard]] Transform<Tracker, Pointer> scripted_pointer(double world_s) const;
  [[nodiscard]] Transform<Tracker, Tracker> carried(double world_s) const;

  PhantomTruth truth_;
  Chessboard board_;
  Transform<Camera, Sensor> camera_from_sensor_;
  Transform<Tracker, Patient> tracker_from_patient_;
  Transform<Tracker, Marker> tracker_from_marker_;
  Happenings happenings_;
  ReferenceOn reference_ = ReferenceOn::nothing;
  Transform<Patient, Sensor> patient_from_reference_;  ///< at first
  Eigen::Vector3d tip_in_pointer_mm_;
  Eigen::Vector3d look_at_in_patient_mm_;  ///< on the liver's face, over the tumour
  std::vector<Transform<Tracker, Camera>> stations_;
  std::vector<Transform<Tracker, Camera>> views_;
  std::vector<Eigen::Vector3d> tip_stops_in_tracker_mm_;  ///< park, each fiducial, park
  StrokePath stroke_;
  std::vector<Stage> stages_;
  double dwell_s_ = 0, calibrate_s_ = 0, touch_s_ = 0, stroke_s_ = 0, views_s_ = 0, look_s_ = 0, ends_s_ = 0;
};

}  // namespace birdseye::hw_sim
