#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "calibration/geometry/field_map.hpp"
#include "calibration/time/pose_history.hpp"
#include "device/birdseyed/calibration_guard.hpp"
#include "device/birdseyed/frame_clock.hpp"
#include "device/birdseyed/instrument_board.hpp"
#include "device/birdseyed/raw_event.hpp"
#include "device/wire/packet.hpp"
#include "drivers/minibird/assembler.hpp"

namespace birdseye::device {

struct CoreSettings {
  std::vector<std::string> bird_names = {"scope"};  ///< by address; the first is the scope's
  bool transforms = true;                           ///< a TRANSFORM for each bird beside TDATA
  PoseHistory::Settings pose;
  /// How long a frame may wait for measurements from after it, from its arrival on; 0: it goes at once, with a pose
  /// that may be predicted.
  Duration pose_wait{0};
  FrameClock::Settings frame_clock;
  std::string notice;                          ///< said in STATUS beside what is amiss, of which it is none
  std::string calibration;                     ///< a calibration record's text; empty: none
  std::string calibration_refused;             ///< why it is not used with any instrument; empty: it may be
  std::optional<calibration::FieldMap> field;  ///< corrects every pose; poses outside the mapped volume are doubted
  calibration::Identity field_of;  ///< the tracker whose field that is; of another every pose is doubted. Empty: any
  std::string field_refused;       ///< why the map is not used, and every pose doubted: nobody known signed it
  std::string field_unsigned;      ///< that nobody known signed it, where it is used all the same
};

/// What the appliance knows and says. Pure: the same events in the same order give the same packets, byte for byte.
class Core {
 public:
  explicit Core(CoreSettings settings);

  /// The messages that an event brings about, in order.
  std::vector<wire::Packet> take(const RawEvent& event);
  /// Whether frames wait for poses: then events must go on coming, if only ticks.
  [[nodiscard]] bool waiting() const { return !frames_.empty(); }

  struct Counters {
    drivers::minibird::MiniBirdCounters tracker;
    std::uint64_t frames = 0, frames_lost = 0, frames_repeated = 0, clock_events = 0;
    std::uint64_t spurious_strobe_edges = 0;
    double tracker_drift_ppm = 0, camera_drift_ppm = 0, tracker_time_sigma_ms = 0;
  };
  [[nodiscard]] Counters counters() const;
  [[nodiscard]] const InstrumentBoard& board() const { return board_; }
  /// What STATUS last said: all that is amiss, and the notice.
  [[nodiscard]] const std::string& status_text() const { return status_text_; }

 private:
  struct BirdState {
    drivers::minibird::DoubtKind doubt = drivers::minibird::DoubtKind::none;  ///< of the newest measurement
    std::string why;
    DeviceTime since, told;
    bool in_status = false;
  };

  struct TimedFrame {
    drivers::Frame frame;
    FrameClock::Time time;
    std::optional<Duration> latency;  ///< by which time was put back
  };

  void note(const InstrumentChanged& changed);
  void note(const TrackerBytes& bytes);
  void note(const FrameCame& came);
  void note(const EdgesCame& edges);
  void note(const Tick&) {}
  void publish(const drivers::minibird::Measurement& measurement);
  void tell(Instrument instrument, const std::vector<ClockEvent>& events);
  /// The reading corrected by the field map; doubted where the field was not mapped, or the map is not used.
  [[nodiscard]] drivers::minibird::BirdReading corrected(const drivers::minibird::BirdReading& reading);
  void note_doubt(std::size_t bird, const drivers::minibird::BirdReading& reading, DeviceTime at);
  void correct_latency(TimedFrame& timed) const;
  void release_frames(DeviceTime now);
  void publish(const TimedFrame& timed);
  void publish_status(DeviceTime now);
  [[nodiscard]] wire::Status status() const;

  CoreSettings settings_;
  InstrumentBoard board_;
  std::optional<drivers::minibird::MeasurementAssembler> assembler_;
  drivers::minibird::MiniBirdCounters counted_;             ///< by the assemblers before this one
  std::vector<drivers::minibird::BirdGuard::Noise> noise_;  ///< as the one before knew it
  std::uint64_t clock_events_ = 0, unmapped_ = 0;
  std::string field_fault_;  ///< why the map is not of this tracker's field
  std::vector<BirdState> birds_;
  PoseHistory scope_;
  FrameClock frame_clock_;
  std::optional<DeviceTime> stamps_ahead_;  ///< when the newest frame came whose stamp lay ahead of the clock
  Duration ahead_told_;                     ///< how far, as STATUS has it
  DeviceTime ahead_told_at_;
  CalibrationGuard calibration_;
  std::deque<TimedFrame> frames_;  ///< waiting for poses
  std::uint64_t frames_seen_ = 0, frames_lost_ = 0, frames_repeated_ = 0;
  std::optional<std::uint64_t> next_sequence_;
  Duration time_sigma_;
  std::string status_text_ = "never said";
  std::vector<wire::Packet> out_;
};

}  // namespace birdseye::device
