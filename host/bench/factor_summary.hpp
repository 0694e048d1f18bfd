#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace birdseye::host {

/// A trial of factor_trial(), with its class, size and seed, or one that was refused, in a line for a person.
std::string line_of(const nlohmann::json& trial);

/// What the trials of one class and optimiser come to: docs/manual/registration-study.md names the keys. A trial that
/// failed leaves the error that it found.
nlohmann::json factor_row(const std::string& name, const std::string& optimiser,
                          const std::vector<nlohmann::json>& trials);
/// The rows as a table, and under it each trial that failed or passed wrongly.
std::string factor_markdown(const nlohmann::json& rows);
/// The error that was predicted against the one that was, root mean squares over bins of as many trials, for what is
/// seen, hidden and inside.
std::string calibration_svg(const std::vector<nlohmann::json>& trials);

}  // namespace birdseye::host
