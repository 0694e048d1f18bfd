#include "drivers/system/crash_note.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

struct Ended {
  int by = 0;  ///< the signal
  std::string note;
};

/// Does work in a process of its own that keeps a note of crashes.
template <typename Work>
Ended ended_by(Work work) {
  const testing::Scratch scratch;
  const pid_t child = ::fork();
  if (child == 0) {
    if (CrashNote::keep_in(scratch / "note")) work();
    ::_exit(0);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  return {WIFSIGNALED(status) ? WTERMSIG(status) : 0, CrashNote::read(scratch / "note")};
}

template <typename Work>
void in_thread(const char* name, Work work) {
  std::thread([&] {
    name_this_thread(name);
    work();
  }).join();
}

TEST(CrashNote, SaysWhatTheThreadThatCrashedWasAtWorkOn) {
  const Ended ended = ended_by([] { in_thread("camera", [] { std::abort(); }); });
  EXPECT_EQ(ended.note, "camera");
  EXPECT_EQ(ended.by, SIGABRT) << "the process ends as it would have";
}

TEST(CrashNote, SaysItOfASignalToTheThread) {
  const Ended ended = ended_by([] { in_thread("tracker", [] { ::raise(SIGSEGV); }); });
  EXPECT_EQ(ended.note, "tracker");
  EXPECT_EQ(ended.by, SIGSEGV);
}

TEST(CrashNote, SaysItOfAnExceptionThatNobodyCatches) {
  const Ended ended = ended_by([] { in_thread("gpio", [] { throw 1; }); });
  EXPECT_EQ(ended.note, "gpio");
  EXPECT_EQ(ended.by, SIGABRT);
}

TEST(CrashNote, SaysWhatAThreadHasTurnedTo) {
  const auto note = [](const char* part) {
    return ended_by([part] {
             in_thread("messages", [part] {
               at_work_on(part);
               std::abort();
             });
           })
        .note;
  };
  EXPECT_EQ(note("camera"), "camera");
  EXPECT_EQ(note(nullptr), "");
}

TEST(CrashNote, IsNobodysWhereTheWholeProcessIsSignalled) {
  const Ended ended = ended_by([] {
    at_work_on("camera");
    ::kill(::getpid(), SIGABRT);  // as a service manager's watchdog does
    for (;;) ::pause();
  });
  EXPECT_EQ(ended.note, "");
  EXPECT_EQ(ended.by, SIGABRT);
}

TEST(CrashNote, KeepsWhatHangsWhenTheProcessIsEndedForIt) {
  const Ended ended = ended_by([] {
    CrashNote::write("gpio");
    CrashNote::write("camera");
    ::kill(::getpid(), SIGABRT);
  });
  EXPECT_EQ(ended.note, "camera");
  EXPECT_EQ(ended_by([] {
              CrashNote::write("camera");
              CrashNote::write("");  // it goes on
              ::kill(::getpid(), SIGKILL);
            }).note,
            "");
}

TEST(CrashNote, BeginsEmpty) {
  const testing::Scratch scratch;
  const std::string path = scratch.file("note", "camera");
  EXPECT_EQ(CrashNote::read(path), "camera");
  EXPECT_EQ(ended_by([&] {
              if (!CrashNote::keep_in(path)) ::_exit(1);
            }).by,
            0);
  EXPECT_EQ(CrashNote::read(path), "");
  EXPECT_EQ(CrashNote::read(scratch / "none"), "");
  EXPECT_FALSE(CrashNote::keep_in(scratch / "none" / "note"));
}

TEST(CrashNote, APipeIsRefusedAndNotWaitedForAndALinkIsNotFollowed) {
  const testing::Scratch scratch;
  const std::string pipe = scratch / "pipe", link = scratch / "link", other = scratch.file("other", "kept");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::filesystem::create_symlink(other, link);
  EXPECT_EQ(CrashNote::read(pipe), "");
  for (const std::string& path : {pipe, link, std::string(scratch / ".")}) {
    const auto kept = CrashNote::keep_in(path);
    ASSERT_FALSE(kept) << path;
    EXPECT_NE(kept.error().what.find("is no file"), std::string::npos) << kept.error().what;
  }
  EXPECT_EQ(std::filesystem::file_size(other), 4U);
}

}  // namespace
}  // namespace birdseye
