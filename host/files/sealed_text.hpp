#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/identity/this_machine.hpp"

namespace birdseye::host {

/// A part of a sealed text, by its name.
using SealedPart = std::pair<std::string, nlohmann::json>;

/// A JSON object of which not one bit may be changed: a line for each part, then "sha256" with the sum of each part's
/// line, then "whole" with the sum of all that stands before it. Whoever wants to change such a file has to write all
/// of it anew.
std::string sealed_text(const std::vector<SealedPart>& parts);
/// The same, with the part "signed" behind the others: this machine's signature over the sum of all of them.
std::string sealed_text(const std::vector<SealedPart>& parts, std::string_view kind, const ThisMachine& machine);

/// The object, without its sums and signature: of a signed text what was signed, and nothing else. Refuses a text that
/// is not, to the bit, as it was written, with the part that is damaged: `its part "registered" was changed or
/// damaged`, `is cut off in its part "deformed"`.
Result<nlohmann::json> unseal(const std::string& text);

/// Who says that they wrote a text that unseal() takes. Whether it is true is not asked.
struct SealedBy {
  std::string sha256;  ///< of all that is signed; empty: nothing is
  std::optional<calibration::FileSignature> signature;
};
SealedBy sealed_by(const std::string& text);

}  // namespace birdseye::host
