#include "hw-sim/campaign/campaign.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace birdseye::hw_sim {

SeedStudy study_of_operations(const StudiedOperations& operations, const std::string& program) {
  SeedStudy out;
  out.command = {program,     "--end-with-stdin",
                 "operation", "--line",
                 "--seed",    "{}",
                 "--minutes", fmt::format("{}", operations.minutes),
                 "--cores",   "1"};
  if (operations.pictures) out.command.emplace_back("--pictures");
  out.what = fmt::format("operations of {} minutes{}", operations.minutes, operations.pictures ? " with pictures" : "");
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
