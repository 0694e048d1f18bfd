#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "drivers/io/byte_stream.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::drivers {

/// A line behind a socket: a serial server's port in raw mode, or a program on this machine. It has no RTS.
class SocketLine final : public ByteStream {
 public:
  /// host: a name or an address. A peer that dies without a word is seen to be gone within kDeadPeer.
  static Result<std::unique_ptr<SocketLine>> connect_tcp(const std::string& host, std::uint16_t port,
                                                         Deadline deadline);
  static Result<std::unique_ptr<SocketLine>> connect_unix(const std::filesystem::path& path, Deadline deadline);
  static constexpr Duration kDeadPeer = Duration::from_ms(5000);

  Result<std::size_t> read(std::span<std::uint8_t> into, Deadline deadline) override;
  Result<void> write(std::span<const std::uint8_t> bytes, Deadline deadline) override;
  void discard_input() override;
  bool set_rts(bool /*asserted*/) override { return false; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string describe() const override;

 private:
  SocketLine(UniqueFd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}
  [[nodiscard]] Error gone(int failed) const;

  UniqueFd fd_;
  std::string name_;
};

}  // namespace birdseye::drivers
