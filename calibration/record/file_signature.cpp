#include "calibration/record/file_signature.hpp"

#include <nlohmann/json.hpp>

#include "calibration/record/strict_json.hpp"

namespace birdseye::calibration {

std::string signed_words(std::string_view kind, std::string_view sha256, const FileSignature& signature) {
  // As JSON, so that no machine's name can stand for another line.
  return text_of_json(
      nlohmann::json{"birdseye signature 1", kind, sha256, signature.machine, signature.key, signature.utc});
}

nlohmann::json json_of_signature(const FileSignature& signature) {
  return {{"machine", signature.machine},
          {"key", signature.key},
          {"utc", signature.utc},
          {"signature", signature.signature}};
}

FileSignature signature_of_json(const nlohmann::json& json) {
  // Anything more would be signed by nobody.
  if (json.size() != 4) throw nlohmann::json::other_error::create(501, "a signature has four parts and no more", &json);
  return {json.at("machine").get<std::string>(), json.at("key").get<std::string>(), json.at("utc").get<std::string>(),
          json.at("signature").get<std::string>()};
}

}  // namespace birdseye::calibration
