#include "host/confine/run_confined_to.hpp"

#include <signal.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "drivers/system/machine_time.hpp"
#include "host/confine/confinement.hpp"

namespace birdseye::host {

namespace {

constexpr std::uint32_t kLongestFault = 1 << 12;

/// What the process sends before what its work does: how it is confined, or why it is not, whose words follow.
struct Start {
  bool files = false;
  std::uint32_t fault_bytes = 0;
};

std::vector<ProcessCopy> start_copies(const ConfinedCopies& copies) {
  std::vector<ProcessCopy> started;
  for (int i = 0; i < copies.count; ++i) {
    auto copy = ProcessCopy::start_listening([&copies](const ProcessCopy::Take& take, const ProcessCopy::Send& send) {
      if (confine_copy()) copies.work(take, send);
    });
    if (!copy) break;  // fewer do
    started.push_back(*std::move(copy));
  }
  return started;
}

/// True where it may go on.
bool send_start(const Send& send, const Result<Confinement>& confined) {
  if (confined) {
    const Start start{.files = confined->files};
    send(&start, sizeof start);
    return true;
  }
  const std::string& what = confined.error().what;
  const Start start{.fault_bytes = static_cast<std::uint32_t>(std::min<std::size_t>(what.size(), kLongestFault))};
  send(&start, sizeof start);
  send(what.data(), start.fault_bytes);
  return false;
}

void say_that_files_are_open() {
  static std::atomic_flag said;
  if (said.test_and_set()) return;
  std::fputs(
      "birdseye: note: this kernel has no Landlock, so the decoder of a damaged file could read what this user can; "
      "run a kernel with Landlock, as Debian's, or read only files that you trust\n",
      stderr);
}

}  // namespace

Result<void> run_confined_to(const std::filesystem::path& input, const ConfinedCopies& copies,
                             const std::function<void(const Send&, std::vector<ProcessCopy>&)>& work,
                             const std::function<void(const Receive&)>& take, Duration silence,
                             const std::stop_token& stop) {
  const MachineTime in_the_machines_time;
  auto copy = ProcessCopy::start([&](const Send& send) {
    std::vector<ProcessCopy> made;
    const auto confined = confine_to(input, [&] { made = start_copies(copies); });
    if (send_start(send, confined)) work(send, made);
  });
  if (!copy) return std::move(copy).error();
  Result<void> received;
  const Receive receive = [&](void* to, std::size_t size) {
    if (received) received = copy->receive(to, size, Deadline::after(silence), stop);
    return received.has_value();
  };
  Start start;
  if (receive(&start, sizeof start)) {
    if (start.fault_bytes > 0) {
      std::string fault(std::min(start.fault_bytes, kLongestFault), ' ');
      if (receive(fault.data(), fault.size())) return Error{Errc::io, std::move(fault)};
    } else {
      if (!start.files) say_that_files_are_open();
      take(receive);
    }
  }
  if (!received) return how_it_ended(*copy, received.error());
  return {};
}

Error how_it_ended(const ProcessCopy& copy, Error told) {
  constexpr const char* kLonger = "took longer than a file of its size justifies";
  if (copy.ended_by() == SIGXCPU) return {Errc::unsupported, std::string(kLonger) + ": it " + told.what};
  if (copy.ended_by() == SIGKILL)
    return {Errc::unsupported, std::string(kLonger) + ", or more memory than there is: it " + told.what};
  return told;
}

}  // namespace birdseye::host
