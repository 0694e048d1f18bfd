#include "calibration/base/result.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace birdseye {
namespace {

Result<int> refused() {
  return Error{Errc::bad_value, "line 3: \"x\" is no number"};
}

TEST(Result, SaysOfWhatItsErrorIsAndKeepsTheCode) {
  const auto context = refused().with_context("poses.csv");
  ASSERT_FALSE(context);
  EXPECT_EQ(context.error().code, Errc::bad_value);
  EXPECT_EQ(context.error().what, "poses.csv: line 3: \"x\" is no number");
  EXPECT_EQ(context.error().with_context("left").what, "left: poses.csv: line 3: \"x\" is no number");

  const auto nothing = Result<void>(Error{Errc::io, "full"}).with_context("disk");
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, Errc::io);
  EXPECT_EQ(nothing.error().what, "disk: full");
}

TEST(Result, KeepsItsValueThroughAContext) {
  const auto value = Result<std::unique_ptr<int>>(std::make_unique<int>(7)).with_context("poses.csv");
  ASSERT_TRUE(value);
  EXPECT_EQ(**value, 7);
  EXPECT_TRUE(Result<void>().with_context("disk"));
}

}  // namespace
}  // namespace birdseye
