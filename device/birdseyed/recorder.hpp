#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "calibration/base/queue_fill.hpp"
#include "device/birdseyed/record_file.hpp"
#include "device/birdseyed/recording.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::device {

/// Writes raw events to a file on a thread of its own. If the disk keeps up, everything that was taken more than a
/// second ago is on it, so a power cut loses no more than that. A disk that does not keep up, is full, or goes away
/// ends the recording, and text() says so. A disk never holds up the appliance, not even at the end: a thread that
/// hangs in a disk is abandoned.
class Recorder {
 public:
  /// The most that may wait for the disk, including what is being written: 64 MB, or two frames where these are larger.
  static constexpr std::size_t kMostHeldBytes = 64'000'000;

  /// An error where no file could be begun within a second.
  static Result<std::unique_ptr<Recorder>> start(const RecordConfig& config, const CoreSettings& settings);
  /// Writes what waits, for a second at most.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void take(const RawEvent& event);
  /// The file's path, or why the recording ended.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Of what waits for the disk.
  [[nodiscard]] QueueFill fill() const;

 private:
  class Writer;

  explicit Recorder(std::shared_ptr<Writer> writer);

  std::shared_ptr<Writer> writer_;  ///< shared with the thread, which may be abandoned
  std::filesystem::path path_;
  OwnedThread thread_;
};

}  // namespace birdseye::device
