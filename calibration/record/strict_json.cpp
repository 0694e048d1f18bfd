#include "calibration/record/strict_json.hpp"

#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "calibration/base/nesting.hpp"

namespace birdseye::calibration {

bool is_strict_json(const std::string& text) {
  if (text.find('\0') != std::string::npos || nests_too_deeply(text, Notation::json)) return false;
  using Json = nlohmann::json;
  std::vector<std::set<std::string>> names;  // of the objects that are open
  bool twice = false;
  const auto watch = [&](int, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) names.emplace_back();
    if (event == Json::parse_event_t::object_end) names.pop_back();
    if (event == Json::parse_event_t::key) twice = !names.back().insert(parsed.get<std::string>()).second || twice;
    return true;
  };
  return !Json::parse(text, watch, false).is_discarded() && !twice;
}

}  // namespace birdseye::calibration
