#include "device/birdseyed/wire_admission.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <optional>

#include "drivers/identity/identity_folder.hpp"
#include "drivers/identity/known_keys.hpp"
#include "drivers/identity/machine_key.hpp"

namespace birdseye::device {

namespace {

Error without_key(const WireConfig& wire, const Error& error) {
  return error.with_context(fmt::format("[wire] bind {}: {}", wire.bind, wire::kNeedsKey));
}

Result<void> check_identity() {
  const auto folder = identity_folder();
  if (!folder) return folder.error();
  const auto key = MachineKey::look(*folder);
  if (!key) return key.error();
  std::optional<KnownKeys::Machine> own;
  if (*key) own = {machine_name(), (*key)->public_key()};
  if (const auto known = KnownKeys::read(*folder, own); !known) return known.error();
  return {};
}

}  // namespace

Result<wire::Admission> admission_of(const WireConfig& wire) {
  wire::Admission admission;
  if (wire::is_loopback(wire.bind)) return admission;
  auto tls = wire::Tls::of_this_machine();
  if (!tls) return without_key(wire, tls.error());
  admission.tls = *std::move(tls);
  admission.allow_plain = wire.allow_plain;
  admission.tell_refused = [](const std::string& line) { spdlog::warn("{}", line); };
  return admission;
}

Result<void> check_wire(const WireConfig& wire) {
  std::string faults;
  const auto take = [&faults](const Error& error) { faults += (faults.empty() ? "" : "\n") + error.what; };
  if (!wire::is_loopback(wire.bind)) {
    if (const auto identity = check_identity(); !identity) take(without_key(wire, identity.error()));
  }
  if (const auto bound = wire::check_bind(wire.bind); !bound) take(bound.error());
  if (!faults.empty()) return Error{Errc::bad_value, faults};
  return {};
}

const std::string& KnownKeysWatch::look() {
  auto read = reading_.take();
  if (tls_ && !reading_.running())
    reading_.start([tls = tls_](const std::stop_token&, const auto&) { return tls->fault(); });
  if (!read || *read == fault_) return fault_;
  fault_ = *std::move(read);
  if (fault_.empty()) {
    spdlog::info("the known machines are again those in their file");
  } else {
    spdlog::error("{}; until then the machines are let in that the file named before", fault_);
  }
  return fault_;
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
