#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "calibration/time/discipline.hpp"
#include "calibration/time/pose_history.hpp"

/// What the appliance says to hosts, as OpenIGTLink messages (docs/manual/wire.md). Times are of the appliance's clock.
namespace birdseye::wire {

/// What IMAGE has no room for. Travels in a STRING just before the IMAGE.
struct FrameInfo {
  std::uint64_t sequence = 0;
  DeviceTime acquired;  ///< middle of the exposure
  Duration acquired_sigma;
  DeviceTime arrived;
  PoseAnswer pose;                   ///< of the scope's bird at `acquired`
  std::uint64_t frames_dropped = 0;  ///< so far, by camera and appliance together
  /// By which `acquired` was put back, as the calibration record has it, and acquired_sigma grown by how well that is
  /// known. Empty: what is left between the times of frames and poses was not measured.
  std::optional<Duration> latency = std::nullopt;
};

struct VideoFrame {
  FrameInfo info;
  int width_px = 0, height_px = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> rgb;  ///< rows from the top
};

struct Bird {
  std::string name;
  Transform<Tracker, Sensor> tracker_from_sensor;
};

/// The birds that gave a pose at one measurement.
struct Birds {
  DeviceTime acquired;
  std::vector<Bird> birds;
};

/// Why a bird gave no pose, or why the time is not sure. Travels in a STRING beside TDATA.
struct Doubt {
  DeviceTime acquired;
  std::string bird, why;
};

/// An instrument's clock did what jitter does not. Travels in a STRING.
struct ClockChange {
  DeviceTime at;      ///< of the first arrival that shows it
  std::string clock;  ///< tracker, camera
  std::string kind;   ///< step, slip, drift change, restart
  Duration by;        ///< of a step or slip
  double by_ppm = 0;  ///< of a change of drift
};

struct Pedal {
  bool pressed = false;
  DeviceTime at;
};

struct Status {
  bool ok = true;
  std::string text;
};

struct InstrumentHealth {
  std::string name;   ///< tracker, camera, gpio
  std::string state;  ///< absent, starting, running, silent
  std::string text;   ///< what it is, or what is wrong with it, in words
  std::uint64_t times_lost = 0;
  std::map<std::string, std::string> identity;  ///< of the last one that ran: model, serial numbers
};

/// What the appliance's kernel says of its clock (PTP, NTP), and how far the wall clock is from the clock of all
/// stamps.
struct WallClock {
  bool known = false, synchronised = false, tai_known = false;
  std::int64_t max_error_ns = 0, est_error_ns = 0, wall_minus_monotonic_ns = 0;
  std::string source;
  [[nodiscard]] ClockDiscipline discipline() const {
    return {synchronised, {max_error_ns}, {est_error_ns}, tai_known, source};
  }
};

struct Health {
  std::string state;  ///< starting, ready, degraded
  std::vector<InstrumentHealth> instruments;
  double tracker_rate_hz = 0, frame_rate_hz = 0;
  std::uint64_t measurements = 0, measurements_lost = 0, phase_errors = 0, senseless_records = 0, doubted = 0;
  std::uint64_t line_errors = 0, clock_events = 0;
  std::uint64_t frames = 0, frames_dropped = 0, frames_repeated = 0;
  std::uint64_t spurious_strobe_edges = 0;  ///< too close to another to be a frame's
  std::uint64_t messages_shed = 0, clients = 0, clients_shed = 0, requests_refused = 0;
  std::uint64_t events_dropped = 0;  ///< events that came faster than messages could be made of them
  double tracker_drift_ppm = 0, camera_drift_ppm = 0, tracker_time_sigma_ms = 0;
  // From the last byte in to the last byte out, since the last report. Poses to clients that take frames too wait while
  // a frame is on its way; the first figure is of those that do not.
  double latency_ms_p99_tracker = 0, latency_ms_p99_tracker_beside_frames = 0, latency_ms_p99_frame = 0;
  WallClock clock;
  std::string recording;  ///< the appliance recording's file, or why there is none; empty: none was asked for
  std::string reference;  ///< the bird that is fixed on patient or table; empty: there is none
  /// Why nobody known answers for the map of the field that poses are corrected by all the same; empty: somebody does,
  /// or there is none.
  std::string field_unsigned;
};

/// What became of the camera's exposure, gain, white balance and focus, which a client had held or let go.
struct CameraControls {
  bool locked = false;
  std::vector<std::string> done, refused;  ///< a line of text each
};

/// The scope's calibration, by the calibration record that the appliance's configuration names. Travels in a STRING to
/// each client that comes, and to all when it changes.
struct Calibration {
  bool in_force = false;  ///< the instruments are those that it was made with
  std::string why_not;
  std::string record;  ///< its text; empty unless it is in force
};

using Event = std::variant<VideoFrame, Birds, Doubt, ClockChange, Pedal, Status, Health, CameraControls, Calibration>;

inline constexpr const char* kBirdsDevice = "Birds";
inline constexpr const char* kDoubtDevice = "Doubt";
inline constexpr const char* kClockChangeDevice = "ClockChange";
inline constexpr const char* kFrameInfoDevice = "FrameInfo";
inline constexpr const char* kVideoDevice = "Laparoscope";
inline constexpr const char* kPedalDevice = "Pedal";
inline constexpr const char* kStatusDevice = "birdseyed";
inline constexpr const char* kCalibrationDevice = "Calibration";
inline constexpr const char* kHealthDevice = "Health";
// A client asks with these, in a STRING.
inline constexpr const char* kClockPingDevice = "ClockPing";
inline constexpr const char* kClockPongDevice = "ClockPong";
inline constexpr const char* kSubscribeDevice = "Subscribe";
inline constexpr const char* kCameraLockDevice = "CameraLock";
inline constexpr const char* kCameraControlsDevice = "CameraControls";  ///< the answer, to all

}  // namespace birdseye::wire
