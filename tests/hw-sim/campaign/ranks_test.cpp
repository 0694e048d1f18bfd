// Campaigns under Open MPI's mpirun: the same results by seed whatever the number of ranks, and what is left of one
// whose rank was killed.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/system/child_process.hpp"
#include "drivers/system/local_programs.hpp"
#include "hw-sim/campaign/campaign.hpp"
#include "hw-sim/campaign/ranks.hpp"
#include "hw-sim/campaign/seed_results.hpp"
#include "tests/hw-sim/campaign/variable.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

using birdseye::testing::contents_of;
using birdseye::testing::Scratch;
using Words = std::vector<std::string>;

bool mpirun_is_here() {
  std::istringstream path(::getenv("PATH"));
  for (std::string folder; std::getline(path, folder, ':');) {
    if (std::filesystem::exists(std::filesystem::path(folder) / "mpirun")) return true;
  }
  return false;
}

class CampaignByRanks : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!mpirun_is_here()) GTEST_SKIP() << "no mpirun: install openmpi-bin";
  }

  /// The exit code of `birdseye-sim campaign` with these words in so many ranks; 0: without mpirun.
  int campaign(int ranks, const Words& words) {
    Words all;
    // As root, and with more ranks than cores, only where it is said.
    if (ranks > 0) {
      all = {"mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-n", std::to_string(ranks)};
    }
    all.insert(all.end(), {beside_us("birdseye-sim"), "campaign"});
    all.insert(all.end(), words.begin(), words.end());
    auto child = ChildProcess::start(all, log());
    return child ? child->wait(Deadline::after(Duration::from_ms(100'000))).value_or(-1) : -1;
  }
  [[nodiscard]] std::filesystem::path log() const { return scratch_ / "log"; }
  [[nodiscard]] std::string folder(int ranks) const { return scratch_ / std::to_string(ranks); }
  /// Its results, a line a seed.
  static std::string lines_in(const std::filesystem::path& file, const std::string& what) {
    const auto results = SeedResults::open(file, what);
    if (!results) return results.error().what;
    std::string out;
    (void)(*results)->for_each(0, 1000, [&out](const SeedLine& one) -> Result<void> {
      out += std::to_string(one.seed) + " " + one.line + "\n";
      return {};
    });
    return out;
  }

  const Scratch scratch_;
  const SetVariable temporary_{"TMPDIR", scratch_.path().string()};  // ranks that are killed leave files there
};

TEST_F(CampaignByRanks, GivesTheSameBySeedWhateverTheirNumber) {
  std::string without;
  for (const int ranks : {0, 1, 3}) {
    ASSERT_EQ(campaign(ranks, {"--seeds", "1:5", "--minutes", "0.5", "--out", folder(ranks)}), 0) << contents_of(log());
    const auto study = study_of_operations({.minutes = 0.5}, beside_us("birdseye-sim"));
    ASSERT_TRUE(study) << study.error().what;
    const std::string lines = lines_in(folder(ranks) + "/operations.sqlite", study->what);
    EXPECT_EQ(std::ranges::count(lines, '\n'), 5) << lines;
    if (ranks == 0) without = lines;
    EXPECT_EQ(lines, without) << ranks << " ranks";
  }
  // The others did work.
  EXPECT_TRUE(std::filesystem::exists(folder(3) + "/campaign-1.log"));
  EXPECT_TRUE(std::filesystem::exists(folder(3) + "/campaign-2.log"));
}

TEST_F(CampaignByRanks, RepeatOnlyUnfinishedSeedsOnceOneOfThemWasKilled) {
  constexpr const char* kFifth = "test {} != 5 || test -e killed || { touch killed; kill -KILL $PPID; sleep 60; }";
  const std::string script =
      "cd " + scratch_.path().string() + "; " + kFifth + "; echo {} >>ran; echo '{\"seed\": '{}'}'";
  const std::string what = "sh -c " + script;
  const auto up_to = [&](const char* last) {
    return Words{"--seeds", std::string("1:") + last, "--out", folder(3), "--", "sh", "-c", script};
  };
  ASSERT_EQ(campaign(3, up_to("4")), 0) << contents_of(log());
  EXPECT_NE(campaign(3, up_to("9")), 0);
  const auto ran = [this] {
    std::ifstream in(scratch_ / "ran");
    return std::multiset<int>(std::istream_iterator<int>(in), {});
  };
  const auto seeds = [&]() -> std::set<std::uint64_t> {
    const auto results = SeedResults::open(folder(3) + "/results.sqlite", what);
    return results ? *(*results)->seeds() : std::set<std::uint64_t>();
  };
  const auto done = seeds();
  EXPECT_TRUE(done.contains(4));
  ASSERT_FALSE(done.contains(5));
  ASSERT_EQ(campaign(3, up_to("9")), 0) << contents_of(log());
  EXPECT_EQ(seeds().size(), 9U);
  for (const std::uint64_t seed : done) EXPECT_EQ(ran().count(static_cast<int>(seed)), 1U) << "seed " << seed;
}

TEST_F(CampaignByRanks, KeepWhatTheOthersBroughtWhereASeedGaveNothing) {
  const Words words{"--seeds", "1:6", "--out", folder(3), "--", "sh", "-c", "test {} = 4 || echo {}"};
  EXPECT_EQ(campaign(3, words), 2);
  EXPECT_NE(contents_of(log()).find("1 of 6 seeds gave no result, as seed 4: none"), std::string::npos)
      << contents_of(log());
  EXPECT_EQ(lines_in(folder(3) + "/results.sqlite", "sh -c test {} = 4 || echo {}"), "1 1\n2 2\n3 3\n5 5\n6 6\n");
}

TEST_F(CampaignByRanks, RefuseWhatCannotBeDoneInWords) {
  EXPECT_NE(campaign(2, {"--seeds", "1:2", "--jobs", "2", "--out", folder(2)}), 0);
  EXPECT_NE(contents_of(log()).find("rank 0: --jobs is for a campaign without mpirun"), std::string::npos)
      << contents_of(log());
}

/// As where a host has another version, or another command was meant.
TEST_F(CampaignByRanks, RefuseOneThatWouldRunAnythingElse) {
  const auto and_another = [this](const Words& one, const Words& other) {
    Words all = one;
    all.insert(all.end(), {":", "-n", "1", beside_us("birdseye-sim"), "campaign"});
    all.insert(all.end(), other.begin(), other.end());
    EXPECT_EQ(campaign(1, all), 2);
    return contents_of(log());
  };
  const Words out{"--out", folder(2)};
  const auto with = [&](Words words) {
    words.insert(words.begin(), out.begin(), out.end());
    return words;
  };
  const std::string range =
      and_another(with({"--seeds", "1:2", "--", "echo", "{}"}), with({"--seeds", "1:3", "--", "echo", "{}"}));
  EXPECT_NE(range.find("rank 1 would run seeds 1 to 3 of echo {}, where rank 0 runs seeds 1 to 2 of echo {}"),
            std::string::npos)
      << range;
  const std::string length =
      and_another(with({"--seeds", "1:2", "--minutes", "0.5"}), with({"--seeds", "1:2", "--minutes", "0.6"}));
  EXPECT_NE(length.find("rank 1 would run seeds 1 to 2 of operations of 0.6 minutes, build "), std::string::npos)
      << length;
}

TEST(Ranks, AreNoneForAProgramAlone) {
  for (const char* const variable : {"PMI_SIZE", "OMPI_COMM_WORLD_SIZE"}) {
    const SetVariable one(variable, "1");
    const auto joined = Ranks::join();
    ASSERT_TRUE(joined) << joined.error().what;
    EXPECT_EQ(*joined, nullptr) << variable;
  }
}

TEST(Ranks, AreRefusedFromAnythingButOpenMpi) {
  const SetVariable another("PMI_SIZE", "4");
  const auto joined = Ranks::join();
  ASSERT_FALSE(joined);
  EXPECT_EQ(joined.error().code, Errc::unsupported);
  EXPECT_NE(joined.error().what.find("start this with the mpirun of Open MPI"), std::string::npos)
      << joined.error().what;
}

}  // namespace
}  // namespace birdseye::hw_sim
