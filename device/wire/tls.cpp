#include "device/wire/tls.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "device/wire/tls_link.hpp"
#include "drivers/identity/followed_keys.hpp"
#include "drivers/identity/identity_folder.hpp"

namespace birdseye::wire {

namespace {

// The first is the fastest where the processor has AES, the second where it has not.
constexpr const char* kCiphers = "TLS_AES_128_GCM_SHA256:TLS_CHACHA20_POLY1305_SHA256";
constexpr long kMostCertificateBytes = 4096;
constexpr std::size_t kReadAheadBytes = 256U << 10U;

Error failed(const char* what) {
  return {Errc::io, fmt::format("TLS: {}", what)};
}

/// Nobody signs for a machine but itself: whom to believe stands in the known keys. So no date means anything either,
/// and none is asked of the clock, which is often wrong.
std::shared_ptr<X509> certificate_of(const MachineKey& key) {
  std::shared_ptr<X509> certificate(::X509_new(), ::X509_free);
  if (!certificate) return nullptr;
  X509* const c = certificate.get();
  ::X509_set_version(c, X509_VERSION_3);
  std::uint64_t serial = 0;
  for (std::size_t i = 0; i < 7; ++i) serial = serial << 8U | key.public_key().bytes[i];
  ::ASN1_INTEGER_set_uint64(::X509_get_serialNumber(c), serial | 1U);
  ::ASN1_TIME_set_string(::X509_getm_notBefore(c), "20200101000000Z");
  ::ASN1_TIME_set_string(::X509_getm_notAfter(c), "99991231235959Z");
  ::X509_set_pubkey(c, key.evp_pkey());
  X509_NAME* const name = ::X509_get_subject_name(c);
  const std::string text = "birdseye " + key.public_key().fingerprint();
  ::X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC, reinterpret_cast<const unsigned char*>(text.data()),
                               static_cast<int>(text.size()), -1, 0);
  ::X509_set_issuer_name(c, name);
  if (::X509_sign(c, key.evp_pkey(), nullptr) == 0) return nullptr;
  return certificate;
}

/// In place of OpenSSL's chains and dates: whether the key is known is all that counts. That the other side has the key
/// itself is shown by its signature, which OpenSSL looks at.
int verify_by_key(X509_STORE_CTX* store, void* /*unused*/) {
  const auto* const ssl =
      static_cast<const SSL*>(::X509_STORE_CTX_get_ex_data(store, ::SSL_get_ex_data_X509_STORE_CTX_idx()));
  X509* const shown = ::X509_STORE_CTX_get0_cert(store);
  if (shown != nullptr && TlsLink::of(ssl).takes_key_of(shown)) return 1;
  ::X509_STORE_CTX_set_error(store, X509_V_ERR_CERT_UNTRUSTED);  // which the other side is told as "bad certificate"
  return 0;
}

}  // namespace

std::string pem_of(X509* certificate) {
  const std::shared_ptr<BIO> out(::BIO_new(::BIO_s_mem()), ::BIO_free_all);
  char* text = nullptr;
  if (certificate == nullptr || !out || ::PEM_write_bio_X509(out.get(), certificate) == 0) return {};
  const long size = BIO_get_mem_data(out.get(), &text);
  return {text, static_cast<std::size_t>(size)};
}

Result<std::shared_ptr<const Tls>> Tls::make(const MachineKey& key, Known known, Fault fault) {
  const std::shared_ptr<SSL_CTX> context(::SSL_CTX_new(::TLS_method()), ::SSL_CTX_free);
  const auto certificate = certificate_of(key);
  if (!context || !certificate) return failed("no certificate can be made of this machine's key");
  SSL_CTX* const c = context.get();
  if (::SSL_CTX_use_certificate(c, certificate.get()) != 1 || ::SSL_CTX_use_PrivateKey(c, key.evp_pkey()) != 1 ||
      SSL_CTX_set_min_proto_version(c, TLS1_3_VERSION) != 1 || SSL_CTX_set_max_proto_version(c, TLS1_3_VERSION) != 1 ||
      ::SSL_CTX_set_ciphersuites(c, kCiphers) != 1 || SSL_CTX_set1_groups_list(c, "X25519") != 1 ||
      SSL_CTX_set1_sigalgs_list(c, "ed25519") != 1 || ::SSL_CTX_set_num_tickets(c, 0) != 1) {
    return failed("OpenSSL does not do what is asked of it");
  }
  SSL_CTX_set_session_cache_mode(c, SSL_SESS_CACHE_OFF);
  ::SSL_CTX_set_options(c, SSL_OP_NO_TICKET | SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION);
  SSL_CTX_set_mode(c, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER | SSL_MODE_RELEASE_BUFFERS);
  // It is set by itself, for sockets that block. Here it would have one read go on for as long as records come that
  // carry nothing, as new keys without end, past every deadline and with no turn for others.
  SSL_CTX_clear_mode(c, SSL_MODE_AUTO_RETRY);
  ::SSL_CTX_set_verify(c, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  ::SSL_CTX_set_cert_verify_callback(c, verify_by_key, nullptr);
  SSL_CTX_set_max_cert_list(c, kMostCertificateBytes);
  SSL_CTX_set_read_ahead(c, 1);
  ::SSL_CTX_set_default_read_buffer_len(c, kReadAheadBytes);
  return std::shared_ptr<const Tls>(
      new Tls(context, key.public_key(), std::move(known), std::move(fault), pem_of(certificate.get())));
}

Result<std::shared_ptr<const Tls>> Tls::of_this_machine() {
  const auto folder = identity_folder();
  if (!folder) return folder.error();
  const auto key = MachineKey::open(*folder);
  if (!key) return key.error();
  auto opened = FollowedKeys::open(*folder, {machine_name(), key->public_key()});
  if (!opened) return opened.error();
  const std::shared_ptr<FollowedKeys> known = *std::move(opened);
  return make(
      *key, [known](const PublicKey& shown) { return known->name_of(shown); }, [known] { return known->fault(); });
}

}  // namespace birdseye::wire
