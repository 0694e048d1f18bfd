#include <gtest/gtest.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <optional>

#include "device/wire/client.hpp"
#include "device/wire/server.hpp"
#include "drivers/system/clock.hpp"
#include "hw-sim/minibird/pseudo_terminal.hpp"
#include "tests/support/child.hpp"
#include "tests/support/programs_folder.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::Scratch;

constexpr Duration kPatience = Duration::from_ms(60'000);

/// The thread of that name; none where there is none.
std::optional<pid_t> thread_of(pid_t process, const std::string& name) {
  const auto tasks = std::filesystem::path("/proc") / std::to_string(process) / "task";
  for (const auto& task : std::filesystem::directory_iterator(tasks)) {
    if (testing::contents_of(task.path() / "comm") == name + "\n") return std::stoi(task.path().filename().string());
  }
  return std::nullopt;
}

/// birdseyed as systemd starts it: with a folder that stays from one start to the next.
class Service {
 public:
  explicit Service(const Scratch& scratch, int port)
      : child_({"env", "RUNTIME_DIRECTORY=" + (scratch / "run").string(), testing::programs_folder() + "/birdseyed",
                "--config", (scratch / "c.toml").string()}),
        port_(port) {
    EXPECT_TRUE(child_.says({"publishing on"}, Deadline::after(kPatience))) << child_.output();
  }
  /// A fault in that instrument's code: the thread that looks for it gets the signal that such a fault is.
  void crash(const std::string& instrument) {
    const Deadline deadline = Deadline::after(kPatience);
    std::optional<pid_t> thread;
    while (!thread && !deadline.passed()) thread = thread_of(child_.pid(), instrument);
    ASSERT_TRUE(thread) << "no thread is at work on the " << instrument << "\n" << child_.output();
    ASSERT_EQ(::syscall(SYS_tgkill, child_.pid(), *thread, SIGSEGV), 0);
    EXPECT_EQ(child_.exit_code(deadline), -1) << child_.output();
  }
  void end() {
    child_.signal(SIGTERM);
    EXPECT_EQ(child_.exit_code(Deadline::after(kPatience)), 0) << child_.output();
  }

  /// What Health says of that instrument and STATUS of all, once both were told.
  [[nodiscard]] std::pair<std::string, std::string> told_of(const std::string& instrument) const {
    const Deadline deadline = Deadline::after(kPatience);
    const auto client = wire::Client::connect("127.0.0.1", port_, deadline);
    std::string health, status;
    while (client && !deadline.passed() && (health.empty() || status.empty())) {
      const auto event = (*client)->next(deadline);
      if (!event || !*event) break;
      if (const auto* told = std::get_if<wire::Status>(&**event)) status = told->text;
      const auto* const figures = std::get_if<wire::Health>(&**event);
      if (figures == nullptr) continue;
      for (const wire::InstrumentHealth& one : figures->instruments) {
        if (one.name == instrument) health = one.state + ": " + one.text;
      }
    }
    return {health, status};
  }
  [[nodiscard]] const std::string& output() const { return child_.output(); }

 private:
  testing::Child child_;
  int port_;
};

TEST(SafeMode, AStartAfterThreeCrashesOfTheCameraLeavesItOutAndSaysSoUntilSomebodyRestartsIt) {
  const Scratch scratch;
  const auto terminal = hw_sim::PseudoTerminal::open(scratch / "tty");
  ASSERT_TRUE(terminal) << terminal.error().what;
  std::filesystem::create_directory(scratch / "run");
  const int port = [] {
    const auto free = wire::Server::listen("127.0.0.1", 0);
    return (*free)->port();
  }();
  (void)scratch.file("c.toml", "[tracker]\ndevice = \"" + (scratch / "tty").string() +
                                   "\"\n[camera]\nsource = \"socket:" + (scratch / "camera").string() +
                                   "\"\n[wire]\nport = " + std::to_string(port) + "\n");
  for (int i = 0; i < 3; ++i) {
    Service service(scratch, port);
    EXPECT_EQ(service.told_of("camera").first.find("left out"), std::string::npos) << "after " << i << " crashes";
    service.crash("camera");
  }
  const std::string why = "the camera is left out, for it ended birdseyed 3 times";
  {
    Service service(scratch, port);
    const auto [health, status] = service.told_of("camera");
    EXPECT_TRUE(health.starts_with("absent: " + why)) << health;
    EXPECT_NE(status.find(why), std::string::npos) << status;
    EXPECT_EQ(service.told_of("tracker").first.find("left out"), std::string::npos);
    service.crash("tracker");  // the others are at work, and once is no crash loop
  }
  Service still(scratch, port);
  EXPECT_TRUE(still.told_of("camera").first.starts_with("absent: " + why));
  EXPECT_NE(still.output().find("the run before ended badly, by the tracker"), std::string::npos) << still.output();
  still.end();
  const Service anew(scratch, port);
  EXPECT_EQ(anew.told_of("camera").first.find("left out"), std::string::npos);
}

}  // namespace
}  // namespace birdseye
