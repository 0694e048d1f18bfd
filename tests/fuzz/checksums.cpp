#include "tests/fuzz/checksums.hpp"

#include <nlohmann/json.hpp>

#include "calibration/record/checksum.hpp"

namespace birdseye::testing {

namespace {

template <typename Json>
std::string summed(const std::string& text) {
  Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return text;
  json.erase("checksum");
  json["checksum"] = calibration::checksum_of(json.dump());
  return json.dump();
}

}  // namespace

std::string with_checksum(const std::string& text, Keys keys) {
  return keys == Keys::sorted ? summed<nlohmann::json>(text) : summed<nlohmann::ordered_json>(text);
}

}  // namespace birdseye::testing
