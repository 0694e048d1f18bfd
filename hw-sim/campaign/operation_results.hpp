#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "hw-sim/campaign/seed_results.hpp"

namespace birdseye::hw_sim {

/// What came of one operation, or of many, as one line of JSON says it.
struct OperationResult {
  std::uint64_t seed = 0;
  double minutes = 0;
  std::uint64_t laws_broken = 0, faults = 0, faults_alone = 0, poses = 0, frames = 0, shown = 0, overlaid = 0,
                green = 0, judged = 0, beyond = 0, registrations = 0, deformations = 0, checks = 0, moved = 0,
                moved_unwatched = 0, recordings = 0, found_again = 0;
  double worst_pose = 0, worst_age_ms = 0, worst_circles = 0, slowest_named_s = 0, slowest_over_s = 0;
  /// By target and kind.
  struct OfFault {
    std::uint64_t befell = 0, judged = 0;
    double slowest_named_s = 0, slowest_over_s = 0;
  };
  std::map<std::string, OfFault> by_fault;
  std::uint64_t operations = 1;               ///< so many are summed up
  std::string broken;                         ///< in words, a line for each
  std::optional<std::uint64_t> first_broken;  ///< of many: the first seed whose operation broke a law
  bool laws_untold = false;  ///< laws_broken is the least: an operation may have broken more laws than it tells
  std::string hash;
};
/// An operation tells of no more broken laws than so many.
constexpr std::uint64_t kMostLawsTold = 100;

std::string line_of(const OperationResult& result);
/// Refuses what is no such line.
Result<OperationResult> result_of(const std::string& line);
/// Of the seeds from first to last: figures added up, the worst of what is worst, and what was broken.
Result<OperationResult> sum_of(const SeedResults& results, std::uint64_t first, std::uint64_t last);

/// For people: how soon faults were named and over, where any was judged, and how many laws were broken.
std::string words_of_faults(const OperationResult& result);
std::string words_of_laws(const OperationResult& result);
/// A line for each kind of fault: how often it befell and was judged, and how long it took at the most until it was
/// named and, from its own end, over.
std::string words_by_fault(const OperationResult& result);

}  // namespace birdseye::hw_sim
