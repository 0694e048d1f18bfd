// Who a server lets in, how, and what those who begin to come in and do not go on take from the others.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <list>
#include <string>
#include <utility>
#include <vector>

#include "device/wire/client.hpp"
#include "device/wire/handshake_limits.hpp"
#include "device/wire/refusal_log.hpp"
#include "device/wire/server.hpp"
#include "device/wire/tcp_link.hpp"
#include "device/wire/tls_link.hpp"
#include "tests/support/connection_from.hpp"
#include "tests/support/tls_machine.hpp"

namespace birdseye::wire {
namespace {

using testing::connection;
using testing::is_put_out;
using testing::is_served;
using testing::soon;

constexpr const char *kHere = "127.0.0.1", *kThere = "127.0.0.2", *kElsewhere = "127.0.0.3";

class AdmittedServer : public ::testing::Test {
 protected:
  void SetUp() override {
    cart_.knows(host_);
    host_.knows(cart_);
  }
  /// Of this machine's own addresses one is this machine to the server, and the others are others.
  void listen(Admission admission) {
    admission.is_local = [](const std::string& address) { return address == kHere; };
    server_ = *Server::listen(kHere, 0, std::move(admission));
    server_->publish(pack(Status{true, "ready"}, {1}));
  }
  void listen_by_tls(bool allow_plain = false) { listen({.tls = cart_.tls(), .allow_plain = allow_plain}); }
  [[nodiscard]] UniqueFd from(const char* host) const { return connection(host, server_->port()); }
  [[nodiscard]] Result<std::unique_ptr<Link>> by_tls(const char* host) const {
    UniqueFd fd = from(host);
    ::fcntl(fd.get(), F_SETFL, O_NONBLOCK);
    return shake_hands(*TlsLink::over(std::move(fd), host_.tls(), TlsLink::Side::client), host, soon());
  }
  static std::string first_word(Result<std::unique_ptr<Link>> link) {
    if (!link) return link.error().what;
    const auto client = Client::over(*std::move(link), "cart");
    const auto event = client->next(soon());
    return event && *event ? std::get<Status>(**event).text : "nothing";
  }

  testing::TlsMachine cart_, host_;
  std::unique_ptr<Server> server_;
};

TEST_F(AdmittedServer, WithoutATlsOnlyThisMachineIsLetIn) {
  listen({});
  EXPECT_TRUE(is_put_out(from(kThere)));
  EXPECT_TRUE(is_served(from(kHere)));
}

TEST_F(AdmittedServer, AnotherMachineIsLetInByTlsAlone) {
  listen_by_tls();
  EXPECT_EQ(first_word(by_tls(kThere)), "ready");
  EXPECT_TRUE(is_served(from(kHere))) << "and this one without";
  const UniqueFd plain = from(kThere);
  const auto question = pack_status_request().bytes();
  (void)::send(plain.get(), question.data(), question.size(), MSG_NOSIGNAL);
  EXPECT_TRUE(is_put_out(plain));
}

TEST_F(AdmittedServer, AMachineThatIsNotKnownIsToldSo) {
  cart_.forgets(host_);
  listen_by_tls();
  EXPECT_EQ(first_word(by_tls(kThere)), "127.0.0.2: it does not know this machine's key");
  EXPECT_EQ(server_->clients(), 0U);
}

TEST_F(AdmittedServer, WhoBeginsAHandshakeAndStopsIsPutOutAndTakesNoPlace) {
  listen({.tls = cart_.tls(), .patience = Duration::from_ms(50)});
  const std::array<std::uint8_t, 3> begun{22, 3, 1};
  const UniqueFd half = from(kThere);
  ASSERT_EQ(::send(half.get(), begun.data(), begun.size(), MSG_NOSIGNAL), 3);
  EXPECT_TRUE(is_put_out(half));
  EXPECT_TRUE(is_put_out(from(kThere))) << "who says nothing too";
  EXPECT_EQ(server_->take_counters().clients_shed, 0U);
}

TEST_F(AdmittedServer, ThoseWhoBeginHandshakesKeepNobodyOut) {
  listen({.tls = cart_.tls(), .patience = Duration::from_ms(600'000)});
  std::list<UniqueFd> begun;
  for (int machine = 0; machine < 40; ++machine) {
    const std::string host = "127.0.1." + std::to_string(machine + 1);
    for (int i = 0; i < 6; ++i) begun.push_back(from(host.c_str()));
  }
  EXPECT_EQ(first_word(by_tls(kThere)), "ready");
  EXPECT_TRUE(is_served(from(kHere)));
}

TEST_F(AdmittedServer, OneMachinesHandshakesAreBoundedInNumberAndRateAndNoOthers) {
  listen({.tls = cart_.tls(), .patience = Duration::from_ms(600'000)});
  std::list<UniqueFd> begun;
  for (int i = 0; i < 4; ++i) begun.push_back(from(kElsewhere));
  EXPECT_TRUE(is_put_out(from(kElsewhere)));
  begun.clear();
  int let_in = 0;
  // Without a bound this would go on to the end; within the rate it takes ten minutes.
  while (let_in < 3000 && by_tls(kElsewhere)) ++let_in;
  EXPECT_GT(let_in, 0);
  EXPECT_LT(let_in, 3000);
  EXPECT_EQ(first_word(by_tls(kThere)), "ready");
}

/// Some that are not let in, and what is told of the first of them.
class ToldServer : public AdmittedServer {
 protected:
  void listen_and_tell(Admission admission) {
    admission.tell_refused = [this](const std::string& line) { told_.push_back(line); };
    listen(std::move(admission));
  }
  /// Once the server, which tells, has ended.
  const std::vector<std::string>& told() {
    server_.reset();
    return told_;
  }

 private:
  std::vector<std::string> told_;
};

TEST_F(ToldServer, AMachineThatIsNotKnownIsToldOf) {
  cart_.forgets(host_);
  listen_and_tell({.tls = cart_.tls()});
  EXPECT_FALSE(by_tls(kThere));
  EXPECT_EQ(told(), std::vector<std::string>{"a connection from 127.0.0.2 was not let in: its key is not known here"});
}

TEST_F(ToldServer, WhoSpeaksOtherwiseIsToldOf) {
  listen_and_tell({.tls = cart_.tls()});
  const UniqueFd plain = from(kThere);
  const auto question = pack_status_request().bytes();
  (void)::send(plain.get(), question.data(), question.size(), MSG_NOSIGNAL);
  EXPECT_TRUE(is_put_out(plain));
  EXPECT_EQ(told(), std::vector<std::string>{"a connection from 127.0.0.2 was not let in: it does not speak TLS 1.3 as "
                                             "Birdseye does"});
}

TEST_F(ToldServer, WhoBeginsAHandshakeAndStopsIsToldOf) {
  listen_and_tell({.tls = cart_.tls(), .patience = Duration::from_ms(50)});
  EXPECT_TRUE(is_put_out(from(kThere)));
  EXPECT_EQ(told(),
            std::vector<std::string>{"a connection from 127.0.0.2 was not let in: its handshake was not done in "
                                     "time"});
}

TEST_F(ToldServer, WhoHasTooManyHandshakesIsToldOf) {
  listen_and_tell({.tls = cart_.tls(), .patience = Duration::from_ms(600'000)});
  std::list<UniqueFd> begun;
  for (int i = 0; i < 4; ++i) begun.push_back(from(kElsewhere));
  EXPECT_TRUE(is_put_out(from(kElsewhere)));
  EXPECT_EQ(told(),
            std::vector<std::string>{"a connection from 127.0.0.3 was not let in: it has 4 handshakes that are not "
                                     "done"});
}

TEST_F(ToldServer, WhereThereIsNoTlsOtherMachinesAreToldOf) {
  listen_and_tell({});
  EXPECT_TRUE(is_put_out(from(kThere)));
  EXPECT_EQ(told(),
            std::vector<std::string>{"a connection from 127.0.0.2 was not let in: programs of this machine alone "
                                     "are let in"});
}

TEST_F(ToldServer, NobodyWhoIsLetInIsToldOf) {
  listen_and_tell({.tls = cart_.tls()});
  EXPECT_EQ(first_word(by_tls(kThere)), "ready");
  EXPECT_TRUE(is_served(from(kHere)));
  EXPECT_EQ(told(), std::vector<std::string>{});
}

TEST(RefusalLog, TellsTheFirstAtOnceAndThoseAfterItTogether) {
  std::vector<std::string> told;
  RefusalLog log([&](const std::string& line) { told.push_back(line); });
  const DeviceTime begin{1'000'000'000};
  log.note("10.0.0.7", "its key is not known here", begin);
  EXPECT_EQ(told, std::vector<std::string>{"a connection from 10.0.0.7 was not let in: its key is not known here"});
  log.note("10.0.0.7", "its key is not known here", begin + Duration::from_ms(1));
  log.note("10.0.0.8", "its key is not known here", begin + Duration::from_ms(2));
  log.note("10.0.0.9", "it shows no key", begin + Duration::from_ms(3));
  log.tell_due(begin + RefusalLog::kApart - Duration{1});
  EXPECT_EQ(told.size(), 1U);
  log.tell_due(begin + RefusalLog::kApart);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told.back(),
            "3 more connections were not let in: it shows no key (1, the last from 10.0.0.9); its key is not known "
            "here (2, the last from 10.0.0.8)");
  log.tell_due(begin + RefusalLog::kApart + RefusalLog::kApart);
  EXPECT_EQ(told.size(), 2U) << "there is nothing more to tell";
}

TEST(RefusalLog, AFloodIsAFewLinesThatCountAll) {
  std::vector<std::string> told;
  RefusalLog log([&](const std::string& line) { told.push_back(line); });
  DeviceTime now{1'000'000'000};
  for (int i = 0; i < 30'000; ++i) {
    log.note("10.0.0." + std::to_string(i % 200), "its key is not known here", now);
    now = now + Duration::from_ms(1);
  }
  ASSERT_EQ(told.size(), 3U) << "in half a minute";
  EXPECT_EQ(told.back().rfind("10000 more connections were not let in: ", 0), 0U) << told.back();
}

TEST(RefusalLog, WhereNobodyIsToldNothingIsKept) {
  RefusalLog log({});
  log.note("10.0.0.7", "it shows no key", {1'000'000'000});
  log.tell_due(DeviceTime{1'000'000'000} + RefusalLog::kApart);
}

TEST(CheckBind, TakesNoPortAndRefusesWhatIsNoneOfThisMachines) {
  EXPECT_TRUE(check_bind(kHere));
  EXPECT_TRUE(check_bind("0.0.0.0"));
  const auto held = *listen_tcp(kHere, 0);
  EXPECT_TRUE(check_bind(kHere)) << "also where a server listens";
  const auto checked = check_bind("203.0.113.7");  // of a network for examples (RFC 5737)
  ASSERT_FALSE(checked);
  EXPECT_NE(checked.error().what.find("[wire] bind 203.0.113.7: this machine has no such address"), std::string::npos)
      << checked.error().what;
  const auto listened = listen_tcp("203.0.113.7", 0);
  ASSERT_FALSE(listened);
  EXPECT_EQ(listened.error().what, checked.error().what);
}

TEST(HandshakeLimits, AMachineThatHasToWaitIsNotFreedByManyOthers) {
  HandshakeLimits limits(Duration::from_ms(200), 10, 64);
  const DeviceTime now{1'000'000'000};
  while (limits.pass("one", now)) continue;
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(limits.pass("other " + std::to_string(i), now)) << i;
  EXPECT_FALSE(limits.pass("one", now));
  EXPECT_TRUE(limits.pass("one", now + Duration::from_ms(200))) << "its own turn comes as ever";
}

TEST(HandshakeLimits, WhereAllHaveToWaitSoHasANewMachine) {
  HandshakeLimits limits(Duration::from_ms(200), 10, 64);
  const DeviceTime now{1'000'000'000};
  for (int i = 0; i < 64; ++i) {
    while (limits.pass("one of many " + std::to_string(i), now)) continue;
  }
  EXPECT_FALSE(limits.pass("new", now));
  EXPECT_TRUE(limits.pass("new", now + Duration::from_ms(200)));
}

TEST(HandshakeLimits, OfTwoThatNeedNotWaitTheOneWithLessBehindItIsForgotten) {
  HandshakeLimits limits(Duration::from_ms(200), 10, 2);
  const DeviceTime now{1'000'000'000};
  for (int i = 0; i < 9; ++i) EXPECT_TRUE(limits.pass("busy", now));
  EXPECT_TRUE(limits.pass("other", now));
  EXPECT_TRUE(limits.pass("new", now));
  EXPECT_TRUE(limits.pass("busy", now));
  EXPECT_TRUE(limits.pass("busy", now));
  EXPECT_FALSE(limits.pass("busy", now)) << "all eleven of its own count";
}

TEST_F(AdmittedServer, ManyHandshakesAtOnceAreGoneOnWithAFewAtATime) {
  const auto listener = *listen_tcp(kHere, 0, {.tls = cart_.tls(), .is_local = [](const auto&) { return false; }});
  std::list<std::unique_ptr<TlsLink>> hosts;
  for (int i = 0; i < 12; ++i) {
    UniqueFd fd =
        connection(std::array{kHere, kThere, kElsewhere}.at(static_cast<std::size_t>(i % 3)), listener->port());
    ::fcntl(fd.get(), F_SETFL, O_NONBLOCK);
    hosts.push_back(*TlsLink::over(std::move(fd), host_.tls(), TlsLink::Side::client));
    ASSERT_TRUE(listener->wait({}, true, soon()));
    EXPECT_EQ(listener->accept(), nullptr);
  }
  for (const auto& host : hosts) EXPECT_TRUE(host->shake());
  (void)listener->wait({}, true, soon());
  const auto is_answered = [](const auto& host) { return wait_ready(host->fd(), POLLIN, device_now()) != 0; };
  const auto answered = std::ranges::count_if(hosts, is_answered);
  EXPECT_GT(answered, 0);
  EXPECT_LE(answered, 4);
  // All of them in the end.
  for (int i = 0; i < 12 && !std::ranges::all_of(hosts, is_answered); ++i) (void)listener->wait({}, true, soon());
  EXPECT_TRUE(std::ranges::all_of(hosts, is_answered));
}

TEST_F(AdmittedServer, WherePlainIsAllowedWhoSpeaksTlsStillDoes) {
  listen_by_tls(true);
  EXPECT_TRUE(is_served(from(kThere))) << "who says nothing";
  const UniqueFd asking = from(kThere);
  const auto question = pack_status_request().bytes();
  (void)::send(asking.get(), question.data(), question.size(), MSG_NOSIGNAL);
  EXPECT_TRUE(is_served(asking));
  EXPECT_EQ(first_word(by_tls(kThere)), "ready");
}

TEST_F(AdmittedServer, AWholeMessageLargerThanARecordComesThrough) {
  listen_by_tls();
  auto link = by_tls(kThere);
  ASSERT_TRUE(link) << link.error().what;
  const auto client = Client::over(*std::move(link), "cart");
  const auto pixels = std::make_shared<std::vector<std::uint8_t>>(1920 * 1080 * 3, std::uint8_t{7});
  VideoFrame frame;
  frame.width_px = 1920;
  frame.height_px = 1080;
  frame.rgb = pixels;
  for (int i = 0; i < 5; ++i) {
    frame.info.sequence = static_cast<std::uint64_t>(i);
    server_->publish(pack(frame));
    for (bool came = false; !came;) {
      const auto event = client->next(soon());
      ASSERT_TRUE(event && *event);
      const auto* const got = std::get_if<VideoFrame>(&**event);
      if (got == nullptr) continue;
      came = true;
      EXPECT_EQ(got->info.sequence, frame.info.sequence);
      EXPECT_EQ(*got->rgb, *pixels);
    }
  }
}

}  // namespace
}  // namespace birdseye::wire
