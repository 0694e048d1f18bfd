#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "host/window/live_script.hpp"
#include "tests/support/live_operation.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::kMs;
using birdseye::testing::Scratch;

TEST(LiveScript, IsFollowedLineByLine) {
  const Scratch scratch;
  auto script =
      LiveScript::read(scratch.file("s.txt", "# first\nsleep 0.5\nkey space\n\nwait connect 2 # or not\nend\n"));
  ASSERT_TRUE(script) << script.error().what;
  LiveWorkflow workflow{LiveSettings{}};
  EXPECT_TRUE(script->next(workflow.view(), HostTime{0})->key.empty());
  EXPECT_TRUE(script->next(workflow.view(), HostTime{400 * kMs})->key.empty());
  EXPECT_TRUE(script->next(workflow.view(), HostTime{600 * kMs})->key.empty());  // the pause is over
  EXPECT_EQ(script->next(workflow.view(), HostTime{600 * kMs})->key, "space");
  EXPECT_FALSE(script->next(workflow.view(), HostTime{700 * kMs})->end);
  const auto late = script->next(workflow.view(), HostTime{2800 * kMs});
  ASSERT_FALSE(late);
  EXPECT_NE(late.error().what.find("s.txt:5: the step connect was not done within 2 s; give the line more seconds"),
            std::string::npos)
      << late.error().what;
}

TEST(LiveScript, PressesAKeyUntilAStepIsDone) {
  const Scratch scratch;
  auto script = LiveScript::read(scratch.file("s.txt", "press space 0.5 connect 2\nend\n"));
  ASSERT_TRUE(script) << script.error().what;
  LiveWorkflow workflow{LiveSettings{}};
  const auto key_at = [&](std::int64_t ms) { return script->next(workflow.view(), HostTime{ms * kMs})->key; };
  EXPECT_EQ(key_at(0), "space");
  EXPECT_EQ(key_at(400), "");
  EXPECT_EQ(key_at(500), "space");
  EXPECT_EQ(key_at(1000), "space");
  auto late = *script;
  EXPECT_FALSE(late.next(workflow.view(), HostTime{2000 * kMs}));
  wire::Health health;
  health.state = "ready";
  workflow.take(health, HostTime{0}, std::nullopt);
  workflow.set_link(true, "connected");
  EXPECT_EQ(key_at(1600), "");
  EXPECT_TRUE(script->next(workflow.view(), HostTime{1601 * kMs})->end);
}

TEST(LiveScript, WaitsForAnOverlay) {
  const Scratch scratch;
  auto script = LiveScript::read(scratch.file("s.txt", "wait overlay 2\nkey s\n"));
  ASSERT_TRUE(script) << script.error().what;
  OperationView operation;
  EXPECT_EQ(script->next(operation, HostTime{0})->key, "");
  auto other = *script;
  const auto late = other.next(operation, HostTime{2000 * kMs});
  ASSERT_FALSE(late);
  EXPECT_NE(late.error().what.find("s.txt:1: no frame bore an overlay within 2 s; give the line more seconds"),
            std::string::npos)
      << late.error().what;
  operation.target.emplace();
  EXPECT_EQ(script->next(operation, HostTime{1000 * kMs})->key, "");
  EXPECT_EQ(script->next(operation, HostTime{1001 * kMs})->key, "s");
}

TEST(LiveScript, TheManualsExampleIsOne) {
  const char* const source = std::getenv("BIRDSEYE_SOURCE_DIR");
  const std::filesystem::path folder = source != nullptr ? source : ".";
  const auto script = LiveScript::read(folder / "docs/manual/examples/live-script.txt");
  EXPECT_TRUE(script) << script.error().what;
}

TEST(LiveScript, NamesTheStepsWhereALineNamesNone) {
  const Scratch scratch;
  const auto script = LiveScript::read(scratch.file("s.txt", "wait overly 3\n"));
  ASSERT_FALSE(script);
  EXPECT_NE(script.error().what.find("no step overly: give one of connect, "), std::string::npos)
      << script.error().what;
}

TEST(LiveScript, NamesALineThatIsNone) {
  const Scratch scratch;
  for (const char* text :
       {"wait connect\n", "wait nothing 3\n", "jump 3\n", "key\n", "sleep -1\n", "press space 1 views\n", "key spcae\n",
        "press nothing 1 views 3\n", "key space space\n", "end 3\n"}) {
    const auto script = LiveScript::read(scratch.file("s.txt", std::string("end\n") + text));
    ASSERT_FALSE(script) << text;
    EXPECT_NE(script.error().what.find("s.txt:2: "), std::string::npos) << script.error().what;
  }
  EXPECT_FALSE(LiveScript::read(scratch / "none.txt"));
}

}  // namespace
}  // namespace birdseye::host
