// Results of operations in one file, and operations of many seeds in processes of their own.
#include "hw-sim/campaign/campaign.hpp"

#include <gtest/gtest.h>

#include "drivers/system/local_programs.hpp"
#include "hw-sim/campaign/operation_results.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

using birdseye::testing::Scratch;

OperationResult result_of_seed(std::uint64_t seed) {
  OperationResult result;
  result.seed = seed;
  result.minutes = 2.5;
  result.hash = "00ff";
  result.poses = 100 * seed;
  result.green = seed;
  result.worst_circles = 0.1 * static_cast<double>(seed);
  return result;
}

TEST(OperationResults, AreReadBackAddedUpAndKeptOncePerSeed) {
  const Scratch scratch;
  {
    const auto results = OperationResults::open(scratch / "o.sqlite", 2.5);
    ASSERT_TRUE(results) << results.error().what;
    for (const std::uint64_t seed : {3U, 1U, 2U, 9U}) ASSERT_TRUE((*results)->enter(result_of_seed(seed)));
    OperationResult broken = result_of_seed(2);
    broken.laws_broken = 1;
    broken.broken = "12.000 s pose: scope is 20.0 mm off";
    ASSERT_TRUE((*results)->enter(broken));
  }
  const auto again = OperationResults::open(scratch / "o.sqlite", 2.5);
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(*(*again)->seeds(), (std::set<std::uint64_t>{1, 2, 3, 9}));
  const auto sum = (*again)->sum(1, 3);
  ASSERT_TRUE(sum) << sum.error().what;
  EXPECT_EQ(sum->poses, 600U);
  EXPECT_EQ(sum->minutes, 7.5);
  EXPECT_EQ(sum->laws_broken, 1U);
  EXPECT_DOUBLE_EQ(sum->worst_circles, 0.3);
  EXPECT_EQ(sum->broken, "seed 2: 12.000 s pose: scope is 20.0 mm off\n");
}

TEST(OperationResults, OfAnotherLengthAreNotMixedIn) {
  const Scratch scratch;
  ASSERT_TRUE(OperationResults::open(scratch / "o.sqlite", 2.5));
  const auto other = OperationResults::open(scratch / "o.sqlite", 10);
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().what.find("of 2.5 minutes, not 10"), std::string::npos) << other.error().what;
}

TEST(OperationResults, ALineIsReadBackAndAnythingElseRefused) {
  const auto back = result_of(line_of(result_of_seed(7)));
  ASSERT_TRUE(back) << back.error().what;
  EXPECT_EQ(line_of(*back), line_of(result_of_seed(7)));
  for (const char* const line : {"", "{}", "no JSON", "{\"seed\": \"seven\"}"}) EXPECT_FALSE(result_of(line)) << line;
}

/// Operations of half a minute of the seeds from 1 on.
CampaignSettings short_ones(const Scratch& scratch, std::uint64_t last_seed) {
  CampaignSettings settings;
  settings.last_seed = last_seed;
  settings.minutes = 0.5;
  settings.folder = scratch / "campaign";
  settings.program = beside_us("birdseye-sim");
  return settings;
}

TEST(Campaign, RunsTheSeedsThatAreMissingAndNoOthers) {
  const Scratch scratch;
  const CampaignSettings settings = short_ones(scratch, 3);
  {
    std::filesystem::create_directories(settings.folder);
    const auto known = OperationResults::open(settings.folder / "operations.sqlite", settings.minutes);
    ASSERT_TRUE(known && (*known)->enter(result_of_seed(2)));
  }
  std::string said;
  const auto sum = run_campaign(settings, [&said](const std::string& line) { said += line + "\n"; });
  ASSERT_TRUE(sum) << sum.error().what;
  EXPECT_EQ(said, "2 of 2, 0 broke a law\n");
  EXPECT_GT(sum->poses, 2 * 30 * 2 * 90U);
  EXPECT_EQ(sum->laws_broken, 0U) << sum->broken;
}

TEST(Campaign, BeginsNoOperationOnceItsTimeIsOver) {
  const Scratch scratch;
  CampaignSettings settings = short_ones(scratch, 1000);
  settings.at_most_s = 1e-9;
  const auto sum = run_campaign(settings, [](const std::string&) {});
  ASSERT_TRUE(sum) << sum.error().what;
  EXPECT_EQ(sum->minutes, 0);
}

TEST(Campaign, AnOperationThatGivesNoResultBreaksALaw) {
  const Scratch scratch;
  CampaignSettings settings = short_ones(scratch, 1);
  settings.program = "/bin/true";
  const auto sum = run_campaign(settings, [](const std::string&) {});
  ASSERT_TRUE(sum) << sum.error().what;
  EXPECT_EQ(sum->laws_broken, 1U);
  EXPECT_NE(sum->broken.find("seed 1: result: none"), std::string::npos) << sum->broken;
}

}  // namespace
}  // namespace birdseye::hw_sim
