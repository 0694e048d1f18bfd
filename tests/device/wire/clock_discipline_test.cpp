#include <gtest/gtest.h>
#include <sys/timex.h>

#include <string>

#include "device/wire/clock_discipline.hpp"

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

}  // namespace
}  // namespace birdseye::wire
