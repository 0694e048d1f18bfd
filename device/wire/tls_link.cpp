#include "device/wire/tls_link.hpp"

#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "drivers/system/wait.hpp"

namespace birdseye::wire {

namespace {

constexpr std::size_t kMostSealedBytes = 64U << 10U;  // past one record only where a peer asks for new keys without end
constexpr std::size_t kRecordBytes = 16U << 10U;
constexpr Duration kFirstWord = Duration::from_ms(1000);
// Far more than anybody needs: a sender of ours takes a new key after 128 GiB.
constexpr Duration kPerNewKey = Duration::from_ms(1000);
constexpr std::int64_t kNewKeysAtOnce = 64;
// OpenSSL takes up every new key that it has read, in one call. From a client, which says little, it reads no more at
// once than some 150 of them.
constexpr int kMostReadOfAClient = 4 << 10;

int read_bio(BIO* bio, char* into, int size) {
  BIO_clear_retry_flags(bio);
  const int got = static_cast<TlsLink*>(::BIO_get_data(bio))->read_socket(into, size);
  if (got == -1) BIO_set_retry_read(bio);
  return got;
}

int write_bio(BIO* bio, const char* from, int size) {
  BIO_clear_retry_flags(bio);
  return static_cast<TlsLink*>(::BIO_get_data(bio))->write_socket(from, size);
}

long control_bio(BIO* /*bio*/, int command, long /*number*/, void* /*pointer*/) {
  return command == BIO_CTRL_FLUSH ? 1 : 0;
}

/// Sees every message of the handshake's kind, before OpenSSL takes it up.
void see_message(int written, int /*version*/, int content_type, const void* message, std::size_t size, SSL* ssl,
                 void* /*unused*/) {
  if (written != 0 || content_type != SSL3_RT_HANDSHAKE || size == 0) return;
  if (*static_cast<const std::uint8_t*>(message) == SSL3_MT_KEY_UPDATE) TlsLink::of(ssl).note_new_key();
}

/// Not OpenSSL's own of a socket: that raises SIGPIPE, and one that takes only part of a record wants the same bytes
/// again, while a client's queue may have others by then.
BIO_METHOD* socket_method() {
  static BIO_METHOD* const method = [] {
    BIO_METHOD* const made = ::BIO_meth_new(::BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "socket");
    ::BIO_meth_set_read(made, read_bio);
    ::BIO_meth_set_write(made, write_bio);
    ::BIO_meth_set_ctrl(made, control_bio);
    return made;
  }();
  return method;
}

}  // namespace

Result<std::unique_ptr<TlsLink>> TlsLink::over(UniqueFd connected, std::shared_ptr<const Tls> tls, Side side,
                                               std::uint64_t bytes_by_one_key) {
  std::unique_ptr<TlsLink> link(new TlsLink(std::move(connected), std::move(tls), bytes_by_one_key));
  link->ssl_ = std::shared_ptr<SSL>(::SSL_new(link->tls_->context()), ::SSL_free);
  BIO* const bio = ::BIO_new(socket_method());
  if (!link->ssl_ || bio == nullptr) return Error{Errc::io, "TLS: no connection can be made"};
  ::BIO_set_data(bio, link.get());
  ::BIO_set_init(bio, 1);
  SSL* const ssl = link->ssl_.get();
  ::SSL_set_bio(ssl, bio, bio);
  SSL_set_app_data(ssl, link.get());
  ::SSL_set_msg_callback(ssl, see_message);
  if (side == Side::client) {
    ::SSL_set_connect_state(ssl);
  } else {
    ::SSL_set_accept_state(ssl);
  }
  return link;
}

TlsLink::TlsLink(UniqueFd fd, std::shared_ptr<const Tls> tls, std::uint64_t bytes_by_one_key)
    : fd_(std::move(fd)),
      tls_(std::move(tls)),
      bytes_by_one_key_(bytes_by_one_key),
      new_keys_(kPerNewKey, kNewKeysAtOnce) {}

TlsLink::~TlsLink() {
  if (peer_key_ && !broken_) ::SSL_shutdown(ssl_.get());  // says that it ends; nobody waits for the answer
  ::ERR_clear_error();
}

TlsLink& TlsLink::of(const SSL* ssl) {
  return *static_cast<TlsLink*>(SSL_get_app_data(ssl));
}

bool TlsLink::takes_key_of(X509* certificate) {
  const EVP_PKEY* const key = ::X509_get0_pubkey(certificate);
  PublicKey shown;
  std::size_t size = shown.bytes.size();
  if (key != nullptr && ::EVP_PKEY_get_id(key) == EVP_PKEY_ED25519 &&
      ::EVP_PKEY_get_raw_public_key(key, shown.bytes.data(), &size) == 1 && size == shown.bytes.size()) {
    if (const auto name = tls_->name_of(shown)) {
      shown_ = shown;
      peer_name_ = *name;
      return true;
    }
  }
  refused_ = true;
  return false;
}

void TlsLink::note_new_key() {
  const DeviceTime now = device_now();
  too_many_keys_ = too_many_keys_ || now < new_keys_.free_at();
  new_keys_.passed(now);
}

int TlsLink::read_socket(char* into, int size) {
  if (too_many_keys_) return -2;
  if (::SSL_is_server(ssl_.get()) != 0) size = std::min(size, kMostReadOfAClient);
  const ssize_t got = ::recv(fd_.get(), into, static_cast<std::size_t>(size), MSG_DONTWAIT);
  if (got < 0) return errno == EAGAIN || errno == EINTR ? -1 : -2;
  return static_cast<int>(got);
}

/// Takes all: what the socket has no room for waits here, and no more is sealed until it has gone.
int TlsLink::write_socket(const char* from, int size) {
  const auto bytes = static_cast<std::size_t>(size);
  std::size_t put = 0;
  if (!has_unsent()) {
    const ssize_t sent = ::send(fd_.get(), from, bytes, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno != EAGAIN && errno != EINTR) return -2;
    put = sent < 0 ? 0 : static_cast<std::size_t>(sent);
  }
  if (put == bytes) return size;
  if (unsent_.size() - sent_ > kMostSealedBytes) return -2;
  unsent_.insert(unsent_.end(), from + put, from + size);
  return size;
}

void TlsLink::send_unsent() {
  if (!has_unsent()) return;
  const ssize_t sent = ::send(fd_.get(), unsent_.data() + sent_, unsent_.size() - sent_, MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent < 0 && errno != EAGAIN && errno != EINTR) {
    broken_ = true;
    return;
  }
  sent_ += sent < 0 ? 0 : static_cast<std::size_t>(sent);
  if (has_unsent()) return;
  unsent_.clear();
  sent_ = 0;
}

Error TlsLink::failure() {
  broken_ = true;
  read_ahead_ = true;  // so that whoever waits for bytes comes to read, and is told
  if (refused_) return {Errc::bad_value, "its key is not known here"};
  if (too_many_keys_) return {Errc::bad_format, "the other side asks for new keys without end"};
  const int reason = ERR_GET_REASON(::ERR_peek_last_error());
  if (reason == SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE) return {Errc::bad_value, "it shows no key"};
  if (reason == SSL_R_SSLV3_ALERT_BAD_CERTIFICATE) return {Errc::bad_value, "it does not know this machine's key"};
  return {Errc::disconnected, "the other side has gone"};
}

Result<bool> TlsLink::shake() {
  ::ERR_clear_error();
  const int done = ::SSL_do_handshake(ssl_.get());
  if (done == 1) {
    peer_key_ = shown_;
    return true;
  }
  const int why = ::SSL_get_error(ssl_.get(), done);
  if (why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE) return false;
  Error error = failure();
  if (why == SSL_ERROR_SSL && error.code == Errc::disconnected)
    error = {Errc::unsupported, "it does not speak TLS 1.3 as Birdseye does"};
  return error;
}

Result<bool> TlsLink::hears() {
  ::ERR_clear_error();
  std::uint8_t byte = 0;
  std::size_t got = 0;
  if (::SSL_peek_ex(ssl_.get(), &byte, 1, &got) == 1) return true;
  const int why = ::SSL_get_error(ssl_.get(), 0);
  if (why != SSL_ERROR_WANT_READ && why != SSL_ERROR_WANT_WRITE) return failure();
  read_ahead_ = false;
  return false;
}

std::string TlsLink::peer_certificate() const {
  return pem_of(::SSL_get0_peer_certificate(ssl_.get()));
}

std::array<std::uint8_t, 32> TlsLink::secret(const std::string& label) const {
  std::array<std::uint8_t, 32> out{};
  ::SSL_export_keying_material(ssl_.get(), out.data(), out.size(), label.data(), label.size(), nullptr, 0, 0);
  return out;
}

Result<std::size_t> TlsLink::read_some(std::span<std::uint8_t> into) {
  ::ERR_clear_error();
  std::size_t count = 0;
  read_ahead_ = true;
  while (count < into.size()) {
    std::size_t got = 0;
    if (!broken_ && !too_many_keys_ && ::SSL_read_ex(ssl_.get(), into.data() + count, into.size() - count, &got) == 1) {
      count += got;
      continue;
    }
    const int why = broken_ || too_many_keys_ ? SSL_ERROR_SSL : ::SSL_get_error(ssl_.get(), 0);
    if (why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE) {
      read_ahead_ = false;
      return count;
    }
    const Error error = failure();
    if (count > 0) return count;
    return error;
  }
  return count;
}

Result<std::size_t> TlsLink::write_some(std::span<const std::span<const std::uint8_t>> parts) {
  ::ERR_clear_error();
  send_unsent();
  if (broken_) return failure();
  std::size_t count = 0;
  for (std::span<const std::uint8_t> part : parts) {
    while (!part.empty() && !has_unsent()) {
      std::size_t put = 0;
      if (::SSL_write_ex(ssl_.get(), part.data(), std::min(part.size(), kRecordBytes), &put) != 1) return failure();
      part = part.subspan(put);
      count += put;
      bytes_by_this_key_ += put;
      if (bytes_by_this_key_ < bytes_by_one_key_) continue;
      bytes_by_this_key_ = 0;
      ::SSL_key_update(ssl_.get(), SSL_KEY_UPDATE_NOT_REQUESTED);
    }
  }
  return count;
}

bool TlsLink::wait_socket(Deadline deadline) {
  for (;;) {
    const auto events = static_cast<short>(POLLIN | (has_unsent() ? POLLOUT : 0));
    const short told = wait_ready(fd_.get(), events, deadline);
    if (told == 0) return false;
    if ((told & POLLOUT) != 0) send_unsent();
    if ((told & ~POLLOUT) != 0 || broken_) return true;
  }
}

bool TlsLink::wait_readable(Deadline deadline) {
  return read_ahead_ || wait_socket(deadline);
}

bool TlsLink::wait_writable(Deadline deadline) {
  while (has_unsent()) {
    if (wait_ready(fd_.get(), POLLOUT, deadline) == 0) return false;
    send_unsent();
    if (broken_) return true;
  }
  return wait_ready(fd_.get(), POLLOUT, deadline) != 0;
}

Result<std::unique_ptr<Link>> shake_hands(std::unique_ptr<TlsLink> link, const std::string& name, Deadline deadline) {
  const auto none_by = [&] {
    return Error{Errc::timeout, fmt::format("{}: does not answer by TLS; does it speak plain there?", name)};
  };
  for (;;) {
    const auto done = link->shake();
    if (!done) return done.error().with_context(name);
    if (*done) break;
    if (!link->wait_shaken(deadline)) return none_by();
  }
  for (const Deadline until = std::min(deadline, Deadline::after(kFirstWord));;) {
    const auto heard = link->hears();
    if (!heard) return heard.error().with_context(name);
    if (*heard || !link->wait_readable(until)) break;
  }
  return std::unique_ptr<Link>(std::move(link));
}

}  // namespace birdseye::wire
