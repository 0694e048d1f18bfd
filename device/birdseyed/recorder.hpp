#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>

#include "device/birdseyed/config.hpp"
#include "device/birdseyed/recording.hpp"

namespace birdseye::device {

/// What a recording is written to. Each call may take as long as a disk likes.
class RecordFile {
 public:
  virtual ~RecordFile() = default;
  /// All of it: 0, or errno.
  virtual int write(std::span<const std::uint8_t> bytes) = 0;
  /// Everything so far, so that a power cut does not lose it: 0, or errno.
  virtual int sync() = 0;
};

struct NewRecordFile {
  std::unique_ptr<RecordFile> file;
  std::filesystem::path path;
};

/// birdseyed-<UTC date and time>.berec in the folder; with -2, -3 and so on where there is one of that name.
Result<NewRecordFile> create_record_file(const RecordConfig& config);

/// Writes raw events to a file on a thread of its own. A disk that keeps up has what was taken more than a second ago:
/// a power cut loses no more. One that does not, is full, or goes away ends the recording and is said; it holds up
/// nothing, the end included: a thread that hangs in a disk is let go.
class Recorder {
 public:
  using Create = std::function<Result<NewRecordFile>(const RecordConfig&)>;

  /// What waits for the disk, what is being written included: 64 MB, or two frames where these are larger.
  static constexpr std::size_t kMostHeldBytes = 64'000'000;

  /// An error where no file could be begun, within a second or at all.
  static Result<std::unique_ptr<Recorder>> start(const RecordConfig& config, const CoreSettings& settings,
                                                 Create create = create_record_file);
  /// Writes what waits, for a second at most.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void take(const RawEvent& event);
  /// The file, or why it ended.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  class Writer;

  explicit Recorder(std::shared_ptr<Writer> writer);

  std::shared_ptr<Writer> writer_;  ///< the thread's too, which may be let go
  std::filesystem::path path_;
  std::thread thread_;
};

}  // namespace birdseye::device
