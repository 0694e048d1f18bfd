#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/identity/public_key.hpp"

using EVP_PKEY = struct evp_pkey_st;  // as OpenSSL has it, for whoever includes this and not OpenSSL

namespace birdseye {

/// The key by which this machine signs, and shows that it is itself: Ed25519, in the file `key.pem` (PKCS#8) of a
/// folder that is its owner's alone.
class MachineKey {
 public:
  /// Of the folder, and made there where there is none: of two programs that make it at once both get the same. Refused
  /// where anybody else but root may read the key or change the folder, or one of them belongs to another.
  static Result<MachineKey> open(const std::filesystem::path& folder);
  /// As open() would, but nothing is made: nothing where there is no key yet and open() could make one.
  static Result<std::optional<MachineKey>> look(const std::filesystem::path& folder);
  /// One that is kept nowhere, and has no file.
  static MachineKey for_once();

  [[nodiscard]] const PublicKey& public_key() const { return public_key_; }
  [[nodiscard]] Signature sign(std::span<const std::uint8_t> bytes) const;
  /// For a TLS context, which takes its own reference; and the file, for one that reads it.
  [[nodiscard]] EVP_PKEY* evp_pkey() const { return key_.get(); }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

 private:
  MachineKey(std::shared_ptr<EVP_PKEY> key, const PublicKey& public_key, std::filesystem::path file)
      : key_(std::move(key)), public_key_(public_key), file_(std::move(file)) {}

  std::shared_ptr<EVP_PKEY> key_;
  PublicKey public_key_;
  std::filesystem::path file_;
};

/// What this machine is called.
std::string machine_name();
/// Somebody's name for a machine as a word, to stand in a line of text.
std::string machine_word(std::string name);

}  // namespace birdseye
