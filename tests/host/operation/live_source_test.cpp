// Where the window's events come from, when that cannot be had.
#include "host/operation/live_source.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using ::testing::HasSubstr;

/// Until it has been given up; false where that does not come.
bool gives_up(LiveSource& source) {
  for (int i = 0; i < 3000 && !source.may_retry(); ++i) (void)source.next(Deadline::after(Duration::from_ms(10)));
  return source.may_retry();
}

TEST(LiveSource, ASimulatedCartThatCannotBeStartedIsTriedAgainWhenAsked) {
  const birdseye::testing::Scratch scratch;
  SimulatedCartSettings settings;
  settings.folder = scratch.path();
  settings.ct = scratch / "no-such-ct";
  const auto source = LiveSource::of_simulator(settings);
  ASSERT_TRUE(gives_up(*source));
  EXPECT_FALSE(source->connected());
  EXPECT_THAT(source->words(), HasSubstr("no-such-ct"));
  source->retry();
  EXPECT_FALSE(source->may_retry());
  EXPECT_EQ(source->words(), "connecting to the simulated cart");
  ASSERT_TRUE(gives_up(*source)) << "it is still not there";
  EXPECT_THAT(source->words(), HasSubstr("no-such-ct"));
}

TEST(LiveSource, AServerThatDoesNotAnswerIsTriedAgainByItself) {
  const auto source = LiveSource::of_appliance("127.0.0.1:1");
  for (int i = 0; i < 3000 && source->words().find("nothing answers") == std::string::npos; ++i)
    (void)source->next(Deadline::after(Duration::from_ms(10)));
  EXPECT_THAT(source->words(), HasSubstr("nothing answers"));
  EXPECT_THAT(source->words(), HasSubstr("tried again every second"));
  EXPECT_FALSE(source->may_retry());
}

}  // namespace
}  // namespace birdseye::host
