#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "hw-sim/campaign/operation_results.hpp"

namespace birdseye::hw_sim {

struct CampaignSettings {
  std::uint64_t first_seed = 1, last_seed = 1;
  double minutes = 10;              ///< of each operation
  std::filesystem::path folder;     ///< gets operations.sqlite
  int jobs = 0;                     ///< operations at a time; 0: as many as there are cores
  std::optional<double> at_most_s;  ///< no operation begins after so long; empty: all seeds are run
  std::string program;              ///< of this name; it knows `operation --line`
};

/// Runs the operation of each seed that the folder has no result of, each in a process of its own, handed out by need.
/// said: told from time to time how far it is. Gives the sum over all seeds. One that ends without a result counts as
/// one that broke a law. A campaign that was ended goes on where it is started again.
Result<OperationResult> run_campaign(const CampaignSettings& settings,
                                     const std::function<void(const std::string&)>& said);

}  // namespace birdseye::hw_sim
