#include "host/bench/simulator_case.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <stdlib.h>

#include <fstream>

#include "drivers/system/child_process.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

Result<SimulatorCase> SimulatorCase::make(const std::vector<std::string>& options) {
  std::string name = fs::temp_directory_path() / "birdseye-bench-XXXXXX";
  if (::mkdtemp(name.data()) == nullptr)
    return Error{Errc::unreadable, fmt::format("{}: cannot be made; set TMPDIR to a folder with room", name)};
  SimulatorCase out{fs::path(name)};
  std::vector<std::string> command{(fs::read_symlink("/proc/self/exe").parent_path() / "birdseye-sim").string(), "case",
                                   "--out", out.folder().string()};
  command.insert(command.end(), options.begin(), options.end());
  const fs::path log = out.scratch_ / "log";
  auto child = ChildProcess::start(command, log);
  if (!child) return child.error();
  constexpr Duration kPatience = Duration::from_ms(600'000);
  constexpr int kRefused = 2;
  const auto code = child->wait(Deadline::after(kPatience));
  if (code == 0) return out;
  std::ifstream in(log);
  std::string line;
  std::getline(in, line);
  return Error{
      !code              ? Errc::timeout
      : code == kRefused ? Errc::bad_value
                         : Errc::unreadable,
      fmt::format("birdseye-sim case {}: {}", fmt::join(options, " "), code ? line : "not done in 10 minutes")};
}

SimulatorCase::~SimulatorCase() {
  std::error_code ignored;
  if (!scratch_.empty()) fs::remove_all(scratch_, ignored);
}

}  // namespace birdseye::host
