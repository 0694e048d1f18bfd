// Programs that nobody here wrote, against our server: the examples of Debian's openigtlink-examples, built as they
// come.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "device/wire/client.hpp"
#include "device/wire/server.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/child.hpp"
#include "tests/support/programs_folder.hpp"

namespace birdseye::wire {
namespace {

using testing::Child;
using ::testing::HasSubstr;

/// The peer, by itself or under the emulator that this test too runs in; then HOST PORT and what else it wants.
std::vector<std::string> peer(const char* name, int port, const std::vector<std::string>& more = {}) {
  std::vector<std::string> words;
  std::stringstream emulator(BIRDSEYE_EMULATOR);
  for (std::string word; emulator >> word;) words.push_back(word);
  words.insert(words.end(), {testing::programs_folder() + "/../peers/" + name, "127.0.0.1", std::to_string(port)});
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

const Transform<Tracker, Sensor> kScope(Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())),
                                        Eigen::Vector3d(301.5, -20.25, 111.125));
const Transform<Tracker, Sensor> kPointer(Eigen::Quaterniond(Eigen::AngleAxisd(-0.25, Eigen::Vector3d::UnitX())),
                                          Eigen::Vector3d(-7.5, 640, 12));

Birds birds() {
  return {{1'234'500'000'000}, {{"scope", kScope}, {"pointer", kPointer}}};
}

VideoFrame frame(int width, int height) {
  VideoFrame f;
  f.info.sequence = 42;
  f.info.acquired = {1'234'567'000'000};
  f.width_px = width;
  f.height_px = height;
  f.rgb = std::make_shared<const std::vector<std::uint8_t>>(static_cast<std::size_t>(width * height * 3), 99);
  return f;
}

/// The n-th matrix that the library's own print function wrote: four lines of four numbers, with commas between.
Eigen::Matrix4d matrix_in(const std::string& output, int n) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Constant(std::nan(""));
  std::stringstream lines(output);
  int rows = 0;
  for (std::string line; rows < 4 * (n + 1) && std::getline(lines, line);) {
    std::array<double, 4> row{};
    if (std::sscanf(line.c_str(), "%lf, %lf, %lf, %lf", &row[0], &row[1], &row[2], &row[3]) != 4) continue;
    if (rows >= 4 * n) m.row(rows - 4 * n) = Eigen::RowVector4d(row.data());
    ++rows;
  }
  return m;
}

void wait_for_client(const Server& server) {
  const auto deadline = Deadline::after(Duration::from_ms(20'000));
  while (server.clients() == 0 && !deadline.passed()) sleep_for(Duration::from_ms(2));
  ASSERT_GT(server.clients(), 0U);
}

TEST(OpenIgtLinkPeer, AReceiverReadsPosesFramesStatusAndStrings) {
  auto server = *Server::listen("127.0.0.1", 0);
  Child client(peer("ReceiveClient", server->port()));
  wait_for_client(*server);
  Health health;
  health.tracker_rate_hz = 103.25;
  server->publish(pack(birds(), {}, true));
  server->publish(pack(frame(320, 200)));
  server->publish(pack(Status{false, "the tracker has gone"}, {1}));
  server->publish(pack(health, {1'234'567'890'000}));
  EXPECT_TRUE(
      client.says({"TDATA", "IMAGE", "the tracker has gone", "103.25"}, Deadline::after(Duration::from_ms(20'000))));
  server.reset();  // it writes its matrices out when it ends
  EXPECT_EQ(client.exit_code(Deadline::after(Duration::from_ms(20'000))), 0);

  const std::string& said = client.output();
  SCOPED_TRACE(said);
  EXPECT_THAT(said, HasSubstr("Time stamp: 1234.500000000"));
  EXPECT_THAT(said, HasSubstr(" Name       : scope\n Type       : 2\n"));
  EXPECT_THAT(said, HasSubstr(" Name       : pointer\n"));
  EXPECT_LT((matrix_in(said, 0) - kScope.matrix()).cwiseAbs().maxCoeff(), 1e-3);  // six digits are printed
  EXPECT_LT((matrix_in(said, 1) - kPointer.matrix()).cwiseAbs().maxCoeff(), 1e-3);
  // Each bird again as a TRANSFORM, after TDATA.
  EXPECT_THAT(said, HasSubstr("Receiving TRANSFORM data type."));
  EXPECT_LT((matrix_in(said, 2) - kScope.matrix()).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT((matrix_in(said, 3) - kPointer.matrix()).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_THAT(said, HasSubstr("Device Name           : Laparoscope\nScalar Type           : 3\n"
                              "Dimensions            : (320, 200, 1)\n"));
  EXPECT_THAT(said, HasSubstr(" Code      : 13\n"));  // not ready
  EXPECT_THAT(said, HasSubstr(" Status    : the tracker has gone\n"));
  EXPECT_THAT(said, HasSubstr("\"sequence\":42"));
}

TEST(OpenIgtLinkPeer, ATrackingClientStartsReadsAndStops) {
  auto server = *Server::listen("127.0.0.1", 0);
  Child client(peer("TrackingDataClient", server->port(), {"50"}));
  wait_for_client(*server);
  // It asks for poses at 50 Hz and, after ten messages of whatever kind, for no more; between them come kinds that it
  // does not know, a frame among them.
  server->publish(pack(frame(64, 48)));
  const auto deadline = Deadline::after(Duration::from_ms(20'000));
  const std::vector<std::string> both{"Receiving TDATA data type.", "STP_TDATA"};
  while (!client.says(both, Deadline::after(Duration::from_ms(25))) && !deadline.passed()) {
    server->publish(pack(birds()));
    server->publish(pack(Status{true, ""}, {1}));
  }
  client.until_quiet(Duration::from_ms(300));
  server.reset();
  EXPECT_EQ(client.exit_code(Deadline::after(Duration::from_ms(20'000))), 0);

  const std::string& said = client.output();
  SCOPED_TRACE(said);
  EXPECT_THAT(said, HasSubstr("Sending STT_TDATA message....."));
  EXPECT_THAT(said, HasSubstr("Receiving : IMAGE"));
  EXPECT_THAT(said, HasSubstr("Receiving : STATUS"));
  EXPECT_THAT(said, HasSubstr("Sending STP_TDATA message....."));
  EXPECT_THAT(said, HasSubstr(" Name       : pointer\n"));
  EXPECT_LT((matrix_in(said, 0) - kScope.matrix()).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT((matrix_in(said, 1) - kPointer.matrix()).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(OpenIgtLinkPeer, ThoseThatOnlySpeakAreHeardOutAndHarmNobody) {
  // They take our server for one that displays what they send, and never read: transforms at 200 Hz, and a status.
  auto server = *Server::listen("127.0.0.1", 0);
  Child tracker(peer("TrackerClient", server->port(), {"200"}));
  Child status(peer("StatusClient", server->port()));
  const auto deadline = Deadline::after(Duration::from_ms(20'000));
  while (server->clients() < 2 && !deadline.passed()) sleep_for(Duration::from_ms(2));
  ASSERT_EQ(server->clients(), 2U);
  const auto ours = Client::connect("127.0.0.1", server->port(), deadline);
  ASSERT_TRUE(ours);
  while (server->clients() < 3 && !deadline.passed()) sleep_for(Duration::from_ms(2));
  for (int i = 0; i < 20; ++i) {
    server->publish(pack(birds()));
    const auto event = (*ours)->next(deadline);
    ASSERT_TRUE(event && *event);
    EXPECT_EQ(std::get<Birds>(**event).birds.size(), 2U);
    sleep_for(Duration::from_ms(10));
  }
}

}  // namespace
}  // namespace birdseye::wire
