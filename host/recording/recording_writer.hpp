#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/record/sha256.hpp"
#include "calibration/time/pose_history.hpp"
#include "device/wire/messages.hpp"
#include "drivers/identity/this_machine.hpp"
#include "host/files/film.hpp"
#include "host/recording/event_lines.hpp"
#include "host/recording/recording_files.hpp"
#include "host/recording/sequence_writer.hpp"

namespace birdseye::host {

// The files of a session recording.
inline constexpr const char* kRecordingSheet = "recording.json";
inline constexpr const char* kRecordingEvents = "events.jsonl";
inline constexpr const char* kRecordingTracker = "tracker";  ///< .igs.mha
inline constexpr const char* kRecordingVideo = "video";      ///< .igs.mha, or .igs.mhd and .raw, or .mp4; video-2 ...
inline constexpr int kRecordingVersion = 1;

/// The most birds whose poses are in a sequence: more than any tracker has. Their names are what somebody sends.
inline constexpr std::size_t kMostBirds = 64;

struct RecordingSettings {
  std::filesystem::path folder = {};
  std::string source = {};                          ///< whom it was recorded from, as HOST:PORT
  std::string scope = "scope";                      ///< whose poses those of the frames are
  bool compressed = false;                          ///< films by ffmpeg, which lose something
  bool pair = false;                                ///< leaves header and pixels two files
  std::shared_ptr<const ThisMachine> machine = {};  ///< who signs it once it has ended; null: nobody
};

/// One file of frames of one size.
struct RecordedVideo {
  std::string name;
  std::string file;  ///< what to open
  int width_px = 0, height_px = 0;
  std::size_t frames = 0;
  double rate_hz = 0;
};

/// What is in a recording so far.
struct RecordingFigures {
  std::vector<RecordedVideo> videos;
  std::size_t frames = 0, measurements = 0, events = 0;
  std::uint64_t frames_missing = 0;  ///< holes in the camera's count
  std::optional<DeviceTime> first, last;
  std::map<std::string, std::size_t> poses;  ///< by bird
  [[nodiscard]] double seconds() const { return first ? (*last - *first).seconds() : 0; }
};

/// Writes a session recording, a folder of what an appliance tells: events.jsonl holds all of it, to play again;
/// tracker.igs.mha and the video's sequence are for Slicer and PLUS; recording.json says what is in the folder. What
/// was added stays good whatever ends the program.
class RecordingWriter {
 public:
  /// Makes the folder, which must hold no recording yet.
  static Result<std::unique_ptr<RecordingWriter>> create(const RecordingSettings& settings);

  /// Adds an event. An error ends the recording: what came before is kept, and finish() must follow.
  Result<void> add(const wire::Event& event);
  /// Refuses, naming it, where the folder is not where it was any more: nothing is found there in the end.
  [[nodiscard]] Result<void> check_folder() const { return files_.check_folder(); }
  /// Completes the files, and signs what was written where it lies there as it was written. why: the reason why the
  /// recording ended, in words.
  Result<void> finish(const std::string& why);
  [[nodiscard]] const RecordingFigures& figures() const { return figures_; }
  /// What is not as the settings asked for, in words.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// What was removed, replaced or changed while it was recorded, in words, once it has ended: nobody signs it then.
  [[nodiscard]] const std::vector<std::string>& damage() const { return damage_; }
  /// What its poses rest on that no known machine had signed; empty: on nothing such.
  [[nodiscard]] const std::string& rests_on() const { return rests_on_; }

 private:
  RecordingWriter(RecordingSettings settings, RecordingFiles files, OutputFile events, SequenceWriter tracker)
      : settings_(std::move(settings)),
        files_(std::move(files)),
        events_(std::move(events)),
        tracker_(std::move(tracker)) {}
  Result<void> add_line(const wire::Event& event, const FramePlace& place);
  Result<void> add_frame(const wire::VideoFrame& frame);
  Result<void> add_birds(const wire::Birds& birds);
  Result<void> write_measurement();
  void name_transform(const std::string& bird);
  [[nodiscard]] std::optional<std::string> scope_of(const wire::VideoFrame& frame) const;
  Result<void> begin_video(const wire::VideoFrame& frame, double rate_hz);
  Result<void> begin_film(double rate_hz);
  Result<void> write_frame(const wire::VideoFrame& frame);
  Result<void> end_video();
  Result<void> end_film();
  /// Notes the sums of a sequence that has ended, or its damage.
  void keep_sums(SequenceWriter& sequence);
  /// Notes what does not lie in the folder as it was written, and what else lies there.
  void look_through_folder();
  Result<void> write_sheet(const std::string& why, bool ended);
  void note_time(DeviceTime time);
  [[nodiscard]] std::string next_video() const;
  [[nodiscard]] SequenceWriter::Fields fields_of(const wire::VideoFrame& frame) const;

  RecordingSettings settings_;
  RecordingFiles files_;
  OutputFile events_;
  calibration::Sha256 events_sum_;
  SequenceWriter tracker_;
  std::uint64_t events_at_ = 0;
  std::vector<SequenceWriter> sequence_;  ///< one while frames come and are not compressed
  std::optional<Film> film_;
  std::optional<wire::VideoFrame> waiting_;  ///< the first frame of a film, until the second tells the rate
  std::map<std::string, PoseHistory> histories_;
  std::map<std::string, std::string> transform_of_;  ///< by bird
  wire::Birds measured_;                             ///< of one time, until there are poses of another
  std::optional<std::uint64_t> last_sequence_;
  std::optional<wire::Health> health_;
  std::string rests_on_;
  RecordingFigures figures_;
  std::vector<std::string> notes_, damage_;
  bool whole_ = true;  ///< all of it is on the disk; else nobody signs it
};

}  // namespace birdseye::host
