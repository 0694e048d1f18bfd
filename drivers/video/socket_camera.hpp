#pragma once

#include <filesystem>

#include "drivers/io/unique_fd.hpp"
#include "drivers/video/frame_source.hpp"

namespace birdseye::drivers {

/// Frames from a program on this machine, over a Unix stream socket that it listens at. Each is a little-endian header
/// of 64 bytes (docs/manual/frame-socket.md) and its pixels. The clock is this machine's CLOCK_MONOTONIC.
class SocketCamera final : public FrameSource {
 public:
  static Result<std::unique_ptr<FrameSource>> open(const std::filesystem::path& path);
  Result<std::optional<Frame>> next(DeviceTime deadline) override;
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string describe() const override;
  [[nodiscard]] FrameCounters counters() const override { return counters_; }

 private:
  SocketCamera(UniqueFd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}
  Result<bool> fill(std::vector<std::uint8_t>& buffer, std::size_t& have, DeviceTime deadline);

  UniqueFd fd_;
  std::string name_;
  FrameCounters counters_;
  std::vector<std::uint8_t> header_, pixels_;  // a frame that the deadline cut is gone on with at the next call
  std::size_t header_have_ = 0, pixels_have_ = 0;
};

}  // namespace birdseye::drivers
