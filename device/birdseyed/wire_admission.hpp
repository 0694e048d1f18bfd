#pragma once

#include <memory>
#include <string>
#include <utility>

#include "calibration/base/result.hpp"
#include "device/birdseyed/config.hpp"
#include "device/wire/tcp_link.hpp"
#include "drivers/system/background.hpp"

namespace birdseye::device {

/// Who may connect as the configuration says: this machine's programs; where [wire] is bound beyond it, paired machines
/// by TLS, and whoever comes where plain is allowed. This machine's key is read, or made, only where it is needed.
Result<wire::Admission> admission_of(const WireConfig& wire);

/// What admission_of() and a start after it would find wrong with this machine's key, the known keys and the address of
/// [wire], a line each. Makes no key and takes no port.
Result<void> check_wire(const WireConfig& wire);

/// Watches the file of the known keys, and says in the log once that it cannot be used, or can again. Reads it on a
/// thread of its own: a disk that hangs keeps nobody waiting.
class KnownKeysWatch {
 public:
  /// tls: null where nobody is let in by TLS.
  explicit KnownKeysWatch(std::shared_ptr<const wire::Tls> tls) : tls_(std::move(tls)) {}
  /// To be called now and then. What is wrong as last read, for the status; empty: nothing.
  const std::string& look();

 private:
  std::shared_ptr<const wire::Tls> tls_;
  std::string fault_;  ///< as told
  Background<std::string> reading_{Duration::from_ms(1000)};
};

/// What STATUS says for as long as the wire is plain beyond this machine; empty: it is not.
std::string plain_notice(const WireConfig& wire);

/// Who may connect, in words for --check, one line; empty: this machine's programs alone.
std::string admission_words(const WireConfig& wire);

}  // namespace birdseye::device
