#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/time/clock.hpp"

namespace birdseye::device {

/// What one run leaves for the next, in case it ends badly.
struct RunMemory {
  std::int64_t began_ns = 0;          ///< on the device's clock, which begins anew only with the machine
  std::vector<std::string> ended_by;  ///< the parts that ended the runs before it, of those that were soon over
  std::vector<std::string> left_out;  ///< the parts that this run does without
  bool operator==(const RunMemory&) const = default;
};

/// What the next run is to know after one that ended badly by that part; empty: nobody knows by which.
RunMemory after_bad_end(RunMemory run, const std::string& by, DeviceTime now);
std::string text_of(const RunMemory& run);
/// None where the text is not whole.
std::optional<RunMemory> parse_run_memory(const std::string& text);

/// Whether runs end badly again and again, and what this one does without for that: a part that has ended three runs,
/// each within two minutes of its start. Forgotten when a run ends in order, and when the machine starts anew.
class SafeMode {
 public:
  /// folder: stays from one run to the next; empty: nothing is remembered and nothing left out.
  static SafeMode begin(const std::filesystem::path& folder);

  [[nodiscard]] const std::vector<std::string>& left_out() const { return left_out_; }
  /// The part that hangs now, for which the process may be ended; empty: none.
  void note_hang(const std::string& part);
  void end_in_order();

 private:
  std::filesystem::path memory_;  ///< empty: none is kept
  std::vector<std::string> left_out_;
  std::string hangs_;
};

/// Why a part is left out, for those who see that it is not there.
std::string why_left_out(const std::string& part);

}  // namespace birdseye::device
