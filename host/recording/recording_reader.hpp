#pragma once

#include <deque>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/record/sha256.hpp"
#include "host/files/film.hpp"
#include "host/link/event_source.hpp"
#include "host/recording/event_lines.hpp"
#include "host/recording/sequence_reader.hpp"

namespace birdseye::host {

/// Plays a session recording again: the same events in the same order, each frame with its pixels. A PLUS sequence has
/// no events; they are made from its frames: Birds of all transforms that are OK, and a VideoFrame with the scope's.
class RecordingReader : public EventSource {
 public:
  struct Settings {
    double speed = 0;            ///< 1: as fast as it was recorded; 0: as fast as it is taken
    std::string transform = {};  ///< of a PLUS sequence: the scope's, where there are several
    bool pictures = true;        ///< false: frames come without pixels
    /// Of its events as they were signed: where they were changed after they were verified, the recording ends with an
    /// error. Empty: nobody signed.
    std::string events_sha256 = {};
  };

  /// path: a folder that `birdseye record` made, or a .igs.mha or .igs.mhd. Refuses, naming it, what is neither.
  static Result<std::unique_ptr<RecordingReader>> open(const std::filesystem::path& path, const Settings& settings);

  /// The next event. Errc::disconnected at the recording's end, with words that say how many frames there were. Any
  /// other error: the recording is damaged.
  Result<std::optional<wire::Event>> next(Deadline deadline) override;
  /// What is odd about the recording, in words: it was cut short, and so on.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  [[nodiscard]] std::size_t frames() const { return frames_; }            ///< given so far
  [[nodiscard]] std::size_t frames_lost() const { return frames_lost_; }  ///< told of so far, and not whole

 private:
  RecordingReader(std::filesystem::path path, const Settings& settings) : path_(std::move(path)), settings_(settings) {}
  Result<void> open_folder();
  Result<void> open_sequence();
  Result<std::optional<EventOfLine>> take_line();
  /// Whether the events that were read are those that were verified.
  Result<void> check_events();
  Result<std::optional<EventOfLine>> take_of_sequence();
  Result<void> make_events(std::size_t number, const SequenceHeader::Fields& fields);
  Result<bool> fetch_next();
  /// Refuses where the sequence says of a frame what its event does not say. False: it has no picture of it.
  [[nodiscard]] Result<bool> compare(const wire::VideoFrame& frame, std::size_t index) const;
  Result<bool> fetch_pixels(wire::VideoFrame& frame, const FramePlace& place);
  Result<void> open_video(const std::string& name, const wire::VideoFrame& frame);
  /// When it is to be given; empty: as soon as it is asked for.
  [[nodiscard]] std::optional<HostTime> due(const wire::Event& event);
  [[nodiscard]] Error end() const;

  std::filesystem::path path_;
  Settings settings_;
  bool ended_whole_ = false;  ///< its sheet says that it was not cut short
  std::ifstream lines_;
  std::size_t line_ = 0;
  calibration::Sha256 lines_sum_;
  std::string video_;  ///< the one that is open
  std::optional<SequenceReader> sequence_;
  std::optional<FilmReader> film_;
  std::string scope_;  ///< the scope's transform in a sequence
  std::size_t next_frame_ = 0;
  std::deque<EventOfLine> made_;
  std::optional<wire::Event> waiting_;  ///< until it is due
  std::optional<DeviceTime> first_, last_;
  HostTime began_;
  std::size_t frames_ = 0, frames_lost_ = 0;
  std::vector<std::string> notes_;
  std::optional<Error> ended_;
};

}  // namespace birdseye::host
