#pragma once

#include <nlohmann/json_fwd.hpp>

#include <vector>

#include "host/operation/findings.hpp"
#include "host/operation/patient.hpp"

/// What an operation found, as JSON: what is read back is the same to the bit. What is not known is not there.
namespace birdseye::host {

nlohmann::json json_of(const CalibratedScope& found);
nlohmann::json json_of(const RegisteredPatient& found);
nlohmann::json json_of(const DeformedOrgan& found);
nlohmann::json json_of(const std::vector<NamedPoint>& picked);

/// Throw what nlohmann throws; refuse numbers that make no sense.
Result<CalibratedScope> calibrated_of(const nlohmann::json& json);
Result<RegisteredPatient> registered_of(const nlohmann::json& json);
Result<DeformedOrgan> deformed_of(const nlohmann::json& json);
Result<std::vector<NamedPoint>> landmarks_of(const nlohmann::json& json);

}  // namespace birdseye::host
