#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/system/clock.hpp"

namespace birdseye::vm {

/// A program of its own that takes lines and gives lines. Ends with this object, or with this program however that
/// ends.
class Process {
 public:
  /// log: where its standard error goes.
  Process(const std::vector<std::string>& command, const std::filesystem::path& log);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(const std::string& line) const;
  /// Reads lines until one holds `text`, which it returns; empty when the deadline or the end comes first.
  std::string wait_for(const std::string& text, Deadline deadline);
  /// The exit code, waiting for it until the deadline; -1 then.
  int wait(Deadline deadline);

 private:
  pid_t pid_ = -1;
  int in_ = -1, out_ = -1;
  int code_ = -1;
  std::string text_;
};

}  // namespace birdseye::vm
