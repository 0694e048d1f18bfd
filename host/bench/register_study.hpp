#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/bench/bench_trials.hpp"

namespace birdseye::host {

struct StudyOptions {
  std::filesystem::path folder;
  int trials = 8;  ///< random deformations of each condition
  std::vector<std::string> sweeps{"light", "noise", "views", "error"};
  SimulatedCase usual;  ///< what does not change
};

/// `birdseye bench register --study`: measures what is left of the error for every measure and light, and over noise,
/// number of views and initial error; with the sweep over light also curves of similarity through the truth. Writes
/// study.json, sweeps.svg and cost-curves.svg into the folder. Refused, before anything is measured, where one of these
/// is there that study.json does not list.
Result<void> register_study(const StudyOptions& options);

}  // namespace birdseye::host
