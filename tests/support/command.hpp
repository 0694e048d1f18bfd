#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/programs_folder.hpp"

namespace birdseye::testing {

struct CommandResult {
  int code = -1;
  std::string output;  ///< standard output and standard error
};

/// Runs one of our programs through the shell and waits for it. within: what the shell sets up for it, as
/// "env NAME=value" or "xvfb-run -a".
inline CommandResult run(const std::string& program, const std::string& arguments, const std::string& within = {}) {
  const std::string line =
      within + " " BIRDSEYE_EMULATOR " " + programs_folder() + "/" + program + " " + arguments + " 2>&1";
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

/// Exit code 2, one line on standard error that says what and names where, and no file left behind.
inline void expect_refused(const std::string& program, const std::string& arguments,
                           const std::vector<std::string>& words, const std::filesystem::path& not_written = {},
                           const std::string& within = {}) {
  const auto result = run(program, arguments, within);
  EXPECT_EQ(result.code, 2) << arguments << "\n" << result.output;
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  EXPECT_EQ(result.output.find(program + ": "), 0U) << result.output;
  for (const std::string& word : words)
    EXPECT_NE(result.output.find(word), std::string::npos) << word << "\n" << result.output;
  if (!not_written.empty()) {
    EXPECT_FALSE(std::filesystem::exists(not_written)) << not_written;
  }
}

}  // namespace birdseye::testing
