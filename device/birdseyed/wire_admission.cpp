#include "device/birdseyed/wire_admission.hpp"

#include <fmt/format.h>

namespace birdseye::device {

Result<wire::Admission> admission_of(const WireConfig& wire) {
  wire::Admission admission;
  if (wire::is_loopback(wire.bind)) return admission;
  auto tls = wire::Tls::of_this_machine();
  if (!tls) return tls.error().with_context(fmt::format("[wire] bind {}: TLS needs this machine's key", wire.bind));
  admission.tls = *std::move(tls);
  admission.allow_plain = wire.allow_plain;
  return admission;
}

std::string plain_notice(const WireConfig& wire) {
  if (wire::is_loopback(wire.bind) || !wire.allow_plain) return {};
  return "the wire is plain ([wire] allow_plain): whoever is on the network reads it, and can change it";
}

std::string admission_words(const WireConfig& wire) {
  if (wire::is_loopback(wire.bind)) return {};
  if (std::string plain = plain_notice(wire); !plain.empty()) return plain;
  return "the wire: this machine's programs, and paired machines by TLS (birdseyed pair)";
}

}  // namespace birdseye::device
