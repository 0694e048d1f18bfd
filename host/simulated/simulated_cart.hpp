#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "drivers/system/child_process.hpp"
#include "drivers/system/local_programs.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::host {

/// What `birdseye-sim cart --deformation` takes; the first is its default.
std::vector<std::string> deformation_kinds();

struct SimulatedCartSettings {
  std::filesystem::path folder;  ///< all that the cart writes goes here
  std::filesystem::path ct;      ///< a CT of the user's own, or empty for the procedural patient
  unsigned seed = 1;
  double deformation_mm = 0;       ///< how far the liver has moved since the CT, where it has moved most
  std::string deformation;         ///< one of deformation_kinds; empty: the first
  double position_noise_mm = 0.5;  ///< standard deviation per axis and record
  double angle_noise_deg = 0.1;
  int width_px = 768, height_px = 576;
  double video_rate_hz = 25;
  double dwell_s = 0.3;  ///< how long the scope is held still at each station over the board
  double pause_s = 0;    ///< how long it then stays at the last one, so that the calibration can be worked out
  bool strokes = false;  ///< whether the pointer strokes the liver's face after the fiducials
  bool views = false;    ///< whether it is held still at places about the liver, so that views can be kept
  double look_s = 7;     ///< how long it then sweeps over the liver
  int smoothing_ms = 40, wait_ms = 90;  ///< [pose] of birdseyed: frames wait for the poses that are averaged
  bool drop_late = false;  ///< true: frames that a busy machine has no time to trace are left out; else they come late
  std::filesystem::path faults;  ///< script of faults, or empty
  std::string reference;         ///< patient or table, where a third bird is fixed on it; or empty
};

/// What an operator of the cart knows without the truth: the board, the pointer, how many fiducials there are.
struct CartSheet {
  std::string board;
  Eigen::Vector3d tip_in_pointer_mm = Eigen::Vector3d::Zero();
  int fiducials = 0;
};

/// What the operator does from a moment on.
struct CartStage {
  std::string name;  ///< calibrate, touch, stroke, views, look or end
  DeviceTime begins;
};

/// The simulated patient, instruments and appliance as programs of their own: birdseye-sim on a pseudo-terminal and a
/// frame socket, birdseyed between them and the wire. They end with this object, and with this program, however
/// it ends.
class SimulatedCart {
 public:
  /// Makes the patient (DICOM series, segmentation) in settings.folder/phantom.
  static Result<void> make_patient(const SimulatedCartSettings& settings);
  /// Starts both programs. The world begins once tracker and camera are connected.
  static Result<std::unique_ptr<SimulatedCart>> start(const SimulatedCartSettings& settings);
  ~SimulatedCart();
  SimulatedCart(const SimulatedCart&) = delete;
  SimulatedCart& operator=(const SimulatedCart&) = delete;

  [[nodiscard]] const CartSheet& sheet() const { return sheet_; }
  [[nodiscard]] int port() const { return port_; }
  /// The stages announced so far.
  [[nodiscard]] std::vector<CartStage> stages() const;
  /// Why the simulator ended early, if it did.
  [[nodiscard]] std::string failure() const;
  /// Waits for the simulator to end of its own, so that its truth is whole.
  Result<void> finish(Deadline deadline);

 private:
  SimulatedCart(ChildProcess simulator, CartSheet sheet, int port);
  void listen(const std::stop_token& stop);

  std::unique_ptr<RendezvousFolder> rendezvous_;
  ChildProcess simulator_;
  std::unique_ptr<ChildProcess> appliance_;
  CartSheet sheet_;
  int port_;
  mutable std::mutex mutex_;
  std::vector<CartStage> stages_;
  std::string failure_;
  OwnedThread listener_;
};

}  // namespace birdseye::host
