// Server and client over links of this process, without a socket: what they rest on is the interface alone.

#include "device/wire/link.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <string>

#include "device/wire/client.hpp"
#include "device/wire/server.hpp"
#include "device/wire/tcp_link.hpp"
#include "drivers/system/condition.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::wire {
namespace {

constexpr Duration kShort = Duration::from_ms(5), kLong = Duration::from_ms(60'000);

/// What all links of one listener share.
struct Hub {
  std::mutex mutex;
  Condition changed;
  std::deque<std::unique_ptr<Link>> calling;
  bool woken = false;
};

struct OneWay {
  std::deque<std::uint8_t> bytes;
  bool ended = false;
};

class LocalLink final : public Link {
 public:
  static constexpr std::size_t kHolds = 1000;  // so that packets go in parts

  LocalLink(std::shared_ptr<Hub> hub, std::shared_ptr<OneWay> in, std::shared_ptr<OneWay> out)
      : hub_(std::move(hub)), in_(std::move(in)), out_(std::move(out)) {}
  ~LocalLink() override {
    const std::lock_guard lock(hub_->mutex);
    in_->ended = out_->ended = true;
    hub_->changed.notify_all();
  }
  LocalLink(const LocalLink&) = delete;
  LocalLink& operator=(const LocalLink&) = delete;

  Result<std::size_t> read_some(std::span<std::uint8_t> into) override {
    const std::lock_guard lock(hub_->mutex);
    const std::size_t count = std::min(into.size(), in_->bytes.size());
    if (count == 0 && in_->ended) return Error{Errc::disconnected, "gone"};
    std::copy_n(in_->bytes.begin(), count, into.begin());
    in_->bytes.erase(in_->bytes.begin(), in_->bytes.begin() + static_cast<std::ptrdiff_t>(count));
    hub_->changed.notify_all();
    return count;
  }
  Result<std::size_t> write_some(std::span<const std::span<const std::uint8_t>> parts) override {
    const std::lock_guard lock(hub_->mutex);
    if (out_->ended) return Error{Errc::disconnected, "gone"};
    std::size_t put = 0;
    for (const auto& part : parts) {
      const std::size_t count = std::min(part.size(), kHolds - out_->bytes.size());
      out_->bytes.insert(out_->bytes.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(count));
      put += count;
    }
    hub_->changed.notify_all();
    return put;
  }
  bool wait_readable(Deadline deadline) override {
    std::unique_lock lock(hub_->mutex);
    return hub_->changed.wait(lock, deadline, [this] { return readable(); });
  }
  bool wait_writable(Deadline deadline) override {
    std::unique_lock lock(hub_->mutex);
    return hub_->changed.wait(lock, deadline, [this] { return writable(); });
  }
  [[nodiscard]] bool readable() const { return !in_->bytes.empty() || in_->ended; }
  [[nodiscard]] bool writable() const { return out_->bytes.size() < kHolds || out_->ended; }

 private:
  std::shared_ptr<Hub> hub_;
  std::shared_ptr<OneWay> in_, out_;
};

class LocalListener final : public Listener {
 public:
  explicit LocalListener(std::shared_ptr<Hub> hub) : hub_(std::move(hub)) {}

  bool wait(std::span<LinkWatch> links, Deadline deadline) override {
    std::unique_lock lock(hub_->mutex);
    hub_->changed.wait(lock, deadline, [&] {
      bool ready = hub_->woken || !hub_->calling.empty();
      for (LinkWatch& watch : links) {
        const auto& link = *static_cast<const LocalLink*>(watch.link);
        watch.readable = link.readable();
        ready = ready || watch.readable || (watch.to_write && link.writable());
      }
      return ready;
    });
    hub_->woken = false;
    return !hub_->calling.empty();
  }
  std::unique_ptr<Link> accept() override {
    const std::lock_guard lock(hub_->mutex);
    auto link = std::move(hub_->calling.front());
    hub_->calling.pop_front();
    return link;
  }
  void wake() override {
    const std::lock_guard lock(hub_->mutex);
    hub_->woken = true;
    hub_->changed.notify_all();
  }
  [[nodiscard]] int port() const override { return 0; }

 private:
  std::shared_ptr<Hub> hub_;
};

std::unique_ptr<Client> call(const std::shared_ptr<Hub>& hub) {
  const auto up = std::make_shared<OneWay>(), down = std::make_shared<OneWay>();
  const std::lock_guard lock(hub->mutex);
  hub->calling.push_back(std::make_unique<LocalLink>(hub, up, down));
  hub->changed.notify_all();
  return Client::over(std::make_unique<LocalLink>(hub, down, up), "here");
}

void wait_for_clients(const Server& server, std::size_t count) {
  for (const Deadline end = Deadline::after(kLong); server.clients() != count && !end.passed();)
    sleep_for(Duration::from_ms(1));
  ASSERT_EQ(server.clients(), count);
}

Packet status(const std::string& text) {
  return pack(Status{.ok = true, .text = text}, DeviceTime{1});
}

TEST(Link, TheWireRunsWithinOneProcess) {
  const auto hub = std::make_shared<Hub>();
  const auto server = Server::over(std::make_unique<LocalListener>(hub));
  auto client = call(hub);
  wait_for_clients(*server, 1);
  const std::string text(900, 'x');  // with its head more than a link holds
  server->publish(status(text));
  const auto event = client->next(Deadline::after(kLong));
  ASSERT_TRUE(event && *event);
  EXPECT_EQ(std::get<Status>(**event).text, text);
  EXPECT_FALSE(*client->next(Deadline::after(kShort)));
  client.reset();
  wait_for_clients(*server, 0);
}

TEST(Link, AServerThatGoesIsDisconnected) {
  const auto hub = std::make_shared<Hub>();
  auto server = Server::over(std::make_unique<LocalListener>(hub));
  const auto client = call(hub);
  wait_for_clients(*server, 1);
  server.reset();
  EXPECT_EQ(client->next(Deadline::after(kLong)).error().code, Errc::disconnected);
}

TEST(Link, OfTcpCarriesWhatItHasTakenAndSaysWhenTheOtherSideHasGone) {
  const auto listener = *listen_tcp("127.0.0.1", 0);
  std::span<LinkWatch> nobody;
  EXPECT_FALSE(listener->wait(nobody, Deadline::after(kShort)));
  auto here = *connect_tcp("127.0.0.1", listener->port(), Deadline::after(kLong));
  ASSERT_TRUE(listener->wait(nobody, Deadline::after(kLong)));
  auto there = listener->accept();
  ASSERT_TRUE(there);

  std::vector<std::uint8_t> got(100);
  EXPECT_EQ(*here->read_some(got), 0U);
  EXPECT_FALSE(here->wait_readable(Deadline::after(kShort)));
  const std::vector<std::uint8_t> head{1, 2, 3}, rest{4, 5};
  const std::array<std::span<const std::uint8_t>, 2> parts{head, rest};
  EXPECT_EQ(*there->write_some(parts), 5U);
  ASSERT_TRUE(here->wait_readable(Deadline::after(kLong)));
  got.resize(*here->read_some(got));
  EXPECT_EQ(got, (std::vector<std::uint8_t>{1, 2, 3, 4, 5}));

  LinkWatch watch{there.get(), true};
  listener->wake();
  listener->wait(std::span(&watch, 1), Deadline::after(kLong));
  EXPECT_FALSE(watch.readable || watch.broken);
  here.reset();
  ASSERT_TRUE(there->wait_readable(Deadline::after(kLong)));
  EXPECT_EQ(there->read_some(got).error().code, Errc::disconnected);
}

}  // namespace
}  // namespace birdseye::wire
