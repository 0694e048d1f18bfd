#include "device/birdseyed/recorder.hpp"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>

#include "drivers/io/monotonic.hpp"

namespace birdseye::device {

namespace {

constexpr std::size_t kMostWaitingBytes = 256U << 20U;  // two thirds of a second of 1080p60
constexpr Duration kSyncEvery = Duration::from_ms(500);

std::size_t size_of(const RawEvent& event) {
  const auto* came = std::get_if<FrameCame>(&event);
  return 256 + (came != nullptr && came->frame.rgb ? came->frame.rgb->size() : 0);
}

}  // namespace

Result<std::unique_ptr<Recorder>> Recorder::start(const RecordConfig& config, const CoreSettings& settings) {
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  const auto path = config.folder / fmt::format("birdseyed-{:%Y%m%dT%H%M%SZ}.berec", fmt::gmtime(now));
  std::error_code ignored;
  std::filesystem::create_directories(config.folder, ignored);
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
  if (fd < 0) {
    return Error{Errc::unreadable,
                 fmt::format("{}: cannot be written; see [record] folder and its permissions", path.string()), errno};
  }
  std::unique_ptr<Recorder> recorder(new Recorder(fd, path, config));
  if (!recorder->write(recording_magic()) || !recorder->write(block_of(settings)))
    return Error{Errc::io, fmt::format("{}: cannot be written; is the disk full?", path.string()), errno};
  Recorder* const r = recorder.get();
  r->thread_ = std::jthread([r](const std::stop_token& stop) { r->run(stop); });
  return recorder;
}

Recorder::Recorder(int fd, std::filesystem::path path, const RecordConfig& config)
    : fd_(fd), path_(std::move(path)), config_(config) {}

Recorder::~Recorder() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  ::fdatasync(fd_);
  ::close(fd_);
}

bool Recorder::write(const Bytes& bytes) {
  std::span<const std::uint8_t> rest(bytes);
  while (!rest.empty()) {
    const ssize_t put = ::write(fd_, rest.data(), rest.size());
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return false;
    rest = rest.subspan(static_cast<std::size_t>(put));
  }
  written_bytes_ += bytes.size();
  return true;
}

void Recorder::end(const std::string& why) {
  spdlog::warn("recording: {}", why);
  const std::lock_guard lock(mutex_);
  ended_ = why;
  waiting_.clear();
  waiting_bytes_ = 0;
}

void Recorder::take(const RawEvent& event) {
  if (!config_.frames && std::holds_alternative<FrameCame>(event)) return;
  {
    const std::lock_guard lock(mutex_);
    if (!ended_.empty() || overrun_) return;
    overrun_ = waiting_bytes_ > kMostWaitingBytes;
    waiting_bytes_ += size_of(event);
    waiting_.push_back(event);
  }
  changed_.notify_one();
}

std::string Recorder::text() const {
  const std::lock_guard lock(mutex_);
  return ended_.empty() ? path_.string() : ended_;
}

void Recorder::run(const std::stop_token& stop) {
  DeviceTime synced = drivers::now();
  for (;;) {
    std::deque<RawEvent> events;
    bool late = false;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, stop, std::chrono::milliseconds(200), [this] { return !waiting_.empty(); });
      late = overrun_;
      events.swap(waiting_);
      waiting_bytes_ = 0;
    }
    for (const RawEvent& event : events) {
      if (!write(block_of(event))) return end(fmt::format("{}: ended, the disk takes no more", path_.string()));
    }
    if (late) return end(fmt::format("{}: ended, the disk is too slow for these frames", path_.string()));
    if (static_cast<double>(written_bytes_) > config_.most_gb * 1e9)
      return end(fmt::format("{}: ended at {:g} GB, see [record] most_gb", path_.string(), config_.most_gb));
    if (const DeviceTime now = drivers::now(); now - synced > kSyncEvery) {
      ::fdatasync(fd_);
      synced = now;
    }
    if (stop.stop_requested() && events.empty()) return;
  }
}

}  // namespace birdseye::device
