// What birdseyed says of a configuration and of itself, without an instrument.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/command.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::run;
using testing::Scratch;

TEST(BirdseyedCommand, TheCheckSaysThatARecordBoundToNothingWillNotBeUsed) {
  const Scratch scratch;
  const auto checked = [&scratch](const calibration::CalibrationRecord& record) {
    const std::string file = scratch.file("scope.json", testing::signed_record_text(record));
    return run("birdseyed",
               "--check --config " + scratch.file("c.toml",
                                                  "[tracker]\ndevice = \"/dev/ttyUSB0\"\n[camera]\n"
                                                  "source = \"v4l2:/dev/video0\"\n[calibration]\nrecord = \"" +
                                                      file + "\"\n"));
  };
  const auto unbound = checked(testing::straight_scope_record());
  EXPECT_EQ(unbound.code, 0) << unbound.output;
  EXPECT_THAT(unbound.output, HasSubstr("scope.json: the record does not say which tracker"));
  EXPECT_THAT(unbound.output, HasSubstr("birdseye calibrate record FILE --bind HOST"));
  EXPECT_THAT(unbound.output, HasSubstr("sound, but the record will not be used"));
  const auto bound = checked(testing::straight_scope_record(768, 576, {{"model", "a"}}, {{"model", "b"}}));
  EXPECT_EQ(bound.code, 0) << bound.output;
  EXPECT_THAT(bound.output, Not(HasSubstr("will not be used")));
}

TEST(BirdseyedCommand, HelpOfPairNamesWhatItNeeds) {
  const auto help = run("birdseyed", "pair --help");
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.output, HasSubstr("--config"));
}

}  // namespace
}  // namespace birdseye
