#include <gtest/gtest.h>

#include "host/files/field_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

TEST(FieldHistory, NamesThatWouldMakeColumnsOrRemarksAreReadBackAsOneDayEach) {
  const testing::Scratch scratch;
  std::vector<calibration::FieldCheck> days(2);
  days[0].when = "#1, after lunch";
  days[0].worst_place = "left, 4 #2\n";
  days[1].when = "tuesday";
  days[1].worst_place = "divot 4";
  const auto read = read_history(scratch.file("history.csv", history_text(days)));
  ASSERT_TRUE(read) << read.error().what;
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[0].when, "-1--after-lunch");
  EXPECT_EQ((*read)[0].worst_place, "left- 4 -2-");
  EXPECT_EQ((*read)[1].worst_place, "divot 4");
}

}  // namespace
}  // namespace birdseye::host
