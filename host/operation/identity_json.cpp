#include "host/operation/identity_json.hpp"

#include <nlohmann/json.hpp>

namespace birdseye::host {

nlohmann::json json_of(const PatientIdentity& identity) {
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [key, value] : {std::pair{"name", &identity.name},
                                   {"id", &identity.id},
                                   {"birth_date", &identity.birth_date},
                                   {"ct_date", &identity.ct_date}}) {
    if (!value->empty()) json[key] = *value;
  }
  return json;
}

}  // namespace birdseye::host
