#include <gtest/gtest.h>
#include <sys/timex.h>

#include <nlohmann/json.hpp>
#include <string>

#include "device/wire/clock_discipline.hpp"
#include "device/wire/json.hpp"

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
  reading.maxerror = reading.esterror = -5;  // as a daemon may have told the kernel
  EXPECT_FALSE(decode_discipline(reading, TIME_OK).synchronised);
  EXPECT_EQ(decode_discipline(reading, TIME_OK).max_error.ns, 0);
  EXPECT_EQ(decode_discipline(reading, TIME_OK).est_error.ns, 0);
}

/// An appliance whose wall clock was set to the year 2099 goes on serving.
TEST(WallClock, OneThatIsFarAwayIsNotKnown) {
  WallClock told{true, true, true, 1000, 100, 4'000'000'000'000'000'000, "kernel"};
  const auto far = nlohmann::json(told).get<WallClock>();
  EXPECT_FALSE(far.known || far.synchronised || far.tai_known);
  EXPECT_EQ(far.wall_minus_monotonic_ns, 0);
  told.wall_minus_monotonic_ns = 1'800'000'000'000'000'000;
  const auto near = nlohmann::json(told).get<WallClock>();
  EXPECT_TRUE(near.known && near.synchronised && near.tai_known);
  EXPECT_EQ(near.wall_minus_monotonic_ns, told.wall_minus_monotonic_ns);
}

}  // namespace
}  // namespace birdseye::wire
