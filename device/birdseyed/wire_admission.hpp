#pragma once

#include <string>

#include "calibration/base/result.hpp"
#include "device/birdseyed/config.hpp"
#include "device/wire/tcp_link.hpp"

namespace birdseye::device {

/// Who may connect as the configuration says: this machine's programs; where [wire] is bound beyond it, paired machines
/// by TLS, and whoever comes where plain is allowed. This machine's key is read, or made, only where it is needed.
Result<wire::Admission> admission_of(const WireConfig& wire);

/// What STATUS says for as long as the wire is plain beyond this machine; empty: it is not.
std::string plain_notice(const WireConfig& wire);

/// Who may connect, in words for --check, one line; empty: this machine's programs alone.
std::string admission_words(const WireConfig& wire);

}  // namespace birdseye::device
