#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "device/wire/tls.hpp"
#include "drivers/identity/machine_key.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::testing {

/// A machine with a key, that knows those whom it is told of.
class TlsMachine {
 public:
  void knows(const TlsMachine& other) { known_->insert(other.key().public_key()); }
  void forgets(const TlsMachine& other) { known_->erase(other.key().public_key()); }
  [[nodiscard]] const MachineKey& key() const { return key_; }
  [[nodiscard]] const std::shared_ptr<const wire::Tls>& tls() const { return tls_; }

 private:
  using Keys = std::set<PublicKey>;  // a test changes it only while nobody connects

  Scratch folder_;
  MachineKey key_ = *MachineKey::open(folder_ / "identity");
  std::shared_ptr<Keys> known_ = std::make_shared<Keys>();
  std::shared_ptr<const wire::Tls> tls_ =
      *wire::Tls::make(key_, [known = known_](const PublicKey& key) -> std::optional<std::string> {
        if (known->count(key) == 0) return std::nullopt;
        return "machine-" + key.hex().substr(0, 4);
      });
};

}  // namespace birdseye::testing
