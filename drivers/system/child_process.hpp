#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye {

/// A program we started and own: it is asked to end (SIGTERM), then made to (SIGKILL), when this goes out of scope.
class ChildProcess {
 public:
  enum class Pipe { none, stdin_to_child, stdout_from_child };
  /// Whether Ctrl-C in our terminal ends the child too, or leaves it to us to let it finish.
  enum class Signals { with_us, ours_alone };
  /// ours: the child's standard input is a pipe that the system closes when we end, in whatever way, so that a program
  /// that watches it (end_with_standard_input()) ends too. Not together with stdin_to_child.
  enum class Life { its_own, ours };

  /// command: program and arguments; its standard error goes to log (appended).
  static Result<ChildProcess> start(const std::vector<std::string>& command, const std::filesystem::path& log,
                                    Pipe pipe = Pipe::none, Signals signals = Signals::with_us,
                                    Life life = Life::its_own);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ~ChildProcess();

  /// The next whole line of the child's standard output; empty at the deadline; Errc::disconnected at its end.
  Result<std::optional<std::string>> read_line(Deadline deadline);
  /// So many bytes of the child's standard output, or fewer at its end. Errc::timeout at the deadline.
  Result<std::size_t> read(void* bytes, std::size_t size, Deadline deadline);
  /// All of bytes to the child's standard input, or why not.
  Result<void> write(const void* bytes, std::size_t size, Deadline deadline);
  /// Closes our end of the pipe: the child's input ends, or what it writes fails.
  void close_pipe();

  /// The exit code (128 + signal if it was killed); empty if it still runs at the deadline.
  std::optional<int> wait(Deadline deadline);
  void stop();
  /// Bounds the address space that the child may have from now on, as far as the system lets us. What it asks for
  /// beyond that it does not get.
  void bound_memory(std::uint64_t bytes);
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  ChildProcess(pid_t pid, UniqueFd fd, UniqueFd lifeline, std::string name)
      : pid_(pid), fd_(std::move(fd)), lifeline_(std::move(lifeline)), name_(std::move(name)) {}

  pid_t pid_ = -1;
  UniqueFd fd_;
  UniqueFd lifeline_;  ///< our end of a pipe that nothing goes through
  std::string name_;
  std::string buffer_;
  std::optional<int> exit_code_;
};

}  // namespace birdseye
