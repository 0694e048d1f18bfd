#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

struct FactorOptions {
  std::filesystem::path folder;   ///< must exist
  std::vector<std::string> only;  ///< names of classes; empty: all
  std::vector<std::string> optimisers{"geometry"};
  int trials = 20;  ///< of each class
  int first_seed = 1;
  std::string size = "768x576";  ///< of the views, px
  int jobs = 0;                  ///< cases at a time; 0: as many as there are cores
};

/// `birdseye bench register --factors`: one factor at a time, each class of cases with so many seeds, of which those
/// that the simulator refuses are passed over. Appends each trial to trials.jsonl as it ends; one that stands there is
/// not made again. At the end of each round over the classes it writes table.json, table.md and calibration.svg.
/// Refuses a class that there is not, naming those there are. With several jobs each case is registered on one core.
Result<void> factor_study(const FactorOptions& options);

}  // namespace birdseye::host
