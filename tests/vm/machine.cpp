#include "tests/vm/machine.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "drivers/system/local_programs.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/programs_folder.hpp"

namespace birdseye::vm {

namespace {

constexpr Duration kBootPatience = Duration::from_ms(60'000);

/// -1 while nobody listens.
int connect_to(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = path.string();
  if (name.size() >= sizeof address.sun_path) return -1;
  std::copy(name.begin(), name.end(), address.sun_path);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  ::close(fd);
  return -1;
}

std::vector<std::string> qemu_command(const std::filesystem::path& out, int port) {
  const auto channel = [&](const std::string& name) {
    return fmt::format("socket,id={},path={}/{}.sock,server=on,wait=off", name, out.string(), name);
  };
  return {"hw-sim/vm/vm.sh",
          out.string(),
          "hw-sim/vm/agent.sh",
          "-device",
          "virtio-serial-pci",
          "-chardev",
          channel("control"),
          "-device",
          "virtserialport,chardev=control,name=birdseye.control",
          "-device",
          "qemu-xhci",
          "-chardev",
          channel("adapter"),
          "-device",
          "usb-redir,chardev=adapter",
          "-netdev",
          fmt::format("user,id=net,restrict=on,hostfwd=tcp:127.0.0.1:{}-:{}", port, Machine::kGuestPort),
          "-device",
          "virtio-net-pci,netdev=net,romfile="};
}

}  // namespace

// An emulated kernel hangs now and then while it boots, where the machine under it is busy: no test has begun then.
Machine::Machine(const std::filesystem::path& out) : out_(out), port_(*free_port()) {
  constexpr int kBoots = 3;
  for (int boot = 1; boot <= kBoots; ++boot) {
    if (boots()) return;
    const std::filesystem::path kept = fmt::format("{}-boot-{}", out_.string(), boot);
    std::filesystem::remove_all(kept);
    std::filesystem::copy(out_, kept, std::filesystem::copy_options::skip_symlinks);
    fmt::print("booted again: the virtual machine did not come up; see {}/*.log\n", kept.string());
  }
  ADD_FAILURE() << "the virtual machine does not come up; see " << out_ << "/*.log";
}

bool Machine::boots() {
  adapter_.reset();
  qemu_.reset();
  buffer_.clear();
  std::filesystem::remove_all(out_);
  std::filesystem::create_directories(out_);
  qemu_ = std::make_unique<Process>(qemu_command(out_, port_), out_ / "qemu.log");
  const auto deadline = Deadline::after(kBootPatience);
  while ((control_ = connect_to(out_ / "control.sock")) < 0 && !deadline.passed() && qemu_->wait(device_now()) < 0) {
    sleep_for(Duration::from_ms(20));
  }
  // An emulated processor stops now and then for longer than the chip's own fifo lasts.
  adapter_ = std::make_unique<Process>(
      std::vector<std::string>{testing::programs_folder() + "/birdseye-sim", "ft232r", "--unix",
                               (out_ / "adapter.sock").string(), "--serial", kAdapterSerial, "--receive-fifo", "4096"},
      out_ / "adapter.log");
  if (control_ >= 0 && read_line(deadline) == "ready") return true;
  if (control_ >= 0) ::close(control_);
  control_ = -1;
  return false;
}

Machine::~Machine() {
  if (control_ < 0) return;
  const std::string off = "off\n";
  (void)!::write(control_, off.data(), off.size());
  EXPECT_EQ(qemu_->wait(Deadline::after(Duration::from_ms(20'000))), 0)
      << "the virtual machine does not switch off; see " << out_;
  ::close(control_);
}

bool Machine::read_until(std::size_t size, Deadline deadline) {
  while (buffer_.size() < size) {
    if (deadline.passed() || wait_ready(control_, POLLIN, deadline) == 0) return false;
    std::array<char, 4096> chunk;
    const ssize_t got = ::read(control_, chunk.data(), chunk.size());
    if (got <= 0) return false;
    buffer_.append(chunk.data(), static_cast<std::size_t>(got));
  }
  return true;
}

std::string Machine::read_line(Deadline deadline) {
  std::size_t end = 0;
  while ((end = buffer_.find('\n')) == std::string::npos) {
    if (!read_until(buffer_.size() + 1, deadline)) return {};
  }
  std::string line = buffer_.substr(0, end);
  buffer_.erase(0, end + 1);
  return line;
}

Answer Machine::run(const std::string& command, Duration patience) {
  if (!up()) return {};
  const std::string line = command + "\n";
  (void)!::write(control_, line.data(), line.size());
  const auto deadline = Deadline::after(patience);
  Answer answer;
  std::size_t size = 0;
  if (std::sscanf(read_line(deadline).c_str(), "%d %zu", &answer.code, &size) != 2 || !read_until(size, deadline)) {
    // Whatever it says later would be taken for the answer to something else.
    ::close(control_);
    control_ = -1;
    return {};
  }
  answer.output = buffer_.substr(0, size);
  buffer_.erase(0, size);
  return answer;
}

std::string Machine::must(const std::string& command, Duration patience) {
  const Answer answer = run(command, patience);
  EXPECT_EQ(answer.code, 0) << command << "\n" << answer.output;
  return answer.output;
}

}  // namespace birdseye::vm
