#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

#include "device/birdseyed/config.hpp"
#include "device/birdseyed/recording.hpp"

namespace birdseye::device {

/// Writes raw events to a file on a thread of its own. What was taken more than a second ago is on the disk: a power
/// cut loses no more. A disk that does not keep up, is full, or goes away ends the recording and is said; it holds up
/// nothing.
class Recorder {
 public:
  /// Begins birdseyed-<UTC date and time>.berec in the folder.
  static Result<std::unique_ptr<Recorder>> start(const RecordConfig& config, const CoreSettings& settings);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void take(const RawEvent& event);
  /// The file, or why it ended.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  Recorder(int fd, std::filesystem::path path, const RecordConfig& config);
  void run(const std::stop_token& stop);
  void end(const std::string& why);
  bool write(const Bytes& bytes);

  int fd_;
  std::filesystem::path path_;
  RecordConfig config_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<RawEvent> waiting_;
  std::size_t waiting_bytes_ = 0;
  bool overrun_ = false;  ///< the disk did not keep up: what follows would have a hole
  std::string ended_;     ///< why; empty while it goes on
  std::uint64_t written_bytes_ = 0;
  std::jthread thread_;
};

}  // namespace birdseye::device
