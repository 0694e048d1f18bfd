#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>

#include "host/volume/import.hpp"
#include "host/volume/series_list.hpp"
#include "tests/support/child.hpp"
#include "tests/support/dicom_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;

using testing::Child;
using testing::Scratch;

/// A port of this machine that nobody listens on at the moment.
int free_port() {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool bound = ::bind(fd, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                     ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  ::close(fd);
  return bound ? ntohs(address.sin_port) : 0;
}

/// DCMTK's receiver in a folder, on a port that it answers on; another program may take a free port before it does.
struct Receiver {
  std::unique_ptr<Child> child;
  int port = 0;
};
Receiver start_receiver(const fs::path& folder) {
  for (int attempt = 0; attempt < 5; ++attempt) {
    Receiver receiver;
    receiver.port = free_port();
    const std::string port = std::to_string(receiver.port);
    receiver.child = std::make_unique<Child>(
        std::vector<std::string>{"storescp", "--aetitle", "BIRDSEYE", "--accept-all", "--output-directory",
                                 folder.string(), "--sort-on-study-uid", "study", port});
    const Deadline deadline = Deadline::after(Duration::from_ms(10'000));
    while (!deadline.passed()) {
      Child echo({"echoscu", "--timeout", "5", "--call", "BIRDSEYE", "127.0.0.1", port});
      if (echo.exit_code(deadline) == 0) return receiver;
      ::usleep(50'000);
    }
  }
  return {};
}

TEST(Pacs, WhatStorescpReceivesIsRead) {
  if (std::system("command -v storescp storescu echoscu > /dev/null") != 0)
    GTEST_SKIP() << "no storescp: install dcmtk";
  const Scratch scratch;
  testing::CtSlice native{"2.25.3", 3, 1, 1000, {0, 0, 0}, "Abdomen nativ"};
  testing::CtSlice portal{"2.25.4", 4, 1, 2000, {0, 0, 0}, "Abdomen pv"};
  testing::write_ct_series(scratch / "pacs/3", native, 6);
  testing::write_ct_series(scratch / "pacs/4", portal, 7, {}, EXS_RLELossless);
  testing::write_no_image(scratch / "pacs/sr.dcm", UID_BasicTextSRStorage, "SR", 20);
  fs::create_directory(scratch / "incoming");
  const Receiver receiver = start_receiver(scratch / "incoming");
  ASSERT_NE(receiver.child, nullptr) << "no storescp answers";
  const auto send = [&](const std::string& what, const std::string& syntax) {
    Child sender({"storescu", "--timeout", "10", "--scan-directories", "--recurse", syntax, "--call", "BIRDSEYE",
                  "127.0.0.1", std::to_string(receiver.port), (scratch / what).string()});
    EXPECT_EQ(sender.exit_code(Deadline::after(Duration::from_ms(60'000))), 0) << sender.output();
  };
  send("pacs/3", "--propose-little");
  send("pacs/4", "--propose-rle");
  Child report({"storescu", "--timeout", "10", "--call", "BIRDSEYE", "127.0.0.1", std::to_string(receiver.port),
                (scratch / "pacs/sr.dcm").string()});
  EXPECT_EQ(report.exit_code(Deadline::after(Duration::from_ms(60'000))), 0) << report.output();

  const auto list = list_series(VolumeSource(scratch / "incoming"));
  ASSERT_TRUE(list) << list.error().what;
  ASSERT_EQ(list->series.size(), 3U);
  EXPECT_TRUE(list->unreadable.empty());
  VolumeSource source(scratch / "incoming");
  source.series = "native";
  const auto first = import_volume(source);
  ASSERT_TRUE(first) << first.error().what;
  EXPECT_EQ(first->size[2], 6);
  EXPECT_EQ(first->at(0, 0, 5), 500);
  source.series = "portal venous";
  const auto second = import_volume(source);
  ASSERT_TRUE(second) << second.error().what;
  EXPECT_EQ(second->size[2], 7);
  EXPECT_EQ(second->at(3, 2, 6), 1611);
}

}  // namespace
}  // namespace birdseye::host
