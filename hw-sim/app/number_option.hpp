#pragma once

#include <CLI/CLI.hpp>
#include <cmath>
#include <string>

namespace birdseye::hw_sim {

/// An option's number from low to high. CLI::Range alone lets NaN pass, which is neither under the one nor over the
/// other.
inline CLI::Validator number_within(double low, double high) {
  const auto is_number = [](const std::string& text) -> std::string {
    double number = 0;
    return CLI::detail::lexical_cast(text, number) && std::isnan(number) ? text + " is no number" : "";
  };
  return CLI::Range(low, high) & CLI::Validator(is_number, "");
}

}  // namespace birdseye::hw_sim
