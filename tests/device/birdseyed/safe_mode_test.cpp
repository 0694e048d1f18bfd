#include "device/birdseyed/safe_mode.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "drivers/system/crash_note.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::device {
namespace {

using Parts = std::vector<std::string>;

constexpr DeviceTime at_s(std::int64_t seconds) {
  return {seconds * 1'000'000'000};
}

/// A run for each end: how long it lasted, and what ended it.
Parts left_out_after(const std::vector<std::pair<std::int64_t, std::string>>& ends) {
  DeviceTime now = at_s(100);
  RunMemory run{now.ns, {}, {}};
  for (const auto& [seconds, by] : ends) {
    now = now + Duration::from_ms(seconds * 1000);
    run = after_bad_end(run, by, now);
  }
  return run.left_out;
}

TEST(SafeMode, LeavesOutWhatEndedThreeRunsSoonAfterTheirStart) {
  EXPECT_EQ(left_out_after({{1, "camera"}, {1, "camera"}}), Parts{});
  EXPECT_EQ(left_out_after({{1, "camera"}, {1, "camera"}, {1, "camera"}}), Parts{"camera"});
  EXPECT_EQ(left_out_after({{37, "tracker"}, {37, "tracker"}, {37, "tracker"}}), Parts{"tracker"}) << "by the watchdog";
}

TEST(SafeMode, ARunThatWentOnForLongerThanThatBeginsTheCountAnew) {
  EXPECT_EQ(left_out_after({{1, "camera"}, {1, "camera"}, {121, "camera"}}), Parts{});
  EXPECT_EQ(left_out_after({{121, "camera"}, {121, "camera"}, {121, "camera"}, {121, "camera"}}), Parts{});
  EXPECT_EQ(left_out_after({{121, "camera"}, {1, "camera"}, {1, "camera"}}), Parts{"camera"})
      << "it counts as the first end of those that follow";
}

TEST(SafeMode, OneEndOfEachPartIsNoCrashLoopOfAny) {
  EXPECT_EQ(left_out_after({{1, "camera"}, {1, "tracker"}, {1, "gpio"}, {1, "camera"}, {1, "tracker"}}), Parts{});
  EXPECT_EQ(left_out_after({{1, "camera"}, {1, "tracker"}, {1, "camera"}, {1, "camera"}}), Parts{"camera"});
}

TEST(SafeMode, WhatNobodyKnowsLeavesNothingOut) {
  EXPECT_EQ(left_out_after({{1, ""}, {1, ""}, {1, ""}, {1, "messages"}, {1, "messages"}, {1, "messages"}}), Parts{});
}

TEST(SafeMode, WhatIsLeftOutStaysSoHoweverLongThatGoesWell) {
  const std::pair<std::int64_t, std::string> camera{1, "camera"}, tracker{1, "tracker"};
  EXPECT_EQ(left_out_after({camera, camera, camera, {5000, ""}}), Parts{"camera"});
  EXPECT_EQ(left_out_after({camera, camera, camera, tracker, tracker}), Parts{"camera"});
  EXPECT_EQ(left_out_after({camera, camera, camera, tracker, tracker, tracker}), (Parts{"camera", "tracker"}));
}

TEST(SafeMode, ItsMemoryIsReadAsItWasWritten) {
  const RunMemory run{123456789, {"camera", "recording"}, {"tracker"}};
  const auto read = parse_run_memory(text_of(run));
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, run);
  EXPECT_EQ(*parse_run_memory(text_of({5, {}, {}})), (RunMemory{5, {}, {}}));
}

TEST(SafeMode, AMemoryThatIsNotWholeIsNone) {
  const std::string whole = text_of({123456789, {"camera"}, {"tracker"}});
  for (std::size_t size = 0; size + 3 < whole.size(); ++size)
    EXPECT_FALSE(parse_run_memory(whole.substr(0, size))) << whole.substr(0, size);
  for (const char* text : {"", "began x\nwhole -\n", "ended camera\nwhole -\n", "began 1\nended window\nwhole -\n",
                           "began 1\nstarted camera\nwhole -\n"})
    EXPECT_FALSE(parse_run_memory(text)) << text;
}

/// What a run in that folder does without, which then ends: its camera crashes, or in order.
Parts run_in(const std::filesystem::path& folder, bool crashes) {
  const pid_t child = ::fork();
  if (child == 0) {
    SafeMode safe = SafeMode::begin(folder);
    if (crashes) {
      at_work_on("camera");
      std::abort();
    }
    safe.end_in_order();
    ::_exit(safe.left_out() == Parts{"camera"} ? 1 : safe.left_out().empty() ? 0 : 2);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  if (crashes) {
    EXPECT_TRUE(WIFSIGNALED(status));
    return {};
  }
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) < 2);
  return WEXITSTATUS(status) == 1 ? Parts{"camera"} : Parts{};
}

TEST(SafeMode, IsBegunByCrashesAndEndedByAnEndInOrder) {
  const testing::Scratch scratch;
  for (int i = 0; i < 3; ++i) run_in(scratch.path(), true);
  EXPECT_EQ(run_in(scratch.path(), false), Parts{"camera"});
  EXPECT_EQ(run_in(scratch.path(), false), Parts{});
}

TEST(SafeMode, AnEndInOrderBetweenCrashesBeginsTheCountAnew) {
  const testing::Scratch scratch;
  for (const bool crashes : {true, true, false, true, true}) run_in(scratch.path(), crashes);
  EXPECT_EQ(run_in(scratch.path(), false), Parts{});
}

TEST(SafeMode, WithoutAFolderNothingIsLeftOut) {
  SafeMode safe = SafeMode::begin("");
  safe.note_hang("camera");
  safe.end_in_order();
  EXPECT_EQ(safe.left_out(), Parts{});
  EXPECT_EQ(SafeMode::begin("/nowhere/at/all").left_out(), Parts{});
}

}  // namespace
}  // namespace birdseye::device
