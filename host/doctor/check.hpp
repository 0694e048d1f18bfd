#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace birdseye::host {

/// How the thing that was looked at stands.
enum class CheckState {
  good,
  could_be_better,  ///< it works; what to do makes it work better
  missing,          ///< it is not there, and nobody said that it should be
  bad,              ///< it is needed or was named, and does not work
  not_known,        ///< it could not be found out
};

/// As people read it: "could be better".
const char* name_of(CheckState state);

/// What was found of one thing, and what to do about it.
struct Check {
  std::string area, name;
  CheckState state = CheckState::not_known;
  std::string found;
  std::string remedy;  ///< empty where nothing is to be done
  /// What the people in the operating room read instead: how it stands and what they do. Empty where no window shows
  /// it.
  std::string in_the_room = {};
};

bool any_bad(const std::vector<Check>& checks);
/// For people: a line, and below it what to do, where that is anything.
std::string lines_of(const Check& check);
/// "3 good, 1 missing"
std::string sum_of(const std::vector<Check>& checks);
nlohmann::json check_json(const std::vector<Check>& checks);

}  // namespace birdseye::host
