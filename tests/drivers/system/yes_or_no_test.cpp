#include "drivers/system/yes_or_no.hpp"

#include <gtest/gtest.h>
#include <pty.h>
#include <unistd.h>

#include <string_view>

#include "drivers/system/unique_fd.hpp"

namespace birdseye {
namespace {

/// A terminal in place of standard input.
class YesOrNo : public ::testing::Test {
 protected:
  void SetUp() override {
    int person = -1, program = -1;
    ASSERT_EQ(::openpty(&person, &program, nullptr, nullptr, nullptr), 0);
    person_ = UniqueFd(person);
    program_ = UniqueFd(program);
    ASSERT_EQ(::dup2(program_.get(), STDIN_FILENO), STDIN_FILENO);
  }
  void TearDown() override { ::dup2(before_.get(), STDIN_FILENO); }
  void types(std::string_view text) const {
    ASSERT_EQ(::write(person_.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }

  UniqueFd before_{::dup(STDIN_FILENO)}, person_, program_;
};

TEST_F(YesOrNo, WhatWasTypedBeforeTheQuestionIsNoAnswerToIt) {
  types("y\n");
  EXPECT_FALSE(says_yes(Deadline::after(Duration::from_ms(100))));
}

}  // namespace
}  // namespace birdseye
