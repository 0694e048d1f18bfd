#include "calibration/record/strict_json.hpp"

#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "calibration/base/nesting.hpp"

namespace birdseye::calibration {

template <typename Json>
Json strict_json(const std::string& text, std::string* twice) {
  if (text.find('\0') != std::string::npos || nests_too_deeply(text, Notation::json)) return Json::value_t::discarded;
  std::vector<std::set<std::string>> names;  // of the objects that are open
  bool any_twice = false;
  const auto watch = [&](int, typename Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) names.emplace_back();
    if (event == Json::parse_event_t::object_end) names.pop_back();
    if (event != Json::parse_event_t::key || names.back().insert(parsed.template get<std::string>()).second)
      return true;
    any_twice = true;
    if (twice != nullptr) *twice = parsed.template get<std::string>();
    return true;
  };
  Json json = Json::parse(text, watch, false);
  if (any_twice) return Json::value_t::discarded;
  return json;
}

template <typename Json>
std::string text_of_json(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

template nlohmann::json strict_json(const std::string& text, std::string* twice);
template nlohmann::ordered_json strict_json(const std::string& text, std::string* twice);
template std::string text_of_json(const nlohmann::json& json, int indent);
template std::string text_of_json(const nlohmann::ordered_json& json, int indent);

}  // namespace birdseye::calibration
