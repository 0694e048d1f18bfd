#include "hw-sim/minibird/endpoint.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <functional>
#include <optional>
#include <utility>

#include "drivers/system/unique_fd.hpp"
#include "drivers/system/wait.hpp"
#include "hw-sim/base/listener.hpp"
#include "hw-sim/minibird/pseudo_terminal.hpp"

namespace birdseye::hw_sim {

namespace {

class Terminal final : public Endpoint {
 public:
  Terminal(PseudoTerminal terminal, std::string name) : name_(std::move(name)) {
    terminal_.emplace(std::move(terminal));
  }

  std::vector<std::uint8_t> read() override { return terminal_ ? terminal_->read() : std::vector<std::uint8_t>{}; }
  void write(std::span<const std::uint8_t> bytes) override {
    if (terminal_) terminal_->write(bytes);
  }
  [[nodiscard]] bool connected() const override { return terminal_.has_value(); }
  void wait(std::int64_t until_ns) override {
    wait_ready(terminal_ ? terminal_->fd() : -1, POLLIN, DeviceTime{until_ns});
  }
  void unplug() override { terminal_.reset(); }
  Result<void> replug() override {
    auto terminal = PseudoTerminal::open(name_);
    if (!terminal) return terminal.error();
    terminal_.emplace(*std::move(terminal));
    return {};
  }
  [[nodiscard]] const std::string& name() const override { return name_; }

 private:
  std::optional<PseudoTerminal> terminal_;
  std::string name_;
};

/// A listening socket of either family and the one host that it talks to.
class Socket final : public Endpoint {
 public:
  using Listen = std::function<Result<UniqueFd>()>;
  Socket(UniqueFd listener, std::string name, Listen listen, std::string path)
      : listener_(std::move(listener)), name_(std::move(name)), listen_(std::move(listen)), path_(std::move(path)) {}
  ~Socket() override { remove_path(); }

  std::vector<std::uint8_t> read() override {
    if (!host_ && listener_) {
      host_ = UniqueFd(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      const int yes = 1;
      if (host_) ::setsockopt(host_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);  // fails for a Unix socket
    }
    if (!host_) return {};
    std::array<std::uint8_t, 512> chunk;
    const ssize_t got = ::recv(host_.get(), chunk.data(), chunk.size(), 0);
    if (got > 0) return {chunk.begin(), chunk.begin() + got};
    if (got == 0 || (errno != EAGAIN && errno != EINTR)) host_ = UniqueFd();
    return {};
  }
  void write(std::span<const std::uint8_t> bytes) override {
    while (host_ && !bytes.empty()) {
      const ssize_t put = ::send(host_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (put > 0) {
        bytes = bytes.subspan(static_cast<std::size_t>(put));
      } else if (errno == EAGAIN) {
        return;
      } else if (errno != EINTR) {
        host_ = UniqueFd();
      }
    }
  }
  [[nodiscard]] bool connected() const override { return static_cast<bool>(host_); }
  void wait(std::int64_t until_ns) override {
    wait_ready(host_ ? host_.get() : listener_.get(), POLLIN, DeviceTime{until_ns});
  }
  void unplug() override {
    host_ = UniqueFd();
    listener_ = UniqueFd();
    remove_path();
  }
  Result<void> replug() override {
    auto listener = listen_();
    if (!listener) return listener.error();
    listener_ = *std::move(listener);
    return {};
  }
  [[nodiscard]] const std::string& name() const override { return name_; }

 private:
  void remove_path() const {
    if (!path_.empty()) ::unlink(path_.c_str());
  }

  UniqueFd listener_, host_;
  std::string name_;
  Listen listen_;
  std::string path_;  ///< of a Unix socket; empty for TCP
};

}  // namespace

Result<std::unique_ptr<Endpoint>> open_terminal(const std::filesystem::path& link) {
  auto terminal = PseudoTerminal::open(link);
  if (!terminal) return std::move(terminal).error();
  return std::unique_ptr<Endpoint>(std::make_unique<Terminal>(*std::move(terminal), link.string()));
}

Result<std::unique_ptr<Endpoint>> listen_tcp(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  const std::string host = colon == std::string::npos ? "127.0.0.1" : address.substr(0, colon);
  const std::string digits = colon == std::string::npos ? address : address.substr(colon + 1);
  int port = -1;
  const auto [end, failed] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (failed != std::errc{} || end != digits.data() + digits.size() || port < 0 || port > 65535) {
    return Error{Errc::bad_value, fmt::format("--tcp {}: give [HOST:]PORT with a port of 0 to 65535", address)};
  }
  auto listener = listen_at_port(host, port);
  if (!listener) return listener.error();
  const auto again = [host, port] {
    int same = port;
    return listen_at_port(host, same);
  };
  return std::unique_ptr<Endpoint>(
      std::make_unique<Socket>(*std::move(listener), fmt::format("{}:{}", host, port), again, ""));
}

Result<std::unique_ptr<Endpoint>> listen_unix(const std::filesystem::path& path) {
  auto listener = listen_at_path(path);
  if (!listener) return listener.error();
  return std::unique_ptr<Endpoint>(std::make_unique<Socket>(
      *std::move(listener), path.string(), [path] { return listen_at_path(path); }, path.string()));
}

}  // namespace birdseye::hw_sim
