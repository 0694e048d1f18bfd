#include "host/confine/confinement.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <new>
#include <string>
#include <vector>

#include "host/confine/isolated.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::Scratch;

constexpr Duration kLong = Duration::from_ms(60'000);

/// The errno of what is tried in a copy that is confined to the input; 0 where it was done.
template <typename Try>
int errno_of(const fs::path& input, const Try& attempt) {
  int came = -1;
  const auto ran = run_isolated(
      [&](const Send& send) {
        confine_to(input);
        errno = 0;
        const int failed = attempt() < 0 ? errno : 0;
        send(&failed, sizeof failed);
      },
      [&](const Receive& receive) { (void)receive(&came, sizeof came); }, kLong);
  EXPECT_TRUE(ran) << ran.error().what;
  return came;
}

/// What the kernel of this machine holds a confined process to.
Confinement here(const fs::path& input) {
  Confinement came;
  const auto ran = run_isolated(
      [&](const Send& send) {
        const Confinement confinement = confine_to(input);
        send(&confinement, sizeof confinement);
      },
      [&](const Receive& receive) { (void)receive(&came, sizeof came); }, kLong);
  EXPECT_TRUE(ran) << ran.error().what;
  return came;
}

void write(const fs::path& path, std::size_t bytes) {
  std::ofstream(path) << std::string(bytes, 'x');
}

class Confined : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(scratch_ / "export/inner");
    fs::create_directories(scratch_ / "elsewhere");
    write(input() / "inner/slice", 100);
    write(elsewhere(), 100);
    if (!here(input()).system_calls) GTEST_SKIP() << "this kernel has no seccomp filters";
  }
  [[nodiscard]] fs::path input() const { return scratch_ / "export"; }
  [[nodiscard]] fs::path elsewhere() const { return scratch_ / "elsewhere/secret"; }

  const Scratch scratch_;
};

TEST_F(Confined, ReadsItsInput) {
  EXPECT_EQ(errno_of(input(), [&] { return ::open((input() / "inner/slice").c_str(), O_RDONLY); }), 0);
  EXPECT_EQ(errno_of(input() / "inner/slice", [&] { return ::open((input() / "inner/slice").c_str(), O_RDONLY); }), 0);
}

TEST_F(Confined, ReadsWhatALinkOfItsInputLeadsTo) {
  fs::create_symlink(elsewhere(), input() / "link");
  EXPECT_EQ(errno_of(input(), [&] { return ::open((input() / "link").c_str(), O_RDONLY); }), 0);
}

TEST_F(Confined, ReadsNothingElseOfAPerson) {
  if (!here(input()).files) GTEST_SKIP() << "this kernel has no Landlock";
  EXPECT_EQ(errno_of(input(), [&] { return ::open(elsewhere().c_str(), O_RDONLY); }), EACCES);
  EXPECT_EQ(errno_of(input(), [] { return ::open("/etc/passwd", O_RDONLY); }), EACCES);
}

TEST_F(Confined, WritesAndRemovesNothing) {
  EXPECT_EQ(errno_of(input(), [&] { return ::open((input() / "new").c_str(), O_WRONLY | O_CREAT, 0600); }), EPERM);
  EXPECT_EQ(errno_of(input(), [&] { return ::open((input() / "inner/slice").c_str(), O_RDWR); }), EPERM);
  EXPECT_EQ(errno_of(input(), [&] { return ::unlink((input() / "inner/slice").c_str()); }), EPERM);
  EXPECT_EQ(errno_of(input(), [&] { return ::rename((input() / "inner").c_str(), (input() / "outer").c_str()); }),
            EPERM);
  EXPECT_TRUE(fs::exists(input() / "inner/slice"));
}

TEST_F(Confined, OpensNoSocketAndStartsNoProgram) {
  EXPECT_EQ(errno_of(input(), [] { return ::socket(AF_INET, SOCK_STREAM, 0); }), EPERM);
  EXPECT_EQ(errno_of(input(), [] { return ::socket(AF_UNIX, SOCK_STREAM, 0); }), EPERM);
  EXPECT_EQ(errno_of(input(), [] { return ::execl("/bin/true", "true", nullptr); }), EPERM);
  EXPECT_EQ(errno_of(input(), [] { return ::kill(::getppid(), 0); }), EPERM);
}

TEST_F(Confined, HoldsNoFileThatWasOpenBefore) {
  const int open_before = ::open(elsewhere().c_str(), O_RDWR);
  ASSERT_GE(open_before, 0);
  EXPECT_EQ(errno_of(input(), [open_before] { return static_cast<int>(::write(open_before, "y", 1)); }), EBADF);
  ::close(open_before);
}

/// What run_isolated says of work in a process that is confined to the input.
Error error_of(const fs::path& input, const std::function<void()>& work) {
  char byte = 0;
  const auto ran = run_isolated(
      [&](const Send& send) {
        confine_to(input);
        work();
        send("x", 1);
      },
      [&](const Receive& receive) { (void)receive(&byte, 1); }, kLong);
  return ran ? Error{Errc::bad_value, "it was done"} : ran.error();
}

TEST_F(Confined, HasMemoryForWhatItsInputCanUnpackTo) {
  const auto take_mib = [](std::size_t mib) {
    return [mib] {
      std::vector<char> taken(mib << 20U, 'x');
      if (taken[mib] != 'x') throw std::bad_alloc();
    };
  };
  EXPECT_THAT(error_of(input(), take_mib(100)).what, HasSubstr("was done"));
  EXPECT_THAT(error_of(input(), take_mib(400)).what, HasSubstr("gave up"));
  write(input() / "larger", 200'000);  // 600 MB more
  EXPECT_THAT(error_of(input(), take_mib(400)).what, HasSubstr("was done"));
}

double processor_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void work_for(double seconds) {
  for (const double end_s = processor_s() + seconds; processor_s() < end_s;) continue;
}

TEST_F(Confined, HasTheProcessorForAsLongAsItsInputJustifies) {
  EXPECT_THAT(error_of(input(), [] { work_for(60); }).what, HasSubstr("signal 24 (CPU time limit exceeded)"));
}

TEST_F(Confined, HasLessThanASecondOfTheProcessorBeyondThat) {
  double left_s = 0;
  const auto ran = run_isolated(
      [&](const Send& send) {
        work_for(0.3);
        confine_to(input());
        rlimit limit{};
        (void)::getrlimit(RLIMIT_CPU, &limit);
        const double left = static_cast<double>(limit.rlim_cur) - processor_s();
        send(&left, sizeof left);
      },
      [&](const Receive& receive) { (void)receive(&left_s, sizeof left_s); }, kLong);
  ASSERT_TRUE(ran) << ran.error().what;
  const double allowed_s = allowance_of(readable_for(input()).bytes).processor_time.seconds();
  EXPECT_GT(left_s, allowed_s - 0.5) << "what it took to confine itself is off it already";
  EXPECT_LT(left_s, allowed_s + 1);
}

TEST_F(Confined, HasTimeForEachOfItsFiles) {
  const fs::path slice = input() / "inner/slice";
  const auto one_after_another = [&slice] {
    for (int i = 0; i < 4; ++i) {
      allow_time_for(slice);
      work_for(1.5);
    }
  };
  EXPECT_THAT(error_of(input(), one_after_another).what, HasSubstr("was done"));
}

TEST_F(Confined, EndsByAnAssertionInAWordOfItsOwn) {
  EXPECT_THAT(error_of(input(), [] { std::abort(); }).what, HasSubstr("signal 6 (Aborted)"));
}

TEST_F(Confined, HasCopiesThatAreConfinedToo) {
  int came = -1;
  const auto ran = run_isolated(
      [&](const Send& send) {
        confine_to(input());
        auto copy = ProcessCopy::start([](const ProcessCopy::Send& inner) {
          const int failed = ::socket(AF_INET, SOCK_STREAM, 0) < 0 ? errno : 0;
          inner(&failed, sizeof failed);
        });
        int failed = -1;
        if (copy) (void)copy->receive(&failed, sizeof failed, Deadline::after(kLong));
        send(&failed, sizeof failed);
      },
      [&](const Receive& receive) { (void)receive(&came, sizeof came); }, kLong);
  ASSERT_TRUE(ran) << ran.error().what;
  EXPECT_EQ(came, EPERM);
}

TEST_F(Confined, OfAHeaderTheFilesBesideItCount) {
  write(scratch_ / "ct.mhd", 200);
  write(scratch_ / "ct.raw", 5000);
  write(scratch_ / "ct.mha", 300);
  fs::create_symlink(elsewhere(), scratch_ / "link.raw");
  EXPECT_EQ(readable_for(scratch_ / "ct.mha").bytes, 300U);
  EXPECT_EQ(readable_for(scratch_ / "ct.mhd").bytes, 200U + 5000U + 300U + 100U);
  EXPECT_EQ(errno_of(scratch_ / "ct.mhd", [&] { return ::open((scratch_ / "link.raw").c_str(), O_RDONLY); }), 0);
}

TEST(Allowance, GrowsWithTheBytesAndHasAFloor) {
  EXPECT_EQ(allowance_of(0).processor_time, Duration::from_ms(2000));
  EXPECT_NEAR(allowance_of(1'000'000).processor_time.seconds(), 12.82, 1e-6);
  EXPECT_NEAR(allowance_of(100'000'000).processor_time.seconds(), 72, 1e-6);
  EXPECT_EQ(allowance_of(0).memory_bytes, 256U << 20U);
  EXPECT_EQ(allowance_of(1000).memory_bytes - allowance_of(0).memory_bytes, 3U * 1032U * 1000U);
  EXPECT_GT(allowance_of(~std::uintmax_t{0}).memory_bytes, std::uintmax_t{1} << 40U);
}

}  // namespace
}  // namespace birdseye::host
