#pragma once

#include <filesystem>
#include <string>

#include "calibration/base/result.hpp"

namespace birdseye {

/// Names the calling thread, for `top -H` and debuggers, and says that it is at work on a part of that name. A literal
/// of at most 15 characters.
void name_this_thread(const char* name);
/// What the calling thread is at work on from now on, as a crash would note it; null: nothing in particular. A literal.
void at_work_on(const char* part);

/// Has a crash write what its thread was at work on to a file, before the process ends as it would have: by SIGSEGV,
/// SIGBUS, SIGFPE, SIGILL, or abort(). A signal that was sent to the whole process is nobody's and notes nothing. One a
/// program.
class CrashNote {
 public:
  /// Empties the file.
  static Result<void> keep_in(const std::filesystem::path& file);
  /// Notes that instead, as of a part that hangs and will be ended for it; empty: nothing hangs.
  static void write(const std::string& part);
  /// What a process that ended has noted; empty: nothing.
  static std::string read(const std::filesystem::path& file);
};

}  // namespace birdseye
