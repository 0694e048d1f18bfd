#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <cstddef>
#include <functional>
#include <optional>
#include <shared_mutex>
#include <stop_token>
#include <utility>

#include "calibration/base/result.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye {

/// While such an object lives, no copy of this process is made. Hold one while a thread works with a library that
/// copies use too: a copy would inherit that library's locks as they are, and no thread that releases them.
class CopiesHeldOff {
 public:
  CopiesHeldOff();

 private:
  std::shared_lock<std::shared_mutex> held_;
};

/// A copy of this process that does one piece of work and sends what comes of it through a pipe. Its output goes
/// nowhere, its input is empty, its death does not end this process, and it does not outlive the thread that made it,
/// or, where it listens, this process. It is killed when this goes out of scope.
class ProcessCopy {
 public:
  /// Sends bytes to the process that asked for the work.
  using Send = std::function<void(const void* data, std::size_t size)>;

  /// work: must not use threads of this process, and what it throws ends the copy. It may start further copies, which
  /// end with it.
  static Result<ProcessCopy> start(const std::function<void(const Send&)>& work);

  /// Takes the next bytes of give(). False: no more will come.
  using Take = std::function<bool(void* to, std::size_t size)>;
  /// The same for work that listens, and returns when nothing more comes.
  static Result<ProcessCopy> start_listening(const std::function<void(const Take&, const Send&)>& work);
  /// To work that listens. Errc::timeout: it had not taken all by the deadline. Errc::disconnected: it has ended.
  Result<void> give(const void* data, std::size_t size, Deadline deadline);

  ProcessCopy(ProcessCopy&& other) noexcept;
  ProcessCopy& operator=(ProcessCopy&&) = delete;
  ~ProcessCopy();

  /// The next `size` bytes that the work sends. Errc::timeout: they had not come by the deadline, and the copy has been
  /// killed. Errc::disconnected: it ended before, and how (the signal, by number and name); or stop was requested,
  /// which is seen within a twentieth of a second and kills it too.
  Result<void> receive(void* to, std::size_t size, Deadline deadline, const std::stop_token& stop = {});
  [[nodiscard]] pid_t pid() const { return process_; }
  /// The signal that ended it, as receive() or give() said; 0: none is known.
  [[nodiscard]] int ended_by() const { return ended_by_; }

 private:
  ProcessCopy(pid_t process, UniqueFd fd, UniqueFd to)
      : process_(process), maker_(::getpid()), fd_(std::move(fd)), to_(std::move(to)) {}
  static Result<ProcessCopy> start(const std::function<void(const Take&, const Send&)>& work, UniqueFd from,
                                   UniqueFd to);
  std::optional<int> kill();
  Error ended();

  pid_t process_, maker_;
  int ended_by_ = 0;
  UniqueFd fd_;  ///< what it sends
  UniqueFd to_;  ///< what it is given; none where it does not listen
};

}  // namespace birdseye
