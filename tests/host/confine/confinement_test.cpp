#include "host/confine/confinement.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <iterator>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "host/confine/isolated.hpp"
#include "host/confine/run_confined_to.hpp"
#include "tests/support/refused_calls.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Scratch;

constexpr Duration kLong = Duration::from_ms(60'000);

/// The errno of what is tried in a copy that is confined to the input; 0 where it was done, -1 where it is not
/// confined.
template <typename Try>
int errno_of(const fs::path& input, const Try& attempt) {
  int came = -1;
  const auto ran = run_confined_to(
      input, {},
      [&](const Send& send, std::vector<ProcessCopy>&) {
        errno = 0;
        const int failed = attempt() < 0 ? errno : 0;
        send(&failed, sizeof failed);
      },
      [&](const Receive& receive) { (void)receive(&came, sizeof came); }, kLong);
  EXPECT_TRUE(ran) << ran.error().what;
  return came;
}

int open_to_read(const fs::path& path) {
  return ::open(path.c_str(), O_RDONLY);
}

/// Whether the kernel of this machine holds a confined process to its files.
bool has_landlock(const fs::path& input) {
  bool files = false;
  const auto ran = run_isolated(
      [&](const Send& send) {
        const auto confined = confine_to(input);
        const bool held = confined && confined->files;
        send(&held, sizeof held);
      },
      [&](const Receive& receive) { (void)receive(&files, sizeof files); }, kLong);
  EXPECT_TRUE(ran) << ran.error().what;
  return files;
}

/// Whether it has filters at all, not whether ours holds.
bool has_filters() {
  return ::prctl(PR_GET_SECCOMP) >= 0;
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
    if (!has_filters()) GTEST_SKIP() << "this kernel has no seccomp filters";
  }
  [[nodiscard]] fs::path input() const { return scratch_ / "export"; }
  [[nodiscard]] fs::path elsewhere() const { return scratch_ / "elsewhere/secret"; }

  const Scratch scratch_;
};

TEST_F(Confined, ReadsItsInput) {
  const fs::path slice = input() / "inner/slice";
  EXPECT_EQ(errno_of(input(), [&] { return open_to_read(slice); }), 0);
  EXPECT_EQ(errno_of(slice, [&] { return open_to_read(slice); }), 0);
  const auto names = [&] {
    return std::distance(fs::recursive_directory_iterator(input()), fs::recursive_directory_iterator()) == 2 ? 0 : -1;
  };
  EXPECT_EQ(errno_of(input(), names), 0) << "a folder's names, and those of the folders in it";
}

TEST_F(Confined, ReadsWhatALinkOfItsInputLeadsTo) {
  fs::create_symlink(elsewhere(), input() / "link");
  EXPECT_EQ(errno_of(input(), [&] { return open_to_read(input() / "link"); }), 0);
  EXPECT_EQ(errno_of(input() / "link", [&] { return open_to_read(input() / "link"); }), 0);
}

TEST_F(Confined, ReadsNothingElseOfAPerson) {
  if (!has_landlock(input())) GTEST_SKIP() << "this kernel has no Landlock";
  EXPECT_EQ(errno_of(input(), [&] { return open_to_read(elsewhere()); }), EACCES);
  EXPECT_EQ(errno_of(input(), [] { return open_to_read("/etc/passwd"); }), EACCES);
  EXPECT_EQ(errno_of(input(), [&] { return open_to_read(scratch_.path()); }), EACCES);
}

TEST_F(Confined, ReadsOfAFileNothingBesideItNorBelow) {
  if (!has_landlock(input())) GTEST_SKIP() << "this kernel has no Landlock";
  write(input() / "ct.nii", 100);
  write(input() / "key.pem", 100);
  for (const char* name : {"key.pem", "inner/slice", "inner", "."})
    EXPECT_EQ(errno_of(input() / "ct.nii", [&] { return open_to_read(input() / name); }), EACCES) << name;
}

TEST_F(Confined, ReadsOfAHeaderWhatLiesBesideItAndNothingBelow) {
  write(input() / "ct.mhd", 100);
  write(input() / "ct.raw", 100);
  EXPECT_EQ(errno_of(input() / "ct.mhd", [&] { return open_to_read(input() / "ct.raw"); }), 0);
  if (!has_landlock(input())) GTEST_SKIP() << "this kernel has no Landlock";
  for (const char* name : {"inner/slice", "inner", "."})
    EXPECT_EQ(errno_of(input() / "ct.mhd", [&] { return open_to_read(input() / name); }), EACCES) << name;
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
  EXPECT_EQ(errno_of(input(), [] { return ::fcntl(STDIN_FILENO, F_SETOWN, ::getppid()); }), EPERM)
      << "a signal by way of a file";
}

TEST_F(Confined, HasThreadsAndMakesNoCopies) {
  EXPECT_EQ(errno_of(input(),
                     [] {
                       std::thread([] {}).join();
                       return 0;
                     }),
            0);
  EXPECT_EQ(errno_of(input(),
                     [] {
                       const pid_t made = ::fork();
                       if (made == 0) ::_exit(0);
                       return made;
                     }),
            EPERM);
  EXPECT_EQ(errno_of(input(), [] { return ::syscall(SYS_clone3, nullptr, 0); }), ENOSYS) << "its flags cannot be seen";
}

TEST_F(Confined, KnowsItsLimitsAndRaisesNone) {
  rlimit limit{};
  EXPECT_EQ(errno_of(input(), [&] { return ::getrlimit(RLIMIT_STACK, &limit); }), 0);
  for (const auto of : {RLIMIT_AS, RLIMIT_FSIZE, RLIMIT_STACK, RLIMIT_NOFILE}) {
    EXPECT_EQ(errno_of(input(),
                       [&] {
                         (void)::getrlimit(of, &limit);
                         return ::setrlimit(of, &limit);
                       }),
              EPERM);
  }
  EXPECT_EQ(errno_of(input(),
                     [&] {
                       (void)::getrlimit(RLIMIT_CPU, &limit);
                       ++limit.rlim_max;
                       return ::setrlimit(RLIMIT_CPU, &limit);
                     }),
            EPERM)
      << "not even root's";
}

TEST_F(Confined, HoldsNoFileThatWasOpenBefore) {
  const int open_before = ::open(elsewhere().c_str(), O_RDWR);
  ASSERT_GE(open_before, 0);
  EXPECT_EQ(errno_of(input(), [open_before] { return static_cast<int>(::write(open_before, "y", 1)); }), EBADF);
  ::close(open_before);
}

/// What is said of work in a process that is confined to the input.
Error error_of(const fs::path& input, const std::function<void()>& work) {
  char byte = 0;
  const auto ran = run_confined_to(
      input, {},
      [&](const Send& send, std::vector<ProcessCopy>&) {
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
  const Error late = error_of(input(), [] { work_for(60); });
  EXPECT_EQ(late.code, Errc::unsupported);
  EXPECT_THAT(late.what, HasSubstr("took longer than a file of its size justifies"));
  EXPECT_THAT(late.what, HasSubstr("signal 24 (CPU time limit exceeded)"));
}

TEST_F(Confined, HasLessThanASecondOfTheProcessorBeyondThat) {
  double left_s = 0;
  const auto ran = run_isolated(
      [&](const Send& send) {
        work_for(0.3);
        if (!confine_to(input())) return;
        rlimit limit{};
        (void)::getrlimit(RLIMIT_CPU, &limit);
        const double left = static_cast<double>(limit.rlim_cur) - processor_s();
        send(&left, sizeof left);
      },
      [&](const Receive& receive) { (void)receive(&left_s, sizeof left_s); }, kLong);
  ASSERT_TRUE(ran) << ran.error().what;
  const double allowed_s = allowance_of(readable_for(input()).value().bytes).processor_time.seconds();
  EXPECT_GT(left_s, allowed_s - 0.5) << "what it took to confine itself is off it already";
  EXPECT_LT(left_s, allowed_s + 1);
}

TEST_F(Confined, HasTimeForEachOfItsFiles) {
  for (const char* name : {"a", "b", "c"}) write(input() / name, 100);
  const auto one_after_another = [this] {
    for (const char* name : {"a", "b", "c", "inner/slice"}) {
      allow_time_for(input() / name);
      work_for(1.5);
    }
  };
  EXPECT_THAT(error_of(input(), one_after_another).what, HasSubstr("was done"));
}

TEST_F(Confined, HasTimeForAllOfItsFilesOnceAndIsKilledThen) {
  const auto again_and_again = [this] {
    ::signal(SIGXCPU, SIG_IGN);
    for (;;) {
      allow_time_for(input() / "inner/slice");
      work_for(0.2);
    }
  };
  const Error killed = error_of(input(), again_and_again);
  EXPECT_EQ(killed.code, Errc::unsupported);
  EXPECT_THAT(killed.what, HasSubstr("took longer than a file of its size justifies"));
  EXPECT_THAT(killed.what, HasSubstr("signal 9 (Killed)"));
}

TEST_F(Confined, EndsByAnAssertionInAWordOfItsOwn) {
  EXPECT_THAT(error_of(input(), [] { std::abort(); }).what, HasSubstr("signal 6 (Aborted)"));
}

TEST_F(Confined, HasCopiesThatAreConfinedToo) {
  // Each says, as often as it is asked, what the kernel says of a socket, a copy and a file that is not its input.
  const fs::path other = elsewhere();
  const auto tried = [&other](const ProcessCopy::Take& take, const ProcessCopy::Send& send) {
    for (char asked = 0; take(&asked, 1);) {
      const auto errno_after = [](int done) { return done < 0 ? errno : 0; };
      const int socket = errno_after(::socket(AF_INET, SOCK_STREAM, 0)), copy = errno_after(::fork());
      const std::array said{socket, copy, errno_after(open_to_read(other))};
      send(said.data(), sizeof said);
    }
  };
  std::vector<int> came(2 * 2 * 3, -1);
  const auto ran = run_confined_to(
      input(), {2, tried},
      [](const Send& send, std::vector<ProcessCopy>& copies) {
        for (int time = 0; time < 2; ++time) {
          for (ProcessCopy& copy : copies) {
            std::array<int, 3> said{-1, -1, -1};
            if (copy.give("x", 1, Deadline::after(kLong)))
              (void)copy.receive(said.data(), sizeof said, Deadline::after(kLong));
            send(said.data(), sizeof said);
          }
        }
      },
      [&](const Receive& receive) { (void)receive(came.data(), came.size() * sizeof came[0]); }, kLong);
  ASSERT_TRUE(ran) << ran.error().what;
  for (std::size_t i = 0; i < came.size(); i += 3) {
    EXPECT_EQ(came[i], EPERM);
    EXPECT_EQ(came[i + 1], EPERM);
    if (has_landlock(input())) {
      EXPECT_EQ(came[i + 2], EACCES);
    }
  }
}

TEST_F(Confined, KnowsHowACopyOfItEnded) {
  std::string came(100, ' ');
  const auto ran = run_confined_to(
      input(), {1, [](const ProcessCopy::Take&, const ProcessCopy::Send&) { std::abort(); }},
      [&](const Send& send, std::vector<ProcessCopy>& copies) {
        char byte = 0;
        std::string said = copies.at(0).receive(&byte, 1, Deadline::after(kLong)).error().what;
        said.resize(came.size(), ' ');
        send(said.data(), said.size());
      },
      [&](const Receive& receive) { (void)receive(came.data(), came.size()); }, kLong);
  ASSERT_TRUE(ran) << ran.error().what;
  EXPECT_THAT(came, HasSubstr("signal 6 (Aborted)"));
}

/// What run_confined_to says in a process to which these calls are refused, and what it wrote to stderr meanwhile.
std::string said_without(std::initializer_list<testing::RefusedCall> calls, const fs::path& input,
                         const fs::path& standard_error) {
  std::string came(1000, ' ');
  const auto ran = run_isolated(
      [&](const Send& send) {
        const int file = ::open(standard_error.c_str(), O_WRONLY | O_CREAT, 0600);
        if (file < 0 || ::dup2(file, STDERR_FILENO) < 0 || !testing::refuse_calls(calls, EINVAL)) return;
        std::string said;
        for (int time = 0; time < 2; ++time) said += error_of(input, [] {}).what + "\n";
        said.resize(came.size(), ' ');
        send(said.data(), said.size());
      },
      [&](const Receive& receive) { (void)receive(came.data(), came.size()); }, kLong);
  EXPECT_TRUE(ran) << ran.error().what;
  return came;
}

TEST_F(Confined, ReadsNothingWhereTheSystemSetsNoFilter) {
  const std::string said = said_without({{SYS_seccomp}, {SYS_prctl, 0, PR_SET_SECCOMP}}, input(), scratch_ / "said");
  EXPECT_THAT(said, HasSubstr("its decoder cannot be confined: there is no filter of its system calls, seccomp "
                              "(Invalid argument); run a kernel that has"));
  EXPECT_THAT(said, Not(HasSubstr("it was done")));
}

TEST_F(Confined, ReadsNothingWhereTheSystemSetsNoLimit) {
  const std::string said = said_without({{SYS_prlimit64, 2, 0, true}}, input(), scratch_ / "said");
  EXPECT_THAT(said, HasSubstr("its decoder cannot be confined: the system does not bound its memory"));
  EXPECT_THAT(said, Not(HasSubstr("it was done")));
}

TEST_F(Confined, ReadsWithoutLandlockAndSaysSoOnce) {
  if (!has_landlock(input())) GTEST_SKIP() << "this kernel has no Landlock, so it is said already";
  const std::string said = said_without({{SYS_landlock_create_ruleset}}, input(), scratch_ / "said");
  EXPECT_THAT(said, HasSubstr("it was done\nit was done\n"));
  const std::string noted = testing::contents_of(scratch_ / "said");
  EXPECT_THAT(noted, HasSubstr("birdseye: note: this kernel has no Landlock"));
  EXPECT_EQ(std::count(noted.begin(), noted.end(), '\n'), 1) << noted;
}

TEST_F(Confined, OfAHeaderTheFilesBesideItCount) {
  write(scratch_ / "ct.mhd", 200);
  write(scratch_ / "ct.raw", 5000);
  write(scratch_ / "ct.mha", 300);
  fs::create_symlink(elsewhere(), scratch_ / "link.raw");
  EXPECT_EQ(readable_for(scratch_ / "ct.mha").value().bytes, 300U);
  EXPECT_EQ(readable_for(scratch_ / "ct.mhd").value().bytes, 200U + 5000U + 300U + 100U);
  EXPECT_EQ(errno_of(scratch_ / "ct.mhd", [&] { return open_to_read(scratch_ / "link.raw"); }), 0);
}

}  // namespace
}  // namespace birdseye::host
