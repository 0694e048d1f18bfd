#include "hw-sim/campaign/campaign.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calibration/record/sha256.hpp"
#include "drivers/system/child_process.hpp"
#include "hw-sim/campaign/children_folder.hpp"

namespace birdseye::hw_sim {

namespace {

/// The first digits of the SHA-256 of its file.
Result<std::string> build_of(const std::string& program) {
  constexpr std::size_t kDigits = 12;
  std::ifstream file(program, std::ios::binary);
  calibration::Sha256 hash;
  std::vector<char> bytes(std::size_t{1} << 16);
  do {
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    const auto count = static_cast<std::size_t>(file.gcount());
    hash.add({reinterpret_cast<const std::uint8_t*>(bytes.data()), count});
  } while (file);
  if (!file.eof()) return Error{Errc::unreadable, program + ": cannot be read; install birdseye-sim again"};
  return hash.hex().substr(0, kDigits);
}

/// An operation, told as one line.
std::vector<std::string> command_of(const std::string& seed, const StudiedOperations& operations,
                                    const std::string& program) {
  std::vector<std::string> out{program,     "--end-with-stdin",
                               "operation", "--line",
                               "--seed",    seed,
                               "--minutes", fmt::format("{}", operations.minutes)};
  if (operations.pictures) out.emplace_back("--pictures");
  return out;
}

}  // namespace

Result<SeedStudy> study_of_operations(const StudiedOperations& operations, const std::string& program) {
  const auto build = build_of(program);
  if (!build) return build.error();
  SeedStudy out;
  out.command = command_of("{}", operations, program);
  out.command.insert(out.command.end(), {"--cores", "1"});
  out.what = fmt::format("operations of {} minutes{}, build {}", operations.minutes,
                         operations.pictures ? " with pictures" : "", *build);
  out.file = "operations.sqlite";
  // For the slowest operation: a hundredth of its time is usual, and with pictures a tenth.
  out.patience = Duration::from_seconds(std::max(60.0, 60 * operations.minutes));
  out.kept = [minutes = operations.minutes](std::uint64_t seed,
                                            const Result<std::string>& given) -> Result<std::string> {
    const auto result = given ? result_of(*given) : Result<OperationResult>(given.error());
    if (result) return line_of(*result);
    OperationResult none;
    none.seed = seed;
    none.minutes = minutes;
    none.laws_broken = 1;
    none.broken = "result: " + result.error().what;
    return line_of(none);
  };
  out.told = "broke a law";
  out.tells = [](const std::string& line) {
    const auto result = result_of(line);
    return result && result->laws_broken > 0;
  };
  return out;
}

Result<std::string> shortest_script_of(std::uint64_t seed, const StudiedOperations& operations,
                                       const std::string& program, const std::filesystem::path& log,
                                       Duration patience) {
  std::vector<std::string> command = command_of(std::to_string(seed), operations, program);
  command.emplace_back("--shortest");
  const auto temporary = ChildrenFolder::make();
  if (!temporary) return temporary.error();
  auto child = ChildProcess::start(command, log, ChildProcess::Pipe::stdout_from_child, ChildProcess::Signals::with_us,
                                   ChildProcess::Life::ours);
  if (!child) return child.error();
  const Deadline deadline = Deadline::after(patience);
  std::string script;
  bool is_script = false;  // the first line is the operation's result
  for (auto line = child->read_line(deadline);; line = child->read_line(deadline)) {
    if (line && !*line) return Error{Errc::timeout, fmt::format("none was found within {:.0f} s", patience.seconds())};
    if (!line) break;
    if (is_script) script += **line + "\n";
    is_script = true;
  }
  if (script.empty())
    return Error{Errc::degenerate, fmt::format("the operation ended without one; {} may say why", log.string())};
  return script;
}

SeedStudy study_of(const std::vector<std::string>& command, Duration patience) {
  SeedStudy out;
  out.command = command;
  out.what = fmt::format("{}", fmt::join(command, " "));
  out.file = "results.sqlite";
  out.patience = patience;
  out.kept = [](std::uint64_t, const Result<std::string>& given) -> Result<std::string> {
    if (given && !nlohmann::json::accept(*given)) return Error{Errc::bad_format, "is no JSON: " + *given};
    return given;
  };
  return out;
}

}  // namespace birdseye::hw_sim
