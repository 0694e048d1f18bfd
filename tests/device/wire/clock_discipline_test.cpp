#include <gtest/gtest.h>
#include <sys/timex.h>

#include <filesystem>
#include <fstream>

#include "device/wire/clock_discipline.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::wire {
namespace {

TEST(ClockDiscipline, IsDecodedFromTheKernelsWords) {
  timex reading{};
  reading.maxerror = 1500;  // us
  reading.esterror = 12;
  reading.tai = 37;
  const ClockDiscipline good = decode_discipline(reading, TIME_OK);
  EXPECT_TRUE(good.synchronised);
  EXPECT_EQ(good.max_error.ns, 1'500'000);
  EXPECT_EQ(good.est_error.ns, 12'000);
  EXPECT_TRUE(good.tai_known);
  EXPECT_NE(good.source.find("37 s"), std::string::npos);
  reading.status = STA_UNSYNC;
  EXPECT_FALSE(decode_discipline(reading, TIME_ERROR).synchronised);
  EXPECT_FALSE(decode_discipline(reading, TIME_OK).synchronised);
  reading.status = STA_PLL;
  EXPECT_FALSE(decode_discipline(reading, TIME_ERROR).synchronised);
  EXPECT_TRUE(decode_discipline(reading, TIME_INS).synchronised);
}

TEST(ClockDiscipline, FindsNetworkClocks) {
  const testing::Scratch scratch;
  for (const char* name : {"ptp1", "ptp0", "ptp", "ptp_kvm", "tty0"}) std::ofstream(scratch / name) << "";
  const auto devices = ptp_devices(scratch.path());
  ASSERT_EQ(devices.size(), 2U);
  EXPECT_EQ(devices[0], scratch / "ptp0");
  EXPECT_TRUE(ptp_devices("/nowhere").empty());
}

}  // namespace
}  // namespace birdseye::wire
