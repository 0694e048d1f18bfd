#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include "calibration/base/result.hpp"

namespace birdseye::hw_sim {

/// What came of one operation, or of many, as one line of JSON says it.
struct OperationResult {
  std::uint64_t seed = 0;
  double minutes = 0;
  std::uint64_t laws_broken = 0, faults = 0, faults_alone = 0, poses = 0, frames = 0, shown = 0, overlaid = 0,
                green = 0, beyond = 0, registrations = 0, checks = 0;
  double worst_pose = 0, worst_age_ms = 0, worst_circles = 0, slowest_named_s = 0, slowest_over_s = 0;
  std::string broken;  ///< in words, a line for each
  std::string hash;
};
std::string line_of(const OperationResult& result);
/// Refuses what is no such line.
Result<OperationResult> result_of(const std::string& line);

/// The results of a campaign by seed, in one SQLite file that several programs may look at.
class OperationResults {
 public:
  /// Opens the file, or makes it. Refuses one of operations of another length.
  static Result<std::unique_ptr<OperationResults>> open(const std::filesystem::path& file, double minutes);
  ~OperationResults();
  OperationResults(const OperationResults&) = delete;
  OperationResults& operator=(const OperationResults&) = delete;

  /// In place of what was known of the seed. It is on the disk once this returns.
  Result<void> enter(const OperationResult& result);
  [[nodiscard]] Result<std::set<std::uint64_t>> seeds() const;
  /// Of the seeds from first to last: figures added up, the worst of what is worst, and what was broken.
  [[nodiscard]] Result<OperationResult> sum(std::uint64_t first, std::uint64_t last) const;

 private:
  struct Database;
  explicit OperationResults(std::unique_ptr<Database> database);
  std::unique_ptr<Database> database_;
};

}  // namespace birdseye::hw_sim
