#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "calibration/base/result.hpp"
#include "drivers/identity/this_machine.hpp"

namespace birdseye::host {

/// Whose files a command uses: this machine's, and those of machines that it knows; what is not signed, or by somebody
/// unknown, only where a person asked for it.
struct Authors {
  std::shared_ptr<const ThisMachine> machine;  ///< never null
  bool accept_unsigned = false;                ///< --accept-unsigned

  static Result<Authors> of_this_machine(bool accept_unsigned);
  /// One that knows nobody but itself, and whom no other program knows.
  static Authors for_once() { return {std::make_shared<const ThisMachine>(ThisMachine::for_once())}; }

  /// Empty where the author is known; where not, and it is to be used all the same, what is to be shown of it, as "not
  /// signed: nobody says who wrote it". Refuses, with the remedy, what is not to be used, and always what was changed
  /// since it was signed.
  [[nodiscard]] Result<std::string> admit(std::string_view kind, std::string_view sha256,
                                          const std::optional<calibration::FileSignature>& signature) const;
  /// The refusal of what rests on something that nobody known has signed.
  [[nodiscard]] Result<std::string> admit_resting_on(const std::string& doubt) const;
  /// admit(), and then admit_resting_on() of what the file says that it rests on.
  [[nodiscard]] Result<std::string> admit_with_rest(std::string_view kind, std::string_view sha256,
                                                    const std::optional<calibration::FileSignature>& signature,
                                                    const std::string& rests_on) const;
};

/// Of a report or a conversion, which goes on with what it is given: a line on stderr, where the author is not known.
/// Refuses what was changed since it was signed. path: of the file.
Result<void> note_author(const std::string& path, std::string_view kind, std::string_view sha256,
                         const std::optional<calibration::FileSignature>& signature);

/// The same of what such a file rests on; doubt: empty where all of it is signed by somebody known.
void note_resting_on(const std::string& path, const std::string& doubt);

}  // namespace birdseye::host
