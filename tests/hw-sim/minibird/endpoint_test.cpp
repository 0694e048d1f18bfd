#include "hw-sim/minibird/endpoint.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>

#include "drivers/system/clock.hpp"
#include "drivers/system/unique_fd.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

UniqueFd connect_to_path(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  return ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? std::move(fd)
                                                                                               : UniqueFd();
}

UniqueFd connect_to_port(const std::string& name) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(name.substr(name.rfind(':') + 1))));
  UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  return ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? std::move(fd)
                                                                                               : UniqueFd();
}

/// What the endpoint has got, once it has that many bytes; fewer if they never come.
Bytes read_from(Endpoint& endpoint, std::size_t count) {
  Bytes all;
  for (int i = 0; i < 200 && all.size() < count; ++i) {
    const Bytes part = endpoint.read();
    all.insert(all.end(), part.begin(), part.end());
    if (all.size() < count) endpoint.wait(device_now().ns + 10'000'000);
  }
  return all;
}

Bytes read_from(int fd, std::size_t count) {
  Bytes all(count);
  std::size_t have = 0;
  while (have < count) {
    pollfd entry{fd, POLLIN, 0};
    if (::poll(&entry, 1, 2000) <= 0) break;
    const ssize_t got = ::read(fd, all.data() + have, count - have);
    if (got <= 0) break;
    have += static_cast<std::size_t>(got);
  }
  all.resize(have);
  return all;
}

void expect_talk(Endpoint& endpoint, const UniqueFd& host) {
  ASSERT_TRUE(host);
  const Bytes question{0x4F, 0x13, 0x11, 0x0D}, answer{0x00, 0xFF, 0x11, 0x0A};
  ASSERT_EQ(::write(host.get(), question.data(), question.size()), static_cast<ssize_t>(question.size()));
  EXPECT_EQ(read_from(endpoint, question.size()), question);
  EXPECT_TRUE(endpoint.connected());
  endpoint.write(answer);
  EXPECT_EQ(read_from(host.get(), answer.size()), answer);
}

/// One host after another, then the cable out and in, then another host.
template <typename Connect>
void expect_comes_back(Endpoint& endpoint, const Connect& connect) {
  for (int i = 0; i < 2; ++i) expect_talk(endpoint, connect());
  {
    const UniqueFd host = connect();
    expect_talk(endpoint, host);
    endpoint.unplug();
    EXPECT_FALSE(endpoint.connected());
    EXPECT_TRUE(read_from(host.get(), 1).empty());  // hung up on
    endpoint.write(Bytes{1});
    EXPECT_TRUE(endpoint.read().empty());
    EXPECT_FALSE(connect());
  }
  ASSERT_TRUE(endpoint.replug());
  expect_talk(endpoint, connect());
}

TEST(Endpoint, APseudoTerminalTakesOneDriverAfterAnother) {
  const testing::Scratch scratch;
  const auto endpoint = open_terminal(scratch / "tty");
  ASSERT_TRUE(endpoint) << endpoint.error().what;
  expect_comes_back(**endpoint, [&] { return UniqueFd(::open((*endpoint)->name().c_str(), O_RDWR | O_NOCTTY)); });
}

TEST(Endpoint, ATcpPortTakesOneDriverAfterAnother) {
  const auto endpoint = listen_tcp("0");
  ASSERT_TRUE(endpoint) << endpoint.error().what;
  const std::string name = (*endpoint)->name();
  expect_comes_back(**endpoint, [&] { return connect_to_port(name); });
}

TEST(Endpoint, AUnixSocketTakesOneDriverAfterAnother) {
  const testing::Scratch scratch;
  const std::string path = (scratch / "line").string();
  {
    const auto endpoint = listen_unix(path);
    ASSERT_TRUE(endpoint) << endpoint.error().what;
    expect_comes_back(**endpoint, [&] { return connect_to_path(path); });
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(Endpoint, SaysWhatCannotBeListenedAt) {
  const auto held = listen_tcp("127.0.0.1:0");
  ASSERT_TRUE(held);
  const auto again = listen_tcp((*held)->name());
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, Errc::in_use);
  for (const char* address : {"", "x", "70000", "127.0.0.1:", "nowhere:80", "1.2.3:80", "-1"}) {
    EXPECT_FALSE(listen_tcp(address)) << address;
  }
  EXPECT_EQ(listen_unix("/nonexistent/line").error().code, Errc::unreadable);
  EXPECT_EQ(listen_unix(std::string(200, 'x')).error().code, Errc::bad_value);
  EXPECT_EQ(open_terminal("/nonexistent/tty").error().code, Errc::unreadable);
}

TEST(Endpoint, ATerminalTakesThePlaceOfALinkToAnotherAndOfNothingElse) {
  namespace fs = std::filesystem;
  const testing::Scratch scratch;
  (void)scratch.file("file", "a user's");
  fs::create_symlink("file", scratch / "link");
  fs::create_symlink("none", scratch / "dangling");
  fs::create_directory(scratch / "folder");
  for (const char* name : {"file", "link", "dangling", "folder"}) {
    const auto refused = open_terminal(scratch / name);
    ASSERT_FALSE(refused) << name;
    EXPECT_NE(refused.error().what.find((scratch / name).string() + ": is in the way"), std::string::npos)
        << refused.error().what;
  }
  EXPECT_EQ(testing::contents_of(scratch / "file"), "a user's");
  EXPECT_EQ(fs::read_symlink(scratch / "link"), "file");
  EXPECT_EQ(fs::read_symlink(scratch / "dangling"), "none");

  fs::create_symlink("/dev/pts/9999", scratch / "tty");
  {
    const auto endpoint = open_terminal(scratch / "tty");
    ASSERT_TRUE(endpoint) << endpoint.error().what;
    EXPECT_NE(fs::read_symlink(scratch / "tty"), "/dev/pts/9999");
    fs::remove(scratch / "tty");
    fs::create_symlink("file", scratch / "tty");
  }
  EXPECT_EQ(fs::read_symlink(scratch / "tty"), "file") << "that one is another's";
}

}  // namespace
}  // namespace birdseye::hw_sim
