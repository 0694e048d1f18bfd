#include "drivers/identity/this_machine.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <span>
#include <utility>

#include "drivers/identity/identity_folder.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye {

namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

std::string Author::words() const {
  switch (standing) {
    case Standing::known:
      return fmt::format("signed by {} ({}) at {}", machine, key.fingerprint(), utc);
    case Standing::unknown:
      return fmt::format("signed by a machine that is not known here and calls itself {} ({}) at {}", machine,
                         key.fingerprint(), utc);
    case Standing::nobody:
      break;
  }
  return "not signed: nobody says who wrote it";
}

Result<ThisMachine> ThisMachine::open() {
  const auto folder = identity_folder();
  if (!folder) return folder.error();
  return open(*folder);
}

Result<ThisMachine> ThisMachine::open(const std::filesystem::path& folder) {
  auto key = MachineKey::open(folder);
  if (!key) return key.error();
  std::string name = machine_name();
  auto known = KnownKeys::read(folder, KnownKeys::Machine{name, key->public_key()});
  if (!known) return known.error();
  return ThisMachine(*std::move(key), *std::move(known), std::move(name));
}

ThisMachine ThisMachine::for_once() {
  MachineKey key = MachineKey::for_once();
  std::string name = machine_name();
  KnownKeys known = KnownKeys::of_own({name, key.public_key()});
  return {std::move(key), std::move(known), std::move(name)};
}

calibration::FileSignature ThisMachine::sign(std::string_view kind, std::string_view sha256) const {
  calibration::FileSignature out{name_, key_.public_key().hex(), utc_now(), ""};
  out.signature = hex_of(key_.sign(bytes_of(signed_words(kind, sha256, out))));
  return out;
}

Result<Author> ThisMachine::author_of(std::string_view kind, std::string_view sha256,
                                      const std::optional<calibration::FileSignature>& signature) const {
  if (!signature) return Author();
  const auto key = PublicKey::of_hex(signature->key);
  Signature bytes{};
  if (!key || !bytes_of_hex(signature->signature, bytes) ||
      !verify(*key, bytes_of(signed_words(kind, sha256, *signature)), bytes)) {
    return Error{
        Errc::bad_format,
        fmt::format("its signature, in the name of {}, does not fit: it was changed since, or the signature is "
                    "of another file; take a copy that is as it was written",
                    machine_word(signature->machine))};
  }
  const auto name = known_.name_of(*key);
  return Author{name ? Author::Standing::known : Author::Standing::unknown,
                name ? *name : machine_word(signature->machine), *key, machine_word(signature->utc)};
}

}  // namespace birdseye
