#include "host/doctor/program_output.hpp"

#include <fmt/format.h>

#include "drivers/system/child_process.hpp"

namespace birdseye::host {

Result<ProgramOutput> output_of(const std::vector<std::string>& command, Deadline deadline) {
  constexpr std::size_t kMostLines = 200;
  constexpr int kNoSuchProgram = 127;  // the shell's
  std::vector<std::string> joined{"/bin/sh", "-c", "exec \"$0\" \"$@\" 2>&1"};
  joined.insert(joined.end(), command.begin(), command.end());
  auto child = ChildProcess::start(joined, "/dev/null", ChildProcess::Pipe::stdout_from_child);
  if (!child) return child.error();
  ProgramOutput output;
  for (;;) {
    const auto line = child->read_line(deadline);
    if (!line) break;  // its end
    if (!*line) return Error{Errc::timeout, fmt::format("{}: does not end", command.front())};
    if (output.lines.size() < kMostLines) output.lines.push_back(**line);
  }
  const auto code = child->wait(deadline);
  if (!code) return Error{Errc::timeout, fmt::format("{}: does not end", command.front())};
  if (*code == kNoSuchProgram) return Error{Errc::not_found, fmt::format("{}: is not installed", command.front())};
  output.code = *code;
  return output;
}

}  // namespace birdseye::host
