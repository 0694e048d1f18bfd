#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/e2e/fault_rig.hpp"

namespace birdseye::testing {

/// Something that the wire must say of a fault.
struct Sign {
  enum class Where {
    status,   ///< STATUS, not OK, with these words
    doubt,    ///< a Doubt with these words
    refused,  ///< a frame without a pose, for this reason
    counter,  ///< this of Health has grown
    frame,    ///< words for what is seen at frames, by a check of its own
  };
  Where where;
  std::string words;
  std::function<bool(const wire::VideoFrame&)> check = {};
};

/// One kind of fault and what must be seen of it.
struct FaultCase {
  std::string name;
  std::string parameters = {};  ///< as in a script, "chance = 0.3, for_s = 0.5"
  double for_s = 0.5;
  double calm_s = 2;  ///< from its end to the next one
  std::vector<Sign> signs = {};
  std::string note = {};    ///< for the table
  double own_s = 0;         ///< that the unit needs for itself once the fault is over
  double extra_mm = 0;      ///< by which a pose may be off: what is plausible is not seen
  double extra_time_s = 0;  ///< a time that is wrong by so much, which nobody can know
  bool poses_lie = false;   ///< a fault that nobody can see
};

/// A line of the table. What was measured is empty where it says nothing.
struct FaultRow {
  std::string fault, how, seen;
  std::optional<double> worst_mm, promised_mm;  ///< the published pose that came nearest to breaking its promise
  std::optional<double> recovery_s, others_percent;
  std::vector<std::string> slow;  ///< complaints that may be of the machine
};

std::string script_of(const std::vector<FaultCase>& cases, double first_s, const std::string& of);
std::string text_of(const std::vector<Sign>& signs, const std::string& note);

/// Did the machine stand still, by what was said until until_ns? Then a complaint may be of the machine.
bool stood_still(const std::vector<Seen>& seen, const FaultSpan& span, std::int64_t until_ns, bool of_tracker);

/// Holds what was said while a fault lasted, and after it until until_ns, against what must be; complaints go to
/// problems, those about how long things took to the row's.
FaultRow judge(const FaultCase& fault, const FaultSpan& span, std::int64_t until_ns, bool of_tracker,
               std::int64_t circle_zero_ns, const std::vector<Seen>& seen, std::vector<std::string>& problems);

}  // namespace birdseye::testing
