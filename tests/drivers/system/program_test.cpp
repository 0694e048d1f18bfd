#include "drivers/system/program.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <exception>

namespace birdseye {
namespace {

TEST(InOneLine, NothingOfAFileMovesATerminalsCursor) {
  EXPECT_EQ(in_one_line("-0.1\x1b[2J\n\t\x7f!"), "-0.1 [2J   !");
  EXPECT_EQ(in_one_line("left-\xC2\x9B"
                        "31m"),
            "left-  31m")
      << "a CSI of one character";
  EXPECT_EQ(in_one_line("Leber gr\xC3\xB6\xC3\x9F"
                        "er \xE2\x80\x93 \xF0\x9F\x90\xA6"),
            "Leber gr\xC3\xB6\xC3\x9F"
            "er \xE2\x80\x93 \xF0\x9F\x90\xA6");
  EXPECT_EQ(in_one_line("40\xB9"
                        "9 \xE2\x80 \xC3"),
            "40?9 ?? ?");
}

TEST(InOneLine, OfALongTextTheMiddleIsLeftOut) {
  EXPECT_EQ(in_one_line(std::string(2000, 'a')).size(), 2000U);
  const std::string cut = in_one_line("begin " + std::string(1 << 20, 'a') + " end");
  EXPECT_LT(cut.size(), 2100U);
  EXPECT_TRUE(cut.starts_with("begin aaa") && cut.ends_with("aaa end")) << cut;
  std::string accents;
  for (int i = 0; i < 3000; ++i) accents += "\xC3\xB6";
  EXPECT_EQ(in_one_line("x" + accents).find('?'), std::string::npos) << "no character is cut in two";
}

/// CLI11's App, as far as run_program() knows it.
struct AnyApp {
  static std::string get_name() { return "any"; }
  template <typename Message>
  static void failure_message(const Message& /*message*/) {}
  static void parse(int /*argc*/, char** /*argv*/) {}
  static int exit(const std::exception& /*error*/) { return 1; }
};
struct NeverThrown : std::exception {};

TEST(RunProgram, AFileBeyondTheLimitOnSizesIsAnErrorAndNoEnd) {
  const auto handler = ::signal(SIGXFSZ, SIG_DFL);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  std::string name = "/tmp/birdseye-test-XXXXXX";
  const int file = ::mkstemp(name.data());
  ASSERT_GE(file, 0);
  ::unlink(name.c_str());
  AnyApp app;
  const int code = run_program<NeverThrown>(app, 0, nullptr, [&] {
    const rlimit none{0, before.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &none), 0);
    const auto written = ::write(file, "a", 1);
    const int why = errno;
    ::setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_EQ(written, -1);
    EXPECT_EQ(why, EFBIG);
    return 7;
  });
  EXPECT_EQ(code, 7);
  ::close(file);
  ::signal(SIGXFSZ, handler);
}

}  // namespace
}  // namespace birdseye
