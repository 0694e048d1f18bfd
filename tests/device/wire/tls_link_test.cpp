// Links by TLS: who is let in, and what becomes of bytes that somebody changes, cuts or holds back on the way.

#include "device/wire/tls_link.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <sys/socket.h>

#include <array>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

#include "device/wire/tcp_link.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/tls_machine.hpp"

namespace birdseye::wire {
namespace {

using testing::Scratch;
using Bytes = std::vector<std::uint8_t>;

struct Pair {
  UniqueFd one, other;
};

Pair socket_pair() {
  std::array<int, 2> fds{};
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, fds.data()), 0);
  return {UniqueFd(fds[0]), UniqueFd(fds[1])};
}

Bytes some(std::size_t count) {
  Bytes bytes(count);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{1});
  return bytes;
}

std::size_t write(Link& link, const Bytes& bytes) {
  const std::span<const std::uint8_t> part(bytes);
  const auto put = link.write_some(std::span(&part, 1));
  return put ? *put : 0;
}

Result<Bytes> read(Link& link, std::size_t most = 1 << 20) {
  Bytes bytes(most);
  const auto got = link.read_some(bytes);
  if (!got) return got.error();
  bytes.resize(*got);
  return bytes;
}

/// Client and server, and between them a test that carries their bytes.
class Tls13 : public ::testing::Test {
 protected:
  void SetUp() override {
    cart_.knows(host_);
    host_.knows(cart_);
  }
  void connect(std::uint64_t bytes_by_one_key = TlsLink::kBytesByOneKey) {
    auto [client, near] = socket_pair();
    auto [server, far] = socket_pair();
    near_ = std::move(near);
    far_ = std::move(far);
    client_ = *TlsLink::over(std::move(client), host_.tls(), TlsLink::Side::client, bytes_by_one_key);
    server_ = *TlsLink::over(std::move(server), cart_.tls(), TlsLink::Side::server, bytes_by_one_key);
  }
  /// Bytes that are there now, from one end to the other; change sees each portion before the other end does.
  static std::size_t carry(const UniqueFd& from, const UniqueFd& to, const std::function<void(Bytes&)>& change = {}) {
    std::size_t carried = 0;
    for (Bytes bytes(1 << 16);; bytes.resize(1 << 16)) {
      const ssize_t got = ::recv(from.get(), bytes.data(), bytes.size(), 0);
      if (got <= 0) return carried;
      bytes.resize(static_cast<std::size_t>(got));
      if (change) change(bytes);
      EXPECT_EQ(::send(to.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
      carried += bytes.size();
    }
  }
  void shake() {
    client_shook_ = server_shook_ = false;
    for (int i = 0; i < 10; ++i) {
      if (client_shook_ && !*client_shook_) client_shook_ = client_->shake();
      carry(near_, far_);
      if (server_shook_ && !*server_shook_) server_shook_ = server_->shake();
      carry(far_, near_);
    }
  }
  /// A client that is OpenSSL itself. Keep it as long as its socket is to stay open.
  struct Stranger {
    UniqueFd socket;
    std::shared_ptr<SSL> ssl;
  };
  Stranger shake_with(SSL_CTX& context) {
    auto [client, near] = socket_pair();
    near_ = std::move(near);
    Stranger out{std::move(client), {::SSL_new(&context), ::SSL_free}};
    ::SSL_set_fd(out.ssl.get(), out.socket.get());
    ::SSL_set_connect_state(out.ssl.get());
    server_shook_ = false;
    for (int i = 0; i < 10; ++i) {
      ::SSL_do_handshake(out.ssl.get());
      carry(near_, far_);
      if (server_shook_ && !*server_shook_) server_shook_ = server_->shake();
      carry(far_, near_);
    }
    return out;
  }
  void let_in() {
    connect();
    shake();
    ASSERT_TRUE(client_shook_ && *client_shook_);
    ASSERT_TRUE(server_shook_ && *server_shook_);
  }

  testing::TlsMachine cart_, host_;
  UniqueFd near_, far_;
  std::unique_ptr<TlsLink> client_, server_;
  Result<bool> client_shook_ = false, server_shook_ = false;
};

TEST_F(Tls13, TwoMachinesThatKnowEachOtherGetAcrossWhatTheySay) {
  let_in();
  EXPECT_EQ(server_->peer_key(), host_.key().public_key());
  EXPECT_EQ(client_->peer_key(), cart_.key().public_key());
  EXPECT_TRUE(server_->is_known());
  EXPECT_EQ(server_->secret("test"), client_->secret("test"));
  EXPECT_NE(server_->secret("test"), client_->secret("other"));
  EXPECT_EQ(*read(*client_), Bytes());
  const Bytes bytes = some(100'000);  // several records
  std::size_t seen = 0;
  ASSERT_EQ(write(*server_, bytes), bytes.size());
  carry(far_, near_, [&](const Bytes& on_the_way) {
    seen += on_the_way.size();
    EXPECT_EQ(std::search(on_the_way.begin(), on_the_way.end(), bytes.begin(), bytes.begin() + 16), on_the_way.end());
  });
  EXPECT_GT(seen, bytes.size());
  EXPECT_EQ(*read(*client_), bytes);
  ASSERT_EQ(write(*client_, {1, 2}), 2U);
  carry(near_, far_);
  EXPECT_EQ(*read(*server_), Bytes({1, 2}));
}

TEST_F(Tls13, WhatDoesNotFitIsReadInPartsAndNotWaitedFor) {
  let_in();
  ASSERT_EQ(write(*server_, some(10'000)), 10'000U);
  carry(far_, near_);
  EXPECT_EQ(read(*client_, 4096)->size(), 4096U);
  EXPECT_TRUE(client_->wait_readable(device_now())) << "the rest is no longer at the socket";
  EXPECT_EQ(read(*client_)->size(), 10'000U - 4096U);
  EXPECT_FALSE(client_->wait_readable(device_now()));
}

TEST_F(Tls13, TakesNoMoreThanTheSocketAndSendsTheRestOfARecordByItself) {
  let_in();
  const Bytes bytes = some(8 << 20);
  const std::size_t put = write(*server_, bytes);
  EXPECT_LT(put, bytes.size());
  EXPECT_TRUE(server_->has_unsent());
  EXPECT_EQ(write(*server_, bytes), 0U);
  EXPECT_FALSE(server_->wait_writable(device_now()));
  Bytes got;
  for (int i = 0; i < 1000 && got.size() < put; ++i) {
    carry(far_, near_);
    EXPECT_TRUE(server_->wait_writable(device_now()));
    const auto more = read(*client_, 8 << 20);
    got.insert(got.end(), more->begin(), more->end());
  }
  EXPECT_EQ(got, Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(put)));
}

TEST_F(Tls13, AMachineThatTheCartDoesNotKnowIsNotLetIn) {
  cart_.forgets(host_);
  connect();
  shake();
  ASSERT_FALSE(server_shook_);
  EXPECT_EQ(server_shook_.error().what, "its key is not known here");
  const auto heard = client_->hears();
  ASSERT_FALSE(heard);
  EXPECT_EQ(heard.error().what, "it does not know this machine's key");
}

TEST_F(Tls13, ACartThatTheHostDoesNotKnowIsNotSpokenTo) {
  host_.forgets(cart_);
  connect();
  shake();
  ASSERT_FALSE(client_shook_);
  EXPECT_EQ(client_shook_.error().what, "its key is not known here");
  EXPECT_FALSE(server_shook_);
}

TEST_F(Tls13, WhoShowsNoKeyIsNotLetIn) {
  connect();
  const std::shared_ptr<SSL_CTX> keyless(::SSL_CTX_new(::TLS_client_method()), ::SSL_CTX_free);
  (void)shake_with(*keyless);
  ASSERT_FALSE(server_shook_);
  EXPECT_EQ(server_shook_.error().code, Errc::bad_value);
  EXPECT_EQ(server_shook_.error().what, "it shows no key");
}

TEST_F(Tls13, OlderVersionsAreRefused) {
  connect();
  const std::shared_ptr<SSL_CTX> old(::SSL_CTX_new(::TLS_client_method()), ::SSL_CTX_free);
  SSL_CTX_set_max_proto_version(old.get(), TLS1_2_VERSION);
  auto [client, near] = socket_pair();
  near_ = std::move(near);
  const std::shared_ptr<SSL> ssl(::SSL_new(old.get()), ::SSL_free);
  ::SSL_set_fd(ssl.get(), client.get());
  ::SSL_set_connect_state(ssl.get());
  ::SSL_do_handshake(ssl.get());
  carry(near_, far_);
  const auto shook = server_->shake();
  ASSERT_FALSE(shook);
  EXPECT_EQ(shook.error().code, Errc::unsupported);
}

TEST_F(Tls13, PlainBytesAreNoHandshake) {
  connect();
  const Bytes plain = some(200);
  ASSERT_EQ(::send(far_.get(), plain.data(), plain.size(), 0), 200);
  const auto shook = server_->shake();
  ASSERT_FALSE(shook);
  EXPECT_EQ(shook.error().code, Errc::unsupported);
}

TEST_F(Tls13, OneBitThatIsChangedOnTheWayEndsIt) {
  for (const std::size_t where : {3U, 20U, 900U}) {
    let_in();
    ASSERT_EQ(write(*server_, some(1000)), 1000U);
    carry(far_, near_, [&](Bytes& bytes) { bytes[where] ^= 1U; });
    EXPECT_EQ(read(*client_).error().code, Errc::disconnected) << where;
    EXPECT_FALSE(read(*client_)) << "and stays ended";
    EXPECT_EQ(write(*client_, {1}), 0U);
  }
}

TEST_F(Tls13, WhatIsRepeatedOnTheWayEndsIt) {
  let_in();
  ASSERT_EQ(write(*server_, some(1000)), 1000U);
  carry(far_, near_, [&](Bytes& bytes) { bytes.insert(bytes.end(), bytes.begin(), bytes.end()); });
  EXPECT_EQ(read(*client_)->size(), 1000U);
  EXPECT_FALSE(read(*client_));
}

TEST_F(Tls13, AConnectionThatIsCutWithinARecordEndsAndTellsNoHalf) {
  let_in();
  ASSERT_EQ(write(*server_, some(1000)), 1000U);
  carry(far_, near_, [&](Bytes& bytes) { bytes.resize(500); });
  EXPECT_EQ(read(*client_)->size(), 0U);
  near_ = {};
  ASSERT_TRUE(client_->wait_readable(Deadline::after(Duration::from_ms(60'000))));
  EXPECT_EQ(read(*client_).error().code, Errc::disconnected);
}

TEST_F(Tls13, WhoEndsIsHeardToEnd) {
  let_in();
  server_.reset();
  carry(far_, near_);
  EXPECT_EQ(read(*client_).error().code, Errc::disconnected);
}

TEST_F(Tls13, GoesOnWithANewKeyBeforeOneHasSealedTooMuch) {
  connect(100'000);
  shake();
  ASSERT_TRUE(server_shook_ && *server_shook_);
  Bytes on_the_way;
  for (int i = 0; i < 100; ++i) {
    const Bytes bytes = some(50'000 + static_cast<std::size_t>(i));
    ASSERT_EQ(write(*server_, bytes), bytes.size());
    carry(far_, near_, [&](const Bytes& some) { on_the_way.insert(on_the_way.end(), some.begin(), some.end()); });
    ASSERT_EQ(*read(*client_), bytes);
  }
  constexpr std::size_t kHeader = 5, kKeyUpdate = 5 + 1 + 16;  // RFC 8446: the message, its type, the seal
  int updates = 0;
  for (std::size_t at = 0; at + kHeader <= on_the_way.size();) {
    const std::size_t size = std::size_t{on_the_way[at + 3]} << 8U | on_the_way[at + 4];
    updates += size == kKeyUpdate ? 1 : 0;
    at += kHeader + size;
  }
  EXPECT_GE(updates, 45);
}

TEST_F(Tls13, NewKeysWithoutEndAreNotReadOnAndOnInOneGo) {
  connect();
  // Of this kind of socket a read gets what one write put, so that there is an end to what is there at once.
  std::array<int, 2> fds{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, fds.data()), 0);
  far_ = UniqueFd(fds[1]);
  server_ = *TlsLink::over(UniqueFd(fds[0]), cart_.tls(), TlsLink::Side::server);
  const std::shared_ptr<SSL_CTX> context(::SSL_CTX_new(::TLS_client_method()), ::SSL_CTX_free);
  const Scratch scratch;
  const std::string certificate = scratch.file("host.crt", host_.tls()->certificate());
  ASSERT_EQ(::SSL_CTX_use_certificate_file(context.get(), certificate.c_str(), SSL_FILETYPE_PEM), 1);
  ASSERT_EQ(::SSL_CTX_use_PrivateKey(context.get(), host_.key().evp_pkey()), 1);
  const Stranger stranger = shake_with(*context);
  ASSERT_TRUE(server_shook_ && *server_shook_);
  constexpr int kNewKeys = 20;
  for (int i = 0; i < kNewKeys; ++i) {
    ASSERT_EQ(::SSL_key_update(stranger.ssl.get(), SSL_KEY_UPDATE_NOT_REQUESTED), 1);
    ASSERT_EQ(::SSL_do_handshake(stranger.ssl.get()), 1);
    ASSERT_GT(carry(near_, far_), 0U);
  }
  int reads = 0;
  for (std::uint8_t byte = 0; ::recv(server_->fd(), &byte, 1, MSG_PEEK) == 1; ++reads) {
    ASSERT_TRUE(server_->wait_readable(device_now())) << "whoever waits is told that there is more";
    ASSERT_EQ(*read(*server_), Bytes());
  }
  EXPECT_EQ(reads, kNewKeys);
  ASSERT_EQ(::SSL_write(stranger.ssl.get(), "said", 4), 4);
  carry(near_, far_);
  EXPECT_EQ(*read(*server_), (Bytes{'s', 'a', 'i', 'd'}));
}

TEST_F(Tls13, NewKeysWithoutEndEndIt) {
  connect();
  const std::shared_ptr<SSL_CTX> context(::SSL_CTX_new(::TLS_client_method()), ::SSL_CTX_free);
  const Scratch scratch;
  const std::string certificate = scratch.file("host.crt", host_.tls()->certificate());
  ASSERT_EQ(::SSL_CTX_use_certificate_file(context.get(), certificate.c_str(), SSL_FILETYPE_PEM), 1);
  ASSERT_EQ(::SSL_CTX_use_PrivateKey(context.get(), host_.key().evp_pkey()), 1);
  const Stranger stranger = shake_with(*context);
  ASSERT_TRUE(server_shook_ && *server_shook_);
  // More than OpenSSL takes up at once, so that there is a second portion to be refused.
  for (int i = 0; i < 200; ++i) {
    ASSERT_EQ(::SSL_key_update(stranger.ssl.get(), SSL_KEY_UPDATE_NOT_REQUESTED), 1);
    ASSERT_EQ(::SSL_do_handshake(stranger.ssl.get()), 1);
    ASSERT_GT(carry(near_, far_), 0U);
  }
  Result<Bytes> got = Bytes();
  for (int i = 0; i < 200 && got && got->empty(); ++i) got = read(*server_);
  ASSERT_FALSE(got);
  EXPECT_EQ(got.error().code, Errc::bad_format);
  EXPECT_NE(got.error().what.find("new keys without end"), std::string::npos) << got.error().what;
  std::array<std::uint8_t, 1> rest{};
  EXPECT_EQ(::recv(server_->fd(), rest.data(), rest.size(), MSG_PEEK), 1) << "it was not read to its end";
}

TEST_F(Tls13, ACertificateIsTheSameEachTime) {
  const auto again = Tls::make(cart_.key(), [](const PublicKey&) { return std::nullopt; });
  EXPECT_EQ((*again)->certificate(), cart_.tls()->certificate());
  EXPECT_NE(host_.tls()->certificate(), cart_.tls()->certificate());
  EXPECT_EQ(cart_.tls()->certificate().rfind("-----BEGIN CERTIFICATE-----\n", 0), 0U);
}

}  // namespace
}  // namespace birdseye::wire
