#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/command.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::expect_refused;
using testing::run;
using testing::Scratch;

TEST(BenchRegisterCommand, TriesThePapersOptimisersAndOursOnTheSameCases) {
  const Scratch scratch;
  const auto result =
      run("birdseye", "bench register --trials 1 --phantom liver --dof 3 --views 2 --size 384x288 --json " +
                          (scratch / "r.json").string());
  ASSERT_EQ(result.code, 0) << result.output;
  std::ifstream in(scratch / "r.json");
  const nlohmann::json json = nlohmann::json::parse(in);
  ASSERT_EQ(json["rows"].size(), 3U);
  std::vector<std::string> optimisers;
  for (const nlohmann::json& row : json["rows"]) {
    optimisers.push_back(row["optimiser"]);
    EXPECT_EQ(row["phantom"], "liver");
    EXPECT_EQ(row["dof"], 3);
    EXPECT_EQ(row["views"], 2);
    EXPECT_EQ(row["viewport"], "384x288");
    EXPECT_EQ(row["trials"], 1);
    EXPECT_EQ(row["epsilon_ratios"].size(), 1U);
    EXPECT_GT(row["epsilon_before_median"], 0.01);
    EXPECT_LT(row["epsilon_after_median"], 0.5 * row["epsilon_before_median"].get<double>());
    EXPECT_LT(row["tre_after_mm_mean"], row["tre_before_mm_mean"]);
    EXPECT_GT(row["time_s_median"], 0);
    EXPECT_GE(row["success_rate"], 0);
    if (row["optimiser"] != "gradient") {
      EXPECT_LE(row["evaluations_median"], 55);
    }
  }
  EXPECT_EQ(optimisers, (std::vector<std::string>{"simplex", "powell", "gradient"}));
  EXPECT_EQ(json["verdict"], "pass");
}

TEST(BenchRegisterCommand, RefusesWhatItDoesNotKnow) {
  const Scratch scratch;
  expect_refused("birdseye", "bench register --phantom foot --json " + (scratch / "r.json").string(),
                 {"phantom", "foot"}, scratch / "r.json");
  expect_refused("birdseye", "bench register --views 1 --study " + (scratch / "s").string(), {"--study", "--views"},
                 scratch / "s");
}

}  // namespace
}  // namespace birdseye
