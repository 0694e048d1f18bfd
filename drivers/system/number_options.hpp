#pragma once

#include <cmath>
#include <cstdlib>
#include <string>

namespace birdseye {

/// For CLI11's check of an option: what is wrong with the number; empty: nothing. NaN lies within every CLI::Range, for
/// it is neither under the one end nor over the other.
inline std::string why_no_number(const std::string& text) {
  const double number = std::strtod(text.c_str(), nullptr);
  if (std::isnan(number)) return text + " is no number";
  return std::isinf(number) ? text + " is no finite number" : "";
}

/// Likewise of a number that is no less than 0: CLI11 counts down from the largest there is for a minus.
inline std::string why_below_zero(const std::string& text) {
  return text.find('-') == std::string::npos ? "" : text + " is below 0: give a whole number from 0 on";
}

/// Of the app and all its commands, once all are added: refuses what is no number, whatever an option's own check says
/// of it, and a minus where none can be. App is CLI11's, as run_program's. An option of numbers whose type is called by
/// another name, as MM, has to check them itself.
template <typename App>
void refuse_odd_numbers(App& app) {
  for (auto* const option : app.get_options()) {
    const std::string type = option->get_type_name();
    if (type.find("FLOAT") != std::string::npos) option->check(why_no_number);
    if (type.find("UINT") != std::string::npos) option->check(why_below_zero);
  }
  for (App* const command : app.get_subcommands({})) refuse_odd_numbers(*command);
}

}  // namespace birdseye
