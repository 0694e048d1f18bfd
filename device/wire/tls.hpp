#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/identity/machine_key.hpp"
#include "drivers/identity/public_key.hpp"

using X509 = struct x509_st;
using SSL_CTX = struct ssl_ctx_st;  // as OpenSSL has it, for whoever includes this and not OpenSSL

namespace birdseye::wire {

/// Whatever speaks against this machine's own key or its list of known ones is told with these words, by which others
/// know it again.
inline constexpr const char* kNeedsKey = "TLS needs this machine's key";

/// A certificate as PEM; empty: there is none.
std::string pem_of(X509* certificate);

/// What all connections of one machine by TLS share: its key, with a certificate that says no more than the key, and
/// whose keys it believes. TLS 1.3 alone, both sides show their key, and nothing of a connection is kept for another.
class Tls {
 public:
  /// The name of the machine with this key; nothing: it is not let in. Asked for each connection.
  using Known = std::function<std::optional<std::string>(const PublicKey&)>;

  /// What is wrong with whom `Known` knows, in words; empty: nothing.
  using Fault = std::function<std::string()>;

  static Result<std::shared_ptr<const Tls>> make(const MachineKey& key, Known known, Fault fault = {});
  /// Of the key and the known keys in the identity's folder. The known keys are read again for each connection, so that
  /// a machine may be paired, or its key taken out, while this program runs (FollowedKeys).
  static Result<std::shared_ptr<const Tls>> of_this_machine();

  [[nodiscard]] const PublicKey& own_key() const { return own_key_; }
  [[nodiscard]] SSL_CTX* context() const { return context_.get(); }
  [[nodiscard]] std::optional<std::string> name_of(const PublicKey& key) const { return known_(key); }
  /// What is wrong with the file of the known keys, with the remedy: until then they are as they last were. Empty:
  /// nothing.
  [[nodiscard]] std::string fault() const { return fault_ ? fault_() : ""; }
  /// The certificate as PEM, the same to the byte each time: for programs that go by a file of it.
  [[nodiscard]] const std::string& certificate() const { return certificate_; }

 private:
  Tls(std::shared_ptr<SSL_CTX> context, const PublicKey& own_key, Known known, Fault fault, std::string certificate)
      : context_(std::move(context)),
        own_key_(own_key),
        known_(std::move(known)),
        fault_(std::move(fault)),
        certificate_(std::move(certificate)) {}

  std::shared_ptr<SSL_CTX> context_;
  PublicKey own_key_;
  Known known_;
  Fault fault_;
  std::string certificate_;
};

}  // namespace birdseye::wire
