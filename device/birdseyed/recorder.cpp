#include "device/birdseyed/recorder.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <deque>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include "calibration/record/sha256.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/condition.hpp"
#include "drivers/system/crash_note.hpp"

namespace birdseye::device {

namespace {

constexpr Duration kLookEvery = Duration::from_ms(100);
constexpr Duration kSyncEvery = Duration::from_ms(500);
constexpr std::size_t kSyncBytes = 16'000'000;  // more at once, and frames overrun the bound while they wait for it
constexpr Duration kBeginWithin = Duration::from_ms(1000);
constexpr Duration kWriteAfterStop = Duration::from_ms(1000);
constexpr Duration kEndWithin = Duration::from_ms(2000);  // the last write and its sync included

std::string words(int os_errno) {
  return std::generic_category().message(os_errno);
}

std::size_t size_of(const RawEvent& event) {
  std::size_t bytes = 256;
  if (const auto* came = std::get_if<FrameCame>(&event); came != nullptr && came->frame.rgb)
    bytes += came->frame.rgb->size();
  if (const auto* came = std::get_if<TrackerBytes>(&event)) bytes += came->chunk.bytes.size();
  return bytes;
}

}  // namespace

/// What the thread and its recorder share. A thread that hangs keeps it, and nothing else of the program: not even the
/// registry of loggers.
class Recorder::Writer {
 public:
  Writer(RecordConfig config, CoreSettings settings) : config_(std::move(config)), settings_(std::move(settings)) {}

  void run();
  /// The file's name, once it is begun.
  Result<std::filesystem::path> wait_for_begin();
  void take(const RawEvent& event);
  [[nodiscard]] std::string ended() const;
  [[nodiscard]] QueueFill fill() const;
  /// True once the thread is through with the file; false where it hangs.
  bool stop();

 private:
  Result<std::filesystem::path> begin();
  void write_events();
  bool write(const RawEvent& event);
  int put(const Bytes& bytes);
  void sign();
  void sync();
  void end(const std::string& why);

  const RecordConfig config_;
  const CoreSettings settings_;
  const std::shared_ptr<spdlog::logger> log_ = spdlog::default_logger();

  // The thread's alone.
  std::unique_ptr<RecordFile> file_;
  calibration::Sha256 sum_;  ///< of all that the file has taken
  bool whole_ = true;        ///< it has taken all, up to the stop or the limit of its size
  std::optional<ThisMachine> machine_;
  std::size_t written_bytes_ = 0, unsynced_bytes_ = 0;
  DeviceTime synced_;

  mutable std::mutex mutex_;  // of what follows
  Condition work_, told_;
  std::optional<Result<std::filesystem::path>> begun_;
  std::string name_;
  std::deque<RawEvent> waiting_;
  std::size_t held_bytes_ = 0, most_held_bytes_ = kMostHeldBytes;
  std::string ended_;  ///< why; empty while it goes on
  std::optional<DeviceTime> give_up_;
  bool done_ = false;
};

Result<std::filesystem::path> Recorder::Writer::begin() {
  auto created = config_.create(config_.folder);
  if (!created) return created.error();
  file_ = std::move(created->file);
  machine_ = std::move(created->machine);
  int failed = put(recording_magic());
  if (failed == 0) failed = put(block_of(settings_));
  if (failed == 0) return created->path;
  std::error_code ignored;
  std::filesystem::remove(created->path, ignored);
  return Error{Errc::io, fmt::format("{}: cannot be written ({})", created->path.string(), words(failed))};
}

void Recorder::Writer::run() {
  name_this_thread("recording");
  auto begun = begin();
  const bool good = begun.has_value();
  {
    const std::lock_guard lock(mutex_);
    if (good) name_ = begun->string();
    begun_.emplace(std::move(begun));
  }
  told_.notify_all();
  if (good) write_events();
  file_.reset();
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  told_.notify_all();
}

Result<std::filesystem::path> Recorder::Writer::wait_for_begin() {
  std::unique_lock lock(mutex_);
  if (told_.wait(lock, Deadline::after(kBeginWithin), [this] { return begun_.has_value(); })) return *begun_;
  return Error{Errc::timeout,
               fmt::format("{}: the disk does not answer; see [record] folder", config_.folder.string())};
}

void Recorder::Writer::write_events() {
  synced_ = device_now();
  std::size_t in_hand_bytes = 0;
  for (;;) {
    std::optional<RawEvent> event;
    {
      std::unique_lock lock(mutex_);
      held_bytes_ -= std::exchange(in_hand_bytes, 0);
      const auto ending = [this] { return give_up_ || !ended_.empty(); };
      work_.wait(lock, Deadline::after(kLookEvery), [&] { return !waiting_.empty() || ending(); });
      if (waiting_.empty() && ending()) {
        whole_ = whole_ && ended_.empty();
        break;
      }
      if (give_up_ && device_now() > *give_up_) {
        lock.unlock();
        end("cut short, the disk was too slow for what waited");
        whole_ = false;
        break;
      }
      if (!waiting_.empty()) {
        event = std::move(waiting_.front());
        waiting_.pop_front();
        in_hand_bytes = size_of(*event);
      }
    }
    if (event && !write(*std::exchange(event, std::nullopt))) break;
    if (unsynced_bytes_ > kSyncBytes || device_now() - synced_ > kSyncEvery) sync();
  }
  sign();
  sync();
}

bool Recorder::Writer::write(const RawEvent& event) {
  const Bytes block = block_of(event);
  if (const int failed = put(block); failed != 0) {
    end(fmt::format("ended, the disk takes no more ({})", words(failed)));
    return false;
  }
  written_bytes_ += block.size();
  unsynced_bytes_ += block.size();
  if (static_cast<double>(written_bytes_) <= config_.most_gb * 1e9) return true;
  end(fmt::format("ended at {:g} GB, see [record] most_gb", config_.most_gb));
  return false;
}

int Recorder::Writer::put(const Bytes& bytes) {
  const int failed = file_->write(bytes);
  whole_ = whole_ && failed == 0;
  sum_.add(bytes);
  return failed;
}

/// What ended for a disk's sake nobody signs.
void Recorder::Writer::sign() {
  if (!whole_ || !machine_) return;
  const Bytes block = block_of(machine_->sign(calibration::kApplianceRecordingFormat, sum_.hex()));
  if (const int failed = file_->write(block); failed != 0)
    log_->warn("recording: {}: not signed, the disk takes no more ({})", name_, words(failed));
  unsynced_bytes_ += block.size();
}

void Recorder::Writer::sync() {
  if (unsynced_bytes_ == 0) return;
  unsynced_bytes_ = 0;
  // What the kernel could not write it may have thrown away, and it says so once.
  if (const int failed = file_->sync(); failed != 0) {
    whole_ = false;
    end(failed == ENOENT ? "ended, somebody has removed or replaced its file; restart birdseyed to begin another"
                         : fmt::format("ended, the disk has lost some of it ({})", words(failed)));
  }
  synced_ = device_now();
}

void Recorder::Writer::end(const std::string& why) {
  {
    const std::lock_guard lock(mutex_);
    for (const RawEvent& event : waiting_) held_bytes_ -= size_of(event);
    waiting_.clear();
    if (!ended_.empty()) return;  // the first cause is the one to be told
    ended_ = fmt::format("{}: {}", name_, why);
  }
  log_->warn("recording: {}: {}", name_, why);
}

void Recorder::Writer::take(const RawEvent& event) {
  if (!config_.frames && std::holds_alternative<FrameCame>(event)) return;
  const std::size_t bytes = size_of(event);
  std::string overrun;
  {
    const std::lock_guard lock(mutex_);
    if (!ended_.empty()) return;
    most_held_bytes_ = std::max(most_held_bytes_, 2 * bytes + 1'000'000);
    if (held_bytes_ + bytes <= most_held_bytes_) {
      held_bytes_ += bytes;
      waiting_.push_back(event);
    } else {  // what waits is still written; what followed would have a hole before it
      overrun = ended_ = fmt::format("{}: ended, the disk is too slow for these frames", name_);
    }
  }
  work_.notify_one();
  if (!overrun.empty()) log_->warn("recording: {}", overrun);
}

std::string Recorder::Writer::ended() const {
  const std::lock_guard lock(mutex_);
  return ended_;
}

QueueFill Recorder::Writer::fill() const {
  const std::lock_guard lock(mutex_);
  QueueFill out{.queue = "the recording", .values = waiting_.size(), .most_bytes = most_held_bytes_};
  for (const RawEvent& event : waiting_) out.bytes += size_of(event);
  return out;
}

bool Recorder::Writer::stop() {
  std::unique_lock lock(mutex_);
  give_up_ = device_now() + kWriteAfterStop;
  work_.notify_one();
  return told_.wait(lock, Deadline::after(kEndWithin), [this] { return done_; });
}

Result<std::unique_ptr<Recorder>> Recorder::start(const RecordConfig& config, const CoreSettings& settings) {
  std::unique_ptr<Recorder> recorder(new Recorder(std::make_shared<Writer>(config, settings)));
  auto begun = recorder->writer_->wait_for_begin();
  if (!begun) return begun.error();
  recorder->path_ = *std::move(begun);
  return recorder;
}

Recorder::Recorder(std::shared_ptr<Writer> writer)
    : writer_(std::move(writer)), thread_([shared = writer_](const std::stop_token&) { shared->run(); }) {}

Recorder::~Recorder() {
  if (writer_->stop()) {
    thread_.join();
  } else {
    if (!path_.empty()) spdlog::warn("recording: {}: the disk does not answer; going on without it", path_.string());
    thread_.let_go();
  }
}

void Recorder::take(const RawEvent& event) {
  writer_->take(event);
}

QueueFill Recorder::fill() const {
  return writer_->fill();
}

std::string Recorder::text() const {
  const std::string ended = writer_->ended();
  return ended.empty() ? path_.string() : ended;
}

}  // namespace birdseye::device
