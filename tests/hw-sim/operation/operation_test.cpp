// Whole operations in virtual time.
#include "hw-sim/operation/operation.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hw-sim/faults/fault_table.hpp"
#include "hw-sim/operation/operation_faults.hpp"
#include "hw-sim/operation/shortest_script.hpp"
#include "tests/hw-sim/operation/operations.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

TEST(Operation, WithoutAFaultTheOverlayIsWholeOnceThePatientIsRegistered) {
  const OperationOutcome out = operate({.seed = 11, .minutes = 2, .faults = FaultScript{}});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.registrations, 1U) << out.log;
  EXPECT_GE(out.checks, 1U) << out.log;
  EXPECT_GT(static_cast<double>(out.laws.green), 0.8 * static_cast<double>(out.laws.shown)) << out.log;
  EXPECT_EQ(out.laws.beyond, 0U);
  EXPECT_GT(out.laws.poses, 2 * 100 * 110U);
  EXPECT_GT(out.laws.frames, 25 * 115U);
}

TEST(Operation, GoesOnWhereALinkIsCutAndTheApplianceStartsAgain) {
  const auto script = programs_end({{FaultKind::link_cut, 40, {}, {}}, {FaultKind::appliance_restart, 60, 3.0, {}}});
  const OperationOutcome out = operate({.seed = 11, .minutes = 2, .faults = script});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.registrations, 1U) << "nobody registers again\n" << out.log;
  EXPECT_EQ(out.checks, 1U) << out.log;
  EXPECT_GT(static_cast<double>(out.laws.green), 0.7 * static_cast<double>(out.laws.shown)) << out.log;
  EXPECT_GT(out.laws.faults_judged, 1U);
}

TEST(Operation, AWindowThatIsOpenedAgainTakesUpWhatWasFoundAndAsksForALandmark) {
  const auto script = programs_end({{FaultKind::window_restart, 40, 5.0, {}}});
  const OperationOutcome out = operate({.seed = 11, .minutes = 2, .faults = script});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.registrations, 1U) << out.log;
  EXPECT_EQ(out.checks, 2U) << out.log;
  EXPECT_GT(static_cast<double>(out.laws.green), 0.6 * static_cast<double>(out.laws.shown)) << out.log;
  const OperationOutcome again = operate({.seed = 11, .minutes = 2, .faults = script});
  EXPECT_EQ(out.log, again.log) << "its files are read in no time at all";
  EXPECT_EQ(out.hash, again.hash);
}

/// Twenty seconds of video come three seconds late, and then what had piled up.
TEST(Operation, ASlowNetworkBringsNoOldOverlay) {
  const auto script = programs_end({usual(FaultKind::link_late, 45, 20, {{"ms", 3000}})});
  const OperationOutcome out = operate({.seed = 11, .minutes = 2, .faults = script});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.registrations, 1U) << out.log;
  EXPECT_GT(static_cast<double>(out.laws.green), 0.5 * static_cast<double>(out.laws.shown)) << out.log;
}

/// What had come meanwhile is taken at once; none of it is live.
TEST(Operation, AWindowThatStoodStillBringsNoOldOverlay) {
  const auto script = programs_end({usual(FaultKind::window_stalls, 45, 0.4), usual(FaultKind::window_stalls, 50, 8)});
  const OperationOutcome out = operate({.seed = 11, .minutes = 1.5, .faults = script});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.laws.fullest_queue, 1) << "of the frames for the window";
  EXPECT_EQ(out.registrations, 1U) << out.log;
  EXPECT_GT(static_cast<double>(out.laws.green), 0.6 * static_cast<double>(out.laws.shown)) << out.log;
}

TEST(Operation, ATableThatIsTiltedTakesTheReferenceAlong) {
  FaultScript script;
  script.world = {{FaultKind::bed_tilted, 45, 20.0, {{"deg", 15}, {"over_s", 3}}}};
  const OperationOutcome out = operate({.seed = 11, .minutes = 1.5, .faults = script, .reference = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.registrations, 1U) << out.log;
}

/// What is kept is asked for of a window that is opened while the instruments are away, too.
TEST(Operation, ARegistrationThatIsHeldBackIsKept) {
  const auto script =
      programs_end({usual(FaultKind::appliance_restart, 60, 15), usual(FaultKind::window_restart, 65, 4)});
  const OperationOutcome out = operate({.seed = 11, .minutes = 2, .faults = script});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.registrations, 1U) << out.log;
}

/// The patient was moved while no window was open, by less than a landmark may be off: the circle is as large as that.
TEST(Operation, ALandmarkThatIsOffMakesTheCircleAsLarge) {
  for (const std::uint64_t seed : {12U, 16U}) {
    FaultScript script = programs_end({usual(FaultKind::window_restart, 120, 5)});
    script.world = {{FaultKind::transmitter_bumped, 122, std::nullopt, {{"mm", 7}, {"deg", 0}, {"over_s", 0.2}}}};
    const OperationOutcome out = operate({.seed = seed, .minutes = 4, .faults = script, .reference = false});
    EXPECT_TRUE(out.broken.empty()) << seed << "\n" << told(out);
    EXPECT_EQ(out.laws.moved_unwatched, 1U);
    script.programs.push_back(usual(FaultKind::scope_exchanged, 180, 4));
    const OperationOutcome exchanged = operate({.seed = seed, .minutes = 5, .faults = script, .reference = false});
    EXPECT_TRUE(exchanged.broken.empty()) << seed << "\n" << told(exchanged);
  }
}

/// Seed 2000368. A law was wrong: what is held back as long as the network brings nothing is not lost.
TEST(Operation, ARegistrationThatIsHeldBackForLongIsNotLost) {
  const auto script =
      programs_end({usual(FaultKind::window_restart, 60, 4), usual(FaultKind::link_late, 64.6, 13, {{"ms", 2342}})});
  const OperationOutcome out = operate({.seed = 11, .minutes = 2, .faults = script, .reference = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

/// Seed 79. Touches of a moment ago came late over the network, after the step had begun, and a rest whose end nobody
/// saw went on at the next place: three touches that fitted one another made an overlay 9 mm off.
TEST(Operation, MendedSeed79TouchesNothingLate) {
  const OperationOutcome out = operate({.seed = 79, .minutes = 5});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

/// Seed 1. What came over the new connection was taken to be as young as it had come, until the appliance had told its
/// time: pictures two seconds old had an overlay.
TEST(Operation, ANewConnectionOverASlowNetworkBringsNoOldOverlay) {
  const auto script =
      programs_end({usual(FaultKind::link_late, 45, 12, {{"ms", 1975}}), {FaultKind::link_cut, 47, {}, {}}});
  const OperationOutcome out = operate({.seed = 11, .minutes = 1.5, .faults = script});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_NE(out.log.find("the appliance has not told its time yet"), std::string::npos) << out.log;
}

TEST(Operation, AnotherScopeIsDrawnWithByItsOwnRecord) {
  const auto script =
      programs_end({usual(FaultKind::scope_exchanged, 45, 4), usual(FaultKind::scope_exchanged, 80, 4)});
  const OperationOutcome out = operate({.seed = 11, .minutes = 2, .faults = script});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.registrations, 1U) << "a scope has no part in it\n" << out.log;
  EXPECT_GT(static_cast<double>(out.laws.green), 0.6 * static_cast<double>(out.laws.shown)) << out.log;
  EXPECT_EQ(out.laws.beyond, 0U);
}

TEST(Operation, AScopeWithoutARecordIsNotExchanged) {
  const auto script = programs_end({usual(FaultKind::scope_exchanged, 45, 4)});
  const auto out = run_operation({.seed = kSeedAtBoard, .minutes = 1, .faults = script, .pictures = true});
  ASSERT_FALSE(out);
  EXPECT_NE(out.error().what.find("give another seed"), std::string::npos) << out.error().what;
}

TEST(Operation, FaultsAtRandomBreakNoLaw) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const OperationOutcome out = operate({.seed = seed, .minutes = 4});
    EXPECT_TRUE(out.broken.empty()) << "seed " << seed << "\n" << told(out);
    EXPECT_GT(out.laws.faults, 3U);
    EXPECT_GT(out.laws.green, 0U) << out.log;
    EXPECT_EQ(out.log.find("there is no overlay: \n"), std::string::npos) << "it says why, always";
  }
}

TEST(Operation, TheReferenceIsTheOneAskedForOrElseTheSeeds) {
  for (const bool reference : {false, true})
    EXPECT_EQ(operate({.seed = 1, .minutes = 0.5, .reference = reference}).reference, reference);
  EXPECT_FALSE(operate({.seed = 1, .minutes = 0.5}).reference);
  EXPECT_TRUE(operate({.seed = 3, .minutes = 0.5}).reference);
}

/// Seeds of operations that broke a law once:
/// - 4, 17: a bird that was frozen from its first record on, after a power cycle and after readings that were doubted,
///   had a pose for a second;
/// - 1003, 1004, 1023, 1076, 1093: a frozen bird on a damaged line, and readings between damaged ones and after lost
///   ones that had been changed by less than shows, made poses up to 109 mm off;
/// - 1009: a frozen bird had a pose until its eighth record, where it could be told after the fourth;
/// - 85: a bird that froze while it was saturated had a pose after that, as its repeated record confirmed itself;
/// - 104: on a damaged line a pose was predicted from three readings, of which one was changed by less than shows, and
///   was 84 mm off where 61 were allowed.
class MendedSeed : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(MendedSeed, BreaksNoLawAnyMore) {
  const OperationOutcome out =
      operate({.seed = GetParam(), .minutes = 10, .programs_end = false, .disk_fails = false, .more_befalls = false});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

INSTANTIATE_TEST_SUITE_P(Operation, MendedSeed, ::testing::Values(4, 17, 85, 104, 1003, 1004, 1009, 1023, 1076, 1093),
                         [](const auto& of) { return std::to_string(of.param); });

/// - 106, 168, 229, 260: a bird that had frozen before birdseyed was started again had poses, as one at rest has;
/// - 1307: so had one that was frozen as its unit fell silent and came back;
/// - 1477: a bird that froze six seconds after birdseyed was started again, three of them over a damaged line, was
///   found out after eight records in place of three, for how often its record repeats was not known yet;
/// - 66263751: damaged records among those of a bird that froze before birdseyed was started passed for signs of life;
/// - 66263737: on a line that loses and damages records, one that came after 116 ms was 286 mm off;
/// - 206351423: a law was wrong: of frames that are damaged by chance, the first comes when it comes.
class MendedSeedOfPrograms : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(MendedSeedOfPrograms, BreaksNoLawAnyMore) {
  const OperationOutcome out = operate({.seed = GetParam(), .minutes = 10, .disk_fails = false, .more_befalls = false});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

INSTANTIATE_TEST_SUITE_P(Operation, MendedSeedOfPrograms,
                         ::testing::Values(106, 168, 229, 260, 1307, 1477, 66263737, 66263751, 206351423),
                         [](const auto& of) { return std::to_string(of.param); });

/// A law was wrong: the reference slipped, and 70 ms later the tracker lost its power, and with it the poses by which
/// the slip would have been seen before the frames of these 70 ms were drawn: three pictures were 11.8 mm off.
TEST(Operation, MendedSeed95012033SlipsWhereNoPoseComesToTellOfIt) {
  FaultScript script;
  script.tracker = {usual(FaultKind::drift_step, 100.086, 8.655, {{"ppm", 2844.589}}),
                    usual(FaultKind::power_cycle, 131.741, 1.595, {{"boot_s", 0.893}})};
  script.world = {usual(FaultKind::reference_moved, 102.331, 29.347, {{"deg", 10}, {"mm", 21.13}, {"over_s", 0.1}})};
  const OperationOutcome out = operate({.seed = 95012033, .minutes = 2.4, .faults = script, .reference = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

/// A law was wrong: one byte lost and another's bit turned over made a record of pieces of two, 5.2 mm off where 4.0
/// were allowed. A hand might have moved so.
TEST(Operation, MendedSeed2021HasARecordOfPiecesOfTwo) {
  FaultScript script;
  script.tracker = {usual(FaultKind::drop_byte, 438.058, 4.202, {{"chance", 0.464}}),
                    usual(FaultKind::wrong_phase_bit, 438.716, 2.705, {{"chance", 0.98}})};
  const OperationOutcome out = operate({.seed = 2021, .minutes = 7.6, .faults = script});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

/// A law was wrong: of a bird that froze in a hole of 80 ms the first record was new, and 4.5 mm off where 4.1 were
/// allowed. A hand might have stopped so.
TEST(Operation, MendedSeed2000017HasABirdThatFreezesInAHole) {
  FaultScript script;
  script.tracker = {usual(FaultKind::wrong_phase_bit, 286.229, 4.928, {{"chance", 0.601}}),
                    usual(FaultKind::frozen_pose, 286.624, 1.097)};
  const OperationOutcome out = operate({.seed = 2000017, .minutes = 4.9, .faults = script});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

/// A law was wrong: of a bird that froze 0.8 s after birdseyed was started again eight records had to tell, 85 ms, and
/// a pose was 3.9 mm off where 3.7 were allowed.
TEST(Operation, MendedSeed5000221HasABirdThatFreezesBeforeItsNoiseIsKnown) {
  FaultScript script;
  script.tracker = {usual(FaultKind::drift_step, 294.68, 7.277, {{"ppm", 1536.15}}),
                    usual(FaultKind::frozen_pose, 474.024, 1.904)};
  script.programs = {usual(FaultKind::appliance_restart, 464.986, 6.688)};
  const OperationOutcome out = operate({.seed = 5000221, .minutes = 8.13, .faults = script});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

/// A law was wrong: of six touches, taken back one after the other, five gave a registration, and the power went as
/// that was being written.
TEST(Operation, MendedSeed219663286TakesUpWhatWasTakenBackAsItWasWritten) {
  FaultScript script =
      programs_end({usual(FaultKind::window_restart, 51.633, 7.75), usual(FaultKind::appliance_restart, 64.324, 9.377),
                    usual(FaultKind::power_cut, 113.537, 47.16, {{"after_syncs", 2}})});
  script.tracker = {usual(FaultKind::power_cycle, 100.555, 3.866, {{"boot_s", 1.856}})};
  const OperationOutcome out = operate({.seed = 219663286, .minutes = 3, .faults = script, .reference = false});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_NE(out.log.find("the window's machine has no power"), std::string::npos);
}

/// A law was wrong: a pointer that froze as it turned was 1.7 degrees off before its records told of it.
TEST(Operation, MendedSeed2000503HasAPointerThatFreezesAsItTurns) {
  const OperationOutcome out = operate({.seed = 2000503, .minutes = 6.5});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

/// A law was wrong: it looked ten times a second, and took for lost what a first touch anew had dropped just before the
/// power went.
TEST(Operation, MendedSeed108797437DroppedItsRegistrationItself) {
  const OperationOutcome out = operate({.seed = 108797437, .minutes = 10, .more_befalls = false});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

/// A touch before the window that was opened again had heard of the reference dropped the registration that it held
/// back meanwhile.
TEST(Operation, MendedSeedsTouchedAnewBeforeTheReferenceWasKnown) {
  for (const auto& [seed, minutes] : {std::pair{260668121U, 6.0}, {145140002U, 9.0}}) {
    const OperationOutcome out = operate({.seed = seed, .minutes = minutes, .more_befalls = false});
    EXPECT_TRUE(out.broken.empty()) << told(out);
  }
}

/// The window keeps what it has after each touch from the third on; the power goes after any of the syncs of that, or
/// while nothing is written.
TEST(Operation, APowerCutAfterAnySyncLosesNothingThatWasKept) {
  std::set<bool> taken_up;
  for (int syncs = 0; syncs <= 28; ++syncs) {
    const auto cut = usual(FaultKind::power_cut, 5, 70, {{"after_syncs", syncs}});
    const OperationOutcome out = operate({.seed = 11, .minutes = 2.5, .faults = programs_end({cut})});
    EXPECT_TRUE(out.broken.empty()) << syncs << "\n" << told(out);
    EXPECT_NE(out.log.find("no power"), std::string::npos) << syncs;
    EXPECT_GT(out.laws.green, 100U) << syncs << "\n" << out.log;
    // Where it went before the registration was kept, the patient is registered again.
    taken_up.insert(out.log.find("step fiducials: 0 touched", out.log.find("no power")) == std::string::npos);
  }
  EXPECT_EQ(taken_up.size(), 2U);
}

/// It writes what it took up, and loses its power again.
TEST(Operation, APowerCutWhileTheRegistrationIsTakenUpLosesNothing) {
  for (int syncs = 1; syncs <= 4; ++syncs) {
    const auto again = usual(FaultKind::window_restart, 30, 2),
               cut = usual(FaultKind::power_cut, 31, 16, {{"after_syncs", syncs}});
    const OperationOutcome out = operate({.seed = 11, .minutes = 1.5, .faults = programs_end({again, cut})});
    EXPECT_TRUE(out.broken.empty()) << syncs << "\n" << told(out);
    const std::size_t gone = out.log.find("no power");
    ASSERT_NE(gone, std::string::npos) << out.log;
    EXPECT_EQ(out.log.find("step fiducials: 0 touched", gone), std::string::npos) << out.log;
  }
}

TEST(Operation, ACutOfPowerIsTheSameEachTime) {
  const auto script = programs_end({usual(FaultKind::power_cut, 10, 20, {{"after_syncs", 3}})});
  const OperationOutcome out = operate({.seed = 12, .minutes = 1.5, .faults = script});
  EXPECT_EQ(out.hash, operate({.seed = 12, .minutes = 1.5, .faults = script}).hash);
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

TEST(Operation, AWindowWhoseDiskIsFullSaysSoAndGoesOn) {
  const auto full = usual(FaultKind::disk_full, 1, 60), again = usual(FaultKind::window_restart, 80, 2);
  const OperationOutcome out = operate({.seed = 11, .minutes = 2, .faults = programs_end({full, again})});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_GT(static_cast<double>(out.laws.green), 0.6 * static_cast<double>(out.laws.shown)) << out.log;
  // Once the disk has room, it is kept after all.
  const std::size_t opened = out.log.find("ends: program window_restart");
  ASSERT_NE(opened, std::string::npos) << out.log;
  EXPECT_EQ(out.log.find("step fiducials", opened), std::string::npos) << out.log;
}

/// Seed 52709211. The next touch came before the disk had told what became of the last, which nobody heard of then.
TEST(Operation, AFullDiskThatTellsLateIsToldWhateverIsFoundMeanwhile) {
  const auto late = usual(FaultKind::disk_late, 1, 60, {{"ms", 3000}}), full = usual(FaultKind::disk_full, 1, 60);
  const OperationOutcome out = operate({.seed = 11, .minutes = 1.5, .faults = programs_end({late, full})});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

TEST(Operation, ALateDiskDelaysNoPicture) {
  const auto late = usual(FaultKind::disk_late, 1, 110, {{"ms", 1500}});
  const OperationOutcome out = operate({.seed = 11, .minutes = 2, .faults = programs_end({late})});
  const OperationOutcome quick = operate({.seed = 11, .minutes = 2, .faults = FaultScript{}});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.laws.green, quick.laws.green);
}

TEST(Operation, TheSameSeedIsTheSameOperationToTheBit) {
  const OperationOutcome first = operate({.seed = 5, .minutes = 1.5}), again = operate({.seed = 5, .minutes = 1.5});
  EXPECT_EQ(first.log, again.log);
  EXPECT_EQ(first.hash, again.hash);
  EXPECT_EQ(first.time.order_hash, again.time.order_hash);
  EXPECT_NE(operate({.seed = 6, .minutes = 1.5}).hash, first.hash);
}

TEST(Operation, OneCoreOrManyMakeTheSameOfIt) {
  const SimulatedOperation operation{.seed = 5, .minutes = 0.5, .pictures = true};
  const OperationOutcome many = operate(operation);
  const tbb::global_control one_core(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(operate(operation).hash, many.hash);
}

TEST(Operation, ItsFaultsAreReadBackFromTheScriptThatItWrites) {
  const birdseye::testing::Scratch scratch;
  FaultScript drawn = draw_faults(7, 20, 3600, true);
  drawn.programs = draw_program_faults(7, 20, 3600);
  const auto read = read_fault_script(scratch.file("faults.toml", text_of(drawn)), Instruments::with_programs, 1);
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(text_of(*read), text_of(drawn));
  EXPECT_GT(drawn.tracker.size(), 50U);
  EXPECT_GT(drawn.camera.size(), 30U);
  EXPECT_GT(drawn.world.size(), 3U);
  EXPECT_GT(drawn.programs.size(), 10U);
}

TEST(ShortestScript, HasWhatBreaksAndNothingElse) {
  const FaultScript all = draw_faults(7, 0, 1200, true);
  int tried = 0;
  const auto has = [](const std::vector<Fault>& faults, FaultKind kind) {
    return std::ranges::any_of(faults, [kind](const Fault& fault) { return fault.kind == kind; });
  };
  const FaultKind first = all.tracker.at(2).kind, second = all.camera.at(1).kind;
  const FaultScript few = shortest_script(all, [&](const FaultScript& script) {
    ++tried;
    return has(script.tracker, first) && has(script.camera, second);
  });
  EXPECT_EQ(few.tracker.size(), 1U);
  EXPECT_EQ(few.camera.size(), 1U);
  EXPECT_TRUE(few.world.empty());
  EXPECT_LT(tried, 300);
}

TEST(OperationFaults, BumpsInViewAreDrawnWhereNothingElseHidesThem) {
  std::size_t bumps = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    FaultScript script = draw_faults(seed, 20, 590, false);
    EXPECT_TRUE(script.world.empty());
    draw_bumps_in_view(seed, 20, 590, script);
    bumps += script.world.size();
    for (const Fault& bump : script.world)
      for (const Fault& other : script.camera)
        for (const double moves_s : {bump.at_s, bump.at_s + *bump.for_s})
          EXPECT_TRUE(moves_s < other.at_s - 5 || moves_s > other.at_s + *other.for_s + 5) << seed << ": " << moves_s;
  }
  EXPECT_GE(bumps, 8U);
}

TEST(OperationFaults, EveryFaultOfAnInstrumentCanBefall) {
  std::vector<std::string> drawn;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const FaultScript script = draw_faults(seed, 0, 3600, true);
    for (const Fault& fault : script.tracker) drawn.push_back("tracker " + std::string(fault_name(fault.kind)));
    for (const Fault& fault : script.camera) drawn.push_back("camera " + std::string(fault_name(fault.kind)));
    for (const auto& faults : {draw_program_faults(seed, 0, 3600), draw_delays(seed, 0, 3600),
                               draw_scope_exchanges(seed, 0, 3600), draw_disk_faults(seed, 0, 3600),
                               draw_appliance_power_cuts(seed, 0, 3600), draw_appliance_disk_faults(seed, 0, 3600)})
      for (const Fault& fault : faults) drawn.push_back("program " + std::string(fault_name(fault.kind)));
  }
  for (const FaultSpec& spec : fault_table()) {
    const std::string name(fault_name(spec.kind));
    EXPECT_TRUE(!spec.of_tracker || std::ranges::count(drawn, "tracker " + name) > 0) << name;
    EXPECT_TRUE(!spec.of_camera || std::ranges::count(drawn, "camera " + name) > 0) << name;
    EXPECT_TRUE(!spec.of_program || std::ranges::count(drawn, "program " + name) > 0) << name;
  }
}

}  // namespace
}  // namespace birdseye::hw_sim
