#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/time/rate_limit.hpp"
#include "device/wire/socket_link.hpp"
#include "device/wire/tls.hpp"
#include "drivers/system/unique_fd.hpp"

using SSL = struct ssl_st;

namespace birdseye::wire {

/// A link by TLS over a stream socket that is connected and does not block. Until shake() has said that the other side
/// is who it should be, nothing is read or written.
class TlsLink final : public SocketLink {
 public:
  enum class Side { client, server };
  /// After so many bytes a connection goes on with a new key: RFC 8446, 5.5, lets AES-GCM seal 2^24.5 records by one.
  static constexpr std::uint64_t kBytesByOneKey = std::uint64_t{1} << 37U;

  static Result<std::unique_ptr<TlsLink>> over(UniqueFd connected, std::shared_ptr<const Tls> tls, Side side,
                                               std::uint64_t bytes_by_one_key = kBytesByOneKey);
  ~TlsLink() override;
  TlsLink(const TlsLink&) = delete;
  TlsLink& operator=(const TlsLink&) = delete;

  /// Goes on with the handshake as far as it can without waiting. False: not done yet. Errc::bad_value: one
  /// side does not know the other's key, or is shown none; Errc::unsupported: the other side does not speak TLS 1.3 as
  /// this one does.
  Result<bool> shake();
  /// Waits until shake() may get on.
  bool wait_shaken(Deadline deadline) { return wait_socket(deadline); }
  /// Whether something has come that read_some() would give. A client's handshake is done before the other side has
  /// seen its key: only what comes then tells whether it is let in. The errors are those of shake().
  Result<bool> hears();
  [[nodiscard]] const PublicKey& own_key() const { return tls_->own_key(); }
  [[nodiscard]] const std::string& own_certificate() const { return tls_->certificate(); }
  /// Of the other side. Once the handshake is done.
  [[nodiscard]] const PublicKey& peer_key() const { return *peer_key_; }
  [[nodiscard]] std::string peer_certificate() const;  ///< as PEM
  /// A secret of this connection alone that both ends have (RFC 8446, 7.5).
  [[nodiscard]] std::array<std::uint8_t, 32> secret(const std::string& label) const;

  Result<std::size_t> read_some(std::span<std::uint8_t> into) override;
  Result<std::size_t> write_some(std::span<const std::span<const std::uint8_t>> parts) override;
  bool wait_readable(Deadline deadline) override;
  bool wait_writable(Deadline deadline) override;
  /// By its key: a machine has several addresses, and another may have taken one of them.
  [[nodiscard]] std::string host() const override { return peer_key_ ? peer_key_->hex() : ""; }
  [[nodiscard]] bool is_known() const override { return peer_key_.has_value(); }
  [[nodiscard]] std::string peer_name() const override { return peer_key_ ? peer_name_ : ""; }
  [[nodiscard]] int fd() const override { return fd_.get(); }
  [[nodiscard]] bool has_read_ahead() const override { return read_ahead_; }
  [[nodiscard]] bool has_unsent() const override { return sent_ < unsent_.size(); }
  void send_unsent() override;

  /// For OpenSSL's callbacks: the link that an SSL is of; whether the key that a certificate shows is known.
  static TlsLink& of(const SSL* ssl);
  bool takes_key_of(X509* certificate);
  /// The socket as OpenSSL reads and writes it; 0: the other side has ended; -1: nothing for now; -2: it is broken.
  int read_socket(char* into, int size);
  int write_socket(const char* from, int size);
  /// The other side goes on with a new key.
  void note_new_key();

 private:
  TlsLink(UniqueFd fd, std::shared_ptr<const Tls> tls, std::uint64_t bytes_by_one_key);
  /// Waits for bytes to come and, as long as some are unsent, for room to send them.
  bool wait_socket(Deadline deadline);
  /// Why the last call of OpenSSL did not do what it should.
  [[nodiscard]] Error failure();

  UniqueFd fd_;
  std::shared_ptr<const Tls> tls_;
  std::uint64_t bytes_by_one_key_, bytes_by_this_key_ = 0;
  std::shared_ptr<SSL> ssl_;
  std::optional<PublicKey> shown_, peer_key_;
  std::string peer_name_;
  RateLimit new_keys_;  ///< of the other side
  bool too_many_keys_ = false;
  bool refused_ = false;      ///< the other side's key is not known here
  bool broken_ = false;       ///< OpenSSL can do no more for it
  bool read_ahead_ = true;    ///< the last read did not yet come to the end of what is there
  std::vector<char> unsent_;  ///< sealed, from sent_ on not taken by the socket
  std::size_t sent_ = 0;
};

/// Waits until the handshake is done and, as a client, until the other side has said something or a moment has passed:
/// it learns who this machine is only after this machine thinks that all is well. name: of the other side, for
/// messages.
Result<std::unique_ptr<Link>> shake_hands(std::unique_ptr<TlsLink> link, const std::string& name, Deadline deadline);

}  // namespace birdseye::wire
