#pragma once

#include <filesystem>

#include "drivers/system/unique_fd.hpp"
#include "drivers/video/frame_source.hpp"
#include "drivers/video/pixel_format.hpp"
#include "drivers/video/pixel_pool.hpp"

namespace birdseye::drivers {

/// Frames from a program on this machine, over a Unix stream socket at which that program listens. Each frame is a
/// little-endian header of 64 bytes (docs/manual/frame-socket.md) and its pixels. The clock is this machine's
/// CLOCK_MONOTONIC.
class SocketCamera final : public FrameSource {
 public:
  static Result<std::unique_ptr<FrameSource>> open(const std::filesystem::path& path);
  Result<std::optional<Frame>> next(Deadline deadline) override;
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string describe() const override;
  [[nodiscard]] std::map<std::string, std::string> identity() const override { return {{"model", "a program"}}; }
  [[nodiscard]] FrameCounters counters() const override { return counters_; }

 private:
  SocketCamera(UniqueFd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}
  Result<bool> fill(std::vector<std::uint8_t>& buffer, std::size_t& have, Deadline deadline);
  Result<void> read_header();
  std::optional<Frame> finish();
  std::shared_ptr<const PixelPool::Pixels> to_pixels();
  void count_gap(std::uint64_t sequence);

  UniqueFd fd_;
  std::string name_;
  FrameCounters counters_;
  PixelPool pool_;
  // A frame that a deadline cut in two is completed at the next call.
  std::vector<std::uint8_t> header_;
  std::size_t header_have_ = 0, payload_have_ = 0;
  PixelLayout layout_;                          // as the header says, once it is whole
  std::unique_ptr<PixelPool::Pixels> payload_;  // null until then
  std::optional<std::uint64_t> last_sequence_;
};

}  // namespace birdseye::drivers
