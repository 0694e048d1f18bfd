#pragma once

#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>

namespace birdseye::testing {

struct CommandResult {
  int code = -1;
  std::string output;  ///< standard output and standard error
};

/// Runs one of our programs through the shell and waits for it.
inline CommandResult run(const std::string& program, const std::string& arguments) {
  const std::string line = std::string(BIRDSEYE_BIN) + "/" + program + " " + arguments + " 2>&1";
  CommandResult result;
  std::FILE* pipe = ::popen(line.c_str(), "r");
  if (pipe == nullptr) return result;
  std::array<char, 4096> chunk;
  while (const std::size_t got = std::fread(chunk.data(), 1, chunk.size(), pipe))
    result.output.append(chunk.data(), got);
  const int status = ::pclose(pipe);
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  return result;
}

}  // namespace birdseye::testing
