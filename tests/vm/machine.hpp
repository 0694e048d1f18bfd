#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "tests/vm/process.hpp"

namespace birdseye::vm {

struct Answer {
  int code = -1;       ///< of the shell; -1 when the machine did not answer
  std::string output;  ///< standard output and standard error
};

/// The one virtual machine of a run (hw-sim/vm), with the tracker's adapter plugged in from outside.
class Machine {
 public:
  /// Boots it, three times at most; out: the folder that the guest has as /run/out. Fails the test where it does not
  /// come up.
  explicit Machine(const std::filesystem::path& out);
  ~Machine();
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  [[nodiscard]] bool up() const { return control_ >= 0; }
  /// Runs a line of shell in the guest, in the tree, with hw-sim/vm/guest.sh at hand.
  Answer run(const std::string& command, Duration patience = Duration::from_ms(20'000));
  /// The same; a code other than 0 fails the test.
  std::string must(const std::string& command, Duration patience = Duration::from_ms(20'000));

  [[nodiscard]] const std::filesystem::path& out() const { return out_; }
  /// On 127.0.0.1, forwarded to kGuestPort of the guest.
  [[nodiscard]] int port() const { return port_; }
  static constexpr int kGuestPort = 18944;
  /// The adapter, to be commanded (birdseye-sim ft232r).
  Process& adapter() { return *adapter_; }
  static constexpr const char* kAdapterSerial = "CART0001";

 private:
  bool boots();
  bool read_until(std::size_t size, Deadline deadline);
  std::string read_line(Deadline deadline);

  std::filesystem::path out_;
  int port_ = 0;
  int control_ = -1;
  std::string buffer_;
  std::unique_ptr<Process> qemu_, adapter_;
};

}  // namespace birdseye::vm
