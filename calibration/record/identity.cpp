#include "calibration/record/identity.hpp"

#include <fmt/format.h>

#include "calibration/record/record_words.hpp"

namespace birdseye::calibration {

std::optional<IdentityDifference> first_difference(const Identity& recorded, const Identity& told) {
  for (const auto& [name, value] : recorded) {
    const auto found = told.find(name);
    if (found == told.end()) return IdentityDifference{name, value, ""};
    if (found->second != value) return IdentityDifference{name, value, found->second};
  }
  return std::nullopt;
}

std::string misfit(const std::string& what, const Identity& recorded, const Identity& told, const std::string& of) {
  if (recorded.empty())
    return fmt::format("{} does not say which {} it was made with; bind it to this one: {} HOST", of, what,
                       kBindCommand);
  const auto other = first_difference(recorded, told);
  if (!other) return {};
  if (other->told.empty())
    return fmt::format("{} is of {} {} {}; this one does not tell its", of, what, other->name, other->recorded);
  return fmt::format("{} is of {} {} {}; this one's is {}", of, what, other->name, other->recorded, other->told);
}

}  // namespace birdseye::calibration
