#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::hw_sim {

/// What came of one seed, as one line of JSON.
struct SeedLine {
  std::uint64_t seed = 0;
  std::string line;
};

/// Results by seed, in one SQLite file that several programs may look at.
class SeedResults {
 public:
  /// Opens the file, or makes it. what: of what the results are, in words; a file of anything else is refused, and so
  /// is a damaged file.
  static Result<std::unique_ptr<SeedResults>> open(const std::filesystem::path& file, const std::string& what);
  ~SeedResults();
  SeedResults(const SeedResults&) = delete;
  SeedResults& operator=(const SeedResults&) = delete;

  /// In place of what was known of these seeds: all of them or, with an error, none. They are on the disk once this
  /// returns.
  Result<void> enter(const std::vector<SeedLine>& lines);
  [[nodiscard]] Result<std::set<std::uint64_t>> seeds() const;
  /// Of the seeds from first to last, in this order; ends with the first error of `each`.
  Result<void> for_each(std::uint64_t first, std::uint64_t last,
                        const std::function<Result<void>(const SeedLine&)>& each) const;

 private:
  struct Database;
  explicit SeedResults(std::unique_ptr<Database> database);
  std::unique_ptr<Database> database_;
};

}  // namespace birdseye::hw_sim
