// Results of operations in one file, and operations of many seeds in processes of their own.
#include "hw-sim/campaign/campaign.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <utility>

#include "drivers/system/child_process.hpp"
#include "drivers/system/local_programs.hpp"
#include "hw-sim/campaign/children_folder.hpp"
#include "tests/hw-sim/campaign/variable.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

using birdseye::testing::contents_of;
using birdseye::testing::Scratch;

OperationResult result_of_seed(std::uint64_t seed) {
  OperationResult result;
  result.seed = seed;
  result.minutes = 2.5;
  result.hash = "00ff";
  result.poses = 100 * seed;
  result.green = seed;
  result.worst_circles = 0.1 * static_cast<double>(seed);
  result.by_fault["camera unplug"] = {seed, 1, 0.1 * static_cast<double>(seed), 0.5};
  return result;
}

SeedLine entry_of(const OperationResult& result) {
  return {result.seed, line_of(result)};
}

TEST(SeedResults, AreReadBackAddedUpAndKeptOncePerSeed) {
  const Scratch scratch;
  {
    const auto results = SeedResults::open(scratch / "o.sqlite", "operations of 2.5 minutes");
    ASSERT_TRUE(results) << results.error().what;
    for (const std::uint64_t seed : {3U, 1U, 2U, 9U}) ASSERT_TRUE((*results)->enter({entry_of(result_of_seed(seed))}));
    OperationResult broken = result_of_seed(2);
    broken.laws_broken = 1;
    broken.broken = "12.000 s pose: scope is 20.0 mm off";
    ASSERT_TRUE((*results)->enter({entry_of(broken)}));
  }
  const auto again = SeedResults::open(scratch / "o.sqlite", "operations of 2.5 minutes");
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(*(*again)->seeds(), (std::set<std::uint64_t>{1, 2, 3, 9}));
  const auto sum = sum_of(**again, 1, 3);
  ASSERT_TRUE(sum) << sum.error().what;
  EXPECT_EQ(sum->poses, 600U);
  EXPECT_EQ(sum->minutes, 7.5);
  EXPECT_EQ(sum->laws_broken, 1U);
  EXPECT_EQ(sum->first_broken, 2U);
  EXPECT_DOUBLE_EQ(sum->worst_circles, 0.3);
  EXPECT_EQ(sum->operations, 3U);
  EXPECT_EQ(words_by_fault(*sum),
            "  camera unplug                         6,     3 judged, named within 0.30 s, over within "
            "0.50 s of its end\n");
  EXPECT_EQ(sum->broken, "seed 2: 12.000 s pose: scope is 20.0 mm off\n");
}

TEST(SeedResults, ARowThatIsNotOfItsSeedIsToldAndMayBeRunAgain) {
  const Scratch scratch;
  const auto results = SeedResults::open(scratch / "o.sqlite", "operations of 2.5 minutes");
  ASSERT_TRUE(results && (*results)->enter({{1, line_of(result_of_seed(1))}, {2, line_of(result_of_seed(1))}}));
  const auto sum = sum_of(**results, 1, 2);
  ASSERT_FALSE(sum);
  EXPECT_NE(sum.error().what.find("seed 2: is of seed 1; delete its row"), std::string::npos) << sum.error().what;
  EXPECT_TRUE(sum_of(**results, 1, 1));
}

TEST(SeedResults, OfAnotherLengthAreNotMixedIn) {
  const Scratch scratch;
  ASSERT_TRUE(SeedResults::open(scratch / "o.sqlite", "operations of 2.5 minutes"));
  const auto other = SeedResults::open(scratch / "o.sqlite", "operations of 10 minutes");
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().what.find("of operations of 2.5 minutes, not of operations of 10 minutes"), std::string::npos)
      << other.error().what;
}

/// Many rows of which the middle of the file is gone; pages that nothing at the start reads.
TEST(SeedResults, ADamagedFileIsRefusedWithTheRemedy) {
  const Scratch scratch;
  {
    const auto results = SeedResults::open(scratch / "o.sqlite", "operations");
    ASSERT_TRUE(results);
    std::vector<SeedLine> lines;
    for (std::uint64_t seed = 1; seed <= 1000; ++seed) lines.push_back({seed, std::string(200, 'x')});
    ASSERT_TRUE((*results)->enter(lines));
  }
  std::fstream file(scratch / "o.sqlite", std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(100'000);
  file << std::string(20'000, '\7');
  file.close();
  const auto damaged = SeedResults::open(scratch / "o.sqlite", "operations");
  ASSERT_FALSE(damaged);
  EXPECT_NE(damaged.error().what.find("o.sqlite: "), std::string::npos) << damaged.error().what;
  EXPECT_NE(damaged.error().what.find("move this file away, and its seeds are run again"), std::string::npos)
      << damaged.error().what;
}

TEST(SeedResults, TheRemedyIsThatOfWhatIsWrong) {
  const Scratch scratch;
  const auto refused = [](const std::filesystem::path& file) {
    const auto opened = SeedResults::open(file, "operations");
    return opened ? std::string() : opened.error().what;
  };
  const std::string text = refused(scratch.file("text.sqlite", std::string(5000, 'x')));
  EXPECT_NE(text.find("is not a database; move this file away"), std::string::npos) << text;
  const std::string nowhere = refused(scratch / "none/o.sqlite");
  EXPECT_NE(nowhere.find("check the permissions"), std::string::npos) << nowhere;
}

TEST(OperationResults, ALineIsReadBackAndAnythingElseRefused) {
  const auto back = result_of(line_of(result_of_seed(7)));
  ASSERT_TRUE(back) << back.error().what;
  EXPECT_EQ(line_of(*back), line_of(result_of_seed(7)));
  for (const char* const line : {"", "{}", "no JSON", "{\"seed\": \"seven\"}"}) EXPECT_FALSE(result_of(line)) << line;
  std::string below = line_of(result_of_seed(7));
  const std::string count = "\"laws_broken\":";
  EXPECT_FALSE(result_of(below.insert(below.find(count) + count.size(), "-1")));
}

TEST(OperationResults, WordsSayWhereNothingWasJudgedAndWhereMoreLawsMayBeBroken) {
  OperationResult result;
  EXPECT_EQ(words_of_faults(result), "faults named (none judged), over (none judged)");
  EXPECT_EQ(words_of_laws(result), "0 laws broken");
  result.slowest_named_s = 0.5;
  result.slowest_over_s = 1.25;
  EXPECT_EQ(words_of_faults(result), "faults named within 0.50 s, over within 1.25 s");
  result.laws_broken = kMostLawsTold;
  const auto back = result_of(line_of(result));
  ASSERT_TRUE(back) << back.error().what;
  EXPECT_EQ(words_of_laws(*back), "100 or more laws broken");
  result.laws_broken = 99;
  EXPECT_EQ(words_of_laws(*result_of(line_of(result))), "99 laws broken");
}

constexpr double kMinutes = 0.5;

/// The seeds from 1 on.
SeedRun up_to(const Scratch& scratch, std::uint64_t last_seed) {
  SeedRun run;
  run.last_seed = last_seed;
  run.folder = scratch / "campaign";
  return run;
}

/// What comes of operations of half a minute.
Result<OperationResult> sum_of_operations(const SeedRun& run, const std::string& program, const Said& said) {
  const auto study = study_of_operations({.minutes = kMinutes}, program);
  if (!study) return study.error();
  const auto done = run_seeds(*study, run, said);
  if (!done) return done.error();
  if (!done->all) return done->all.error();
  return sum_of(*done->results, run.first_seed, run.last_seed);
}

void hear_nothing(const std::string&) {}

TEST(Campaign, RunsTheSeedsThatAreMissingAndNoOthers) {
  const Scratch scratch;
  const SeedRun run = up_to(scratch, 3);
  {
    std::filesystem::create_directories(run.folder);
    const auto study = study_of_operations({.minutes = kMinutes}, beside_us("birdseye-sim"));
    ASSERT_TRUE(study) << study.error().what;
    const auto known = SeedResults::open(run.folder / "operations.sqlite", study->what);
    ASSERT_TRUE(known && (*known)->enter({entry_of(result_of_seed(2))}));
  }
  std::string said;
  const auto sum =
      sum_of_operations(run, beside_us("birdseye-sim"), [&said](const std::string& line) { said += line + "\n"; });
  ASSERT_TRUE(sum) << sum.error().what;
  EXPECT_EQ(said, "2 of 2, 0 broke a law\n");
  EXPECT_GT(sum->poses, 2 * 30 * 2 * 90U);
  EXPECT_EQ(sum->laws_broken, 0U) << sum->broken;
}

TEST(Campaign, BeginsNoOperationOnceItsTimeIsOver) {
  const Scratch scratch;
  SeedRun run = up_to(scratch, 1000);
  run.at_most_s = 1e-9;
  const auto sum = sum_of_operations(run, beside_us("birdseye-sim"), hear_nothing);
  ASSERT_TRUE(sum) << sum.error().what;
  EXPECT_EQ(sum->minutes, 0);
}

TEST(Campaign, ResultsOfAnotherBuildAreRefused) {
  const Scratch scratch;
  ASSERT_TRUE(sum_of_operations(up_to(scratch, 1), "/bin/true", hear_nothing));
  const auto other = sum_of_operations(up_to(scratch, 1), "/bin/false", hear_nothing);
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().what.find("give another --out"), std::string::npos) << other.error().what;
  EXPECT_FALSE(sum_of_operations(up_to(scratch, 1), "/no/such/program", hear_nothing));
}

TEST(Campaign, AnOperationThatGivesNoResultBreaksALaw) {
  const Scratch scratch;
  std::string said;
  const auto sum =
      sum_of_operations(up_to(scratch, 1), "/bin/true", [&said](const std::string& line) { said += line + "\n"; });
  ASSERT_TRUE(sum) << sum.error().what;
  EXPECT_EQ(said, "1 of 1, 1 broke a law\n");
  EXPECT_EQ(sum->laws_broken, 1U);
  EXPECT_NE(sum->broken.find("seed 1: result: none"), std::string::npos) << sum->broken;
}

/// A program that answers as `birdseye-sim operation --line --shortest` does where its seed broke a law.
std::string program_that(const Scratch& scratch, const std::string& does) {
  const std::string path = scratch.file("operation", "#!/bin/sh\n" + does);
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

TEST(Campaign, HasTheShortestScriptOfASeedLookedFor) {
  const Scratch scratch;
  const auto asked = [&](const std::string& does, Duration patience) {
    return shortest_script_of(7, {.minutes = 1.5, .pictures = true}, program_that(scratch, does), scratch / "log",
                              patience);
  };
  const auto found = asked("echo '{}'\necho \"# $*\"\necho '[[fault]]'\nexit 3\n", Duration::from_ms(60'000));
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_EQ(*found, "# --end-with-stdin operation --line --seed 7 --minutes 1.5 --pictures --shortest\n[[fault]]\n");
  const auto none = asked("echo '{}'\nkill -SEGV $$\n", Duration::from_ms(60'000));
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().what.find("ended without one"), std::string::npos) << none.error().what;
  const auto late = asked("exec sleep 100\n", Duration::from_ms(50));
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, Errc::timeout);
}

/// A study that a shell does: script prints a line for the seed.
SeedStudy by_shell(const std::string& script) {
  return study_of({"sh", "-c", script}, Duration::from_ms(60'000));
}

/// All lines of a folder's results, by seed.
std::string all_lines(const SeedResults& results) {
  std::string out;
  (void)results.for_each(0, 1'000'000'000, [&out](const SeedLine& one) -> Result<void> {
    out += std::to_string(one.seed) + " " + one.line + "\n";
    return {};
  });
  return out;
}

/// Empty: all seeds have a result.
std::string why_not_all(const SeedsDone& done) {
  return done.all ? "" : done.all.error().what;
}

TEST(Campaign, OfAnyCommandKeepsItsLinesBySeed) {
  const Scratch scratch;
  const auto done = run_seeds(by_shell("echo '{\"twice\": '$(({} + {}))'}'"), up_to(scratch, 3), hear_nothing);
  ASSERT_TRUE(done) << done.error().what;
  EXPECT_TRUE(done->all);
  EXPECT_EQ(all_lines(*done->results), "1 {\"twice\": 2}\n2 {\"twice\": 4}\n3 {\"twice\": 6}\n");
}

TEST(Campaign, TriesAgainWhatGaveNoLineOfJson) {
  const Scratch scratch;
  const SeedStudy study = by_shell("test -e " + (scratch / "mended").string() +
                                   " || case {} in 2) echo none; exit ;; 3) exit 1 ;; esac; echo {}");
  const SeedRun run = up_to(scratch, 3);
  const auto some = run_seeds(study, run, hear_nothing);
  ASSERT_TRUE(some) << some.error().what;
  EXPECT_NE(why_not_all(*some).find("2 of 3 seeds gave no result, as seed "), std::string::npos) << why_not_all(*some);
  EXPECT_EQ(all_lines(*some->results), "1 1\n");  // what there is
  (void)scratch.file("mended", "");
  std::string said;
  const auto all = run_seeds(study, run, [&said](const std::string& line) { said += line + "\n"; });
  ASSERT_TRUE(all) << all.error().what;
  EXPECT_EQ(why_not_all(*all), "");
  EXPECT_EQ(said, "2 of 2\n");
  EXPECT_EQ(all_lines(*all->results), "1 1\n2 2\n3 3\n");
}

/// A study of operations that a shell does in their place.
SeedStudy operations_by_shell(const std::string& script) {
  SeedStudy study = *study_of_operations({.minutes = kMinutes}, "/bin/true");
  study.command = {"sh", "-c", script};
  return study;
}

/// As where memory runs short: that says nothing of the seed.
TEST(Campaign, TriesAgainWhatWasEndedFromOutside) {
  const Scratch scratch;
  const auto ended = run_seeds(operations_by_shell("kill -KILL $$"), up_to(scratch, 1), hear_nothing);
  ASSERT_TRUE(ended) << ended.error().what;
  EXPECT_NE(why_not_all(*ended).find("ended by signal 9"), std::string::npos) << why_not_all(*ended);
  EXPECT_TRUE(ended->results->seeds()->empty());
}

/// As where a folder is missing: that says nothing of the seed either. A crash does.
TEST(Campaign, TriesAgainWhatCouldNotBeRunButNotWhatCrashed) {
  const Scratch scratch;
  const auto done = run_seeds(operations_by_shell("test {} != 2 || kill -ABRT $$; echo why >&2; exit 2"),
                              up_to(scratch, 3), hear_nothing);
  ASSERT_TRUE(done) << done.error().what;
  EXPECT_NE(why_not_all(*done).find("2 of 3 seeds gave no result"), std::string::npos) << why_not_all(*done);
  const std::string log = (scratch / "campaign/campaign.log").string();
  EXPECT_NE(why_not_all(*done).find("could not be run, and ended with 2; " + log), std::string::npos)
      << why_not_all(*done);
  EXPECT_EQ(*done->results->seeds(), std::set<std::uint64_t>{2});
  const auto sum = sum_of(*done->results, 1, 3);
  ASSERT_TRUE(sum) << sum.error().what;
  EXPECT_NE(sum->broken.find("seed 2: result: none: its program crashed, with signal 6"), std::string::npos)
      << sum->broken;
}

TEST(Campaign, StopsWhereTenSeedsInARowGiveNoResult) {
  const Scratch scratch;
  SeedRun run = up_to(scratch, 1000);
  run.jobs = 1;
  const auto done =
      run_seeds(operations_by_shell("cd " + scratch.path().string() + "; echo >>ran; exit 2"), run, hear_nothing);
  ASSERT_TRUE(done) << done.error().what;
  EXPECT_NE(why_not_all(*done).find("10 seeds in a row gave no result"), std::string::npos) << why_not_all(*done);
  EXPECT_NE(why_not_all(*done).find("campaign.log"), std::string::npos) << why_not_all(*done);
  EXPECT_LT(contents_of(scratch / "ran").size(), 1000U);
}

/// Those that gave no result before come last: they stop a campaign, and no seed is kept from its turn.
TEST(Campaign, TriesNewSeedsBeforeThoseThatGaveNoResult) {
  const Scratch scratch;
  const std::string every_third = "test $(({} % 3)) != 0 && echo {}";
  SeedRun run = up_to(scratch, 36);
  run.jobs = 1;
  ASSERT_TRUE(run_seeds(by_shell(every_third), run, hear_nothing));
  run.last_seed = 60;
  const auto done = run_seeds(by_shell(every_third), run, hear_nothing);
  ASSERT_TRUE(done) << done.error().what;
  EXPECT_NE(why_not_all(*done).find("10 seeds in a row gave no result"), std::string::npos) << why_not_all(*done);
  EXPECT_EQ(done->results->seeds()->size(), 40U);
}

/// Nine, then one that gives a result, then nine more.
TEST(Campaign, GoesOnWhereFewerInARowGiveNoResult) {
  const Scratch scratch;
  SeedRun run = up_to(scratch, 19);
  run.jobs = 1;
  const auto done = run_seeds(by_shell("test {} = 10 && echo {}"), run, hear_nothing);
  ASSERT_TRUE(done) << done.error().what;
  EXPECT_NE(why_not_all(*done).find("18 of 19 seeds gave no result"), std::string::npos) << why_not_all(*done);
  EXPECT_EQ(all_lines(*done->results), "10 10\n");
}

TEST(Campaign, LeavesNoTemporaryFileOfWhatWasEndedFromOutside) {
  const Scratch scratch;
  const std::filesystem::path temporary = scratch / "temporary";
  std::filesystem::create_directory(temporary);
  const SetVariable set("TMPDIR", temporary.string());
  const std::string folder = "echo '\"'$TMPDIR'\"'; ";
  const auto done = run_seeds(by_shell("mkdir $TMPDIR/left-{}; test {} = 1 || kill -KILL $$; " + folder),
                              up_to(scratch, 2), hear_nothing);
  ASSERT_TRUE(done) << done.error().what;
  EXPECT_NE(why_not_all(*done).find("ended by signal 9"), std::string::npos) << why_not_all(*done);
  EXPECT_NE(all_lines(*done->results).find("1 \"" + (temporary / "birdseye-campaign-").string()), std::string::npos)
      << all_lines(*done->results);
  EXPECT_TRUE(std::filesystem::is_empty(temporary));
  EXPECT_EQ(::getenv("TMPDIR"), temporary.string());
}

TEST(Campaign, RemovesWhatADeadCampaignLeftAndNothingOfALivingOne) {
  const Scratch scratch;
  const SetVariable set("TMPDIR", scratch.path().string());
  std::filesystem::create_directories(scratch / "birdseye-campaign-dead00/birdseye-abcdef");
  (void)scratch.file("birdseye-campaign-dead00/.temporary-files-of-a-campaign", "");
  // Somebody's own, by two names that are like a campaign's.
  std::filesystem::create_directories(scratch / "birdseye-campaign-mine00");
  std::filesystem::create_directories(scratch / "birdseye-campaign-results/birdseye-abcdef");
  std::filesystem::create_directory(scratch / "birdseye-abcdef");  // nobody says whose it is
  std::filesystem::path path;
  {
    const auto living = ChildrenFolder::make();
    ASSERT_TRUE(living) << living.error().what;
    path = (*living)->path();
    EXPECT_FALSE(std::filesystem::exists(scratch / "birdseye-campaign-dead00"));
    EXPECT_TRUE(std::filesystem::exists(scratch / "birdseye-campaign-mine00"));
    EXPECT_TRUE(std::filesystem::exists(scratch / "birdseye-campaign-results/birdseye-abcdef"));
    const SetVariable again("TMPDIR", scratch.path().string());
    const auto other = ChildrenFolder::make();
    ASSERT_TRUE(other) << other.error().what;
    EXPECT_NE((*other)->path(), path);
    EXPECT_TRUE(std::filesystem::exists(path));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_TRUE(std::filesystem::exists(scratch / "birdseye-abcdef"));
}

TEST(Campaign, RunsNothingWhereTemporaryFilesHaveNoFolder) {
  const Scratch scratch;
  const SeedRun run = up_to(scratch, 100);
  const SetVariable set("TMPDIR", (scratch / "none").string());
  const auto done = run_seeds(by_shell("echo {}"), run, hear_nothing);
  ASSERT_FALSE(done);
  EXPECT_NE(done.error().what.find("set TMPDIR to a folder with room"), std::string::npos) << done.error().what;
}

/// The file is gone as soon as the program runs.
TEST(Campaign, RunsItsOwnProgramWhateverStandsAtItsPath) {
  const Scratch scratch;
  const std::filesystem::path program = scratch / "birdseye-sim";
  std::filesystem::copy_file(beside_us("birdseye-sim"), program);
  auto campaign = ChildProcess::start({program.string(), "campaign", "--alone", "--seeds", "1:2", "--minutes", "0.5",
                                       "--out", (scratch / "out").string()},
                                      scratch / "log");
  ASSERT_TRUE(campaign) << campaign.error().what;
  std::filesystem::remove(program);
  EXPECT_EQ(campaign->wait(Deadline::after(Duration::from_ms(100'000))), 0) << contents_of(scratch / "log");
  EXPECT_NE(contents_of(scratch / "log").find("2 of the 2 seeds"), std::string::npos) << contents_of(scratch / "log");
  const auto study = study_of_operations({.minutes = kMinutes}, beside_us("birdseye-sim"));
  ASSERT_TRUE(study) << study.error().what;
  EXPECT_TRUE(SeedResults::open(scratch / "out/operations.sqlite", study->what));
}

/// One of two was ended; the other's result is told all the same.
TEST(Campaign, PrintsWhatThereIsBeforeTheError) {
  const Scratch scratch;
  auto campaign = ChildProcess::start(
      {beside_us("birdseye-sim"), "campaign", "--alone", "--seeds", "1:2", "--print", "--out",
       (scratch / "out").string(), "--", "sh", "-c", "test {} = 1 || kill -KILL $$; echo '{\"seed\": '{}'}'"},
      scratch / "log");
  ASSERT_TRUE(campaign) << campaign.error().what;
  EXPECT_EQ(campaign->wait(Deadline::after(Duration::from_ms(100'000))), 2);
  const std::string log = contents_of(scratch / "log");
  EXPECT_NE(log.find("{\"seed\": 1}\n"), std::string::npos) << log;
  EXPECT_NE(log.find("1 of 2 seeds gave no result"), std::string::npos) << log;
}

/// What it said before may be of half of its work.
TEST(Campaign, ALineOfWhatDidNotEndWellCountsForNothing) {
  const Scratch scratch;
  for (const auto& [script, why] :
       {std::pair{"echo {}; exit 1", "ended with 1"}, {"echo {}; kill -ABRT $$", "signal 6"}}) {
    const auto ended = run_seeds(by_shell(script), up_to(scratch, 1), hear_nothing);
    ASSERT_TRUE(ended) << ended.error().what;
    EXPECT_NE(why_not_all(*ended).find(why), std::string::npos) << why_not_all(*ended);
    std::filesystem::remove_all(scratch / "campaign");
  }
}

TEST(Campaign, EndsWhereTheProgramIsNotThere) {
  const Scratch scratch;
  const auto done =
      run_seeds(study_of({"/no/such/program"}, Duration::from_ms(1000)), up_to(scratch, 1000), hear_nothing);
  ASSERT_TRUE(done) << done.error().what;
  ASSERT_FALSE(done->all);
  EXPECT_EQ(done->all.error().code, Errc::not_found) << done->all.error().what;
}

}  // namespace
}  // namespace birdseye::hw_sim
