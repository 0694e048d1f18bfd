#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "calibration/base/result.hpp"
#include "calibration/record/file_signature.hpp"
#include "drivers/identity/known_keys.hpp"
#include "drivers/identity/machine_key.hpp"

namespace birdseye {

/// Who wrote a file that is as its writer left it.
struct Author {
  enum class Standing {
    known,    ///< this machine, or one whose key it knows
    unknown,  ///< somebody whose key it does not know
    nobody,   ///< it is not signed
  };

  Standing standing = Standing::nobody;
  std::string machine;  ///< known: as it is named here; unknown: as it calls itself
  PublicKey key;
  std::string utc;

  /// "signed by cart-1 (3f2a 9c01 ...) at 2026-11-22T09:30:00Z", "not signed".
  [[nodiscard]] std::string words() const;
};

/// The machine that this program runs on: it signs what it writes, and knows whose signatures to believe.
class ThisMachine {
 public:
  /// By the key of identity_folder(), which is made where there is none.
  static Result<ThisMachine> open();
  static Result<ThisMachine> open(const std::filesystem::path& folder);
  /// With a key that ends with the program, knowing no other: for what is written and read by one program.
  static ThisMachine for_once();

  [[nodiscard]] const MachineKey& key() const { return key_; }
  [[nodiscard]] const std::string& name() const { return name_; }

  /// kind: what the file is. sha256: of everything in it.
  [[nodiscard]] calibration::FileSignature sign(std::string_view kind, std::string_view sha256) const;
  /// An error: it says that somebody signed it who did not, so it was changed since, or the signature is another
  /// file's.
  [[nodiscard]] Result<Author> author_of(std::string_view kind, std::string_view sha256,
                                         const std::optional<calibration::FileSignature>& signature) const;
  /// Knows the author from now on, by this name.
  Result<void> trust(const std::string& name, const PublicKey& key) { return known_.add(name, key); }

 private:
  ThisMachine(MachineKey key, KnownKeys known, std::string name)
      : key_(std::move(key)), known_(std::move(known)), name_(std::move(name)) {}

  MachineKey key_;
  KnownKeys known_;
  std::string name_;
};

}  // namespace birdseye
