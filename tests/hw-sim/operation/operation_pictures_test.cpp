// Whole operations in virtual time, whose video shows what the scope sees.
#include <gtest/gtest.h>

#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/hw-sim/operation/operations.hpp"

namespace birdseye::hw_sim {
namespace {

/// The window that is opened again takes up the deformation too.
TEST(OperationWithPictures, ViewsAreKeptAndTheCtIsMatchedWithThem) {
  const SimulatedOperation operation{
      .seed = 3, .minutes = 1, .faults = programs_end({{FaultKind::window_restart, 50, 2.0, {}}}), .pictures = true};
  const OperationOutcome out = operate(operation), again = operate(operation);
  EXPECT_EQ(out.log, again.log);
  EXPECT_EQ(out.hash, again.hash);
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.registrations, 1U) << out.log;
  EXPECT_EQ(out.deformations, 1U) << out.log;
  EXPECT_GT(static_cast<double>(out.laws.green), 0.4 * static_cast<double>(out.laws.shown)) << out.log;
  EXPECT_EQ(out.laws.beyond, 0U);
}

/// It was found by views of the former scope.
TEST(OperationWithPictures, ADeformationIsNotTakenUpWithAnotherScope) {
  const auto script = programs_end({usual(FaultKind::window_restart, 50, 8), usual(FaultKind::scope_exchanged, 51, 6)});
  const OperationOutcome out = operate({.seed = 3, .minutes = 2, .faults = script, .pictures = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.deformations, 1U) << out.log;
  EXPECT_EQ(out.registrations, 1U) << out.log;
  EXPECT_GT(out.log.rfind("the overlay is whole"), out.log.find("ends: program window_restart")) << out.log;
}

/// The window that is opened again takes up the calibration too.
TEST(OperationWithPictures, AScopeIsCalibratedOverABoardAndTheOverlayIsAsGoodAsItSays) {
  const OperationOutcome out = operate({.seed = kSeedAtBoard,
                                        .minutes = 1.5,
                                        .faults = programs_end({{FaultKind::window_restart, 84, 2.0, {}}}),
                                        .pictures = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_NE(out.log.find("step calibrate"), std::string::npos) << out.log;
  EXPECT_EQ(out.registrations, 1U) << out.log;
  EXPECT_GT(out.laws.green, 100U) << out.log;
  EXPECT_EQ(out.laws.beyond, 0U);
}

/// The window learns of the reference sensor a moment after the first poses.
TEST(OperationWithPictures, AWindowThatIsOpenedAgainDoesNotAccuseThePoses) {
  const OperationOutcome out = operate({.seed = 4,
                                        .minutes = 0.8,
                                        .faults = programs_end({{FaultKind::window_restart, 25, 2.0, {}}}),
                                        .pictures = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.log.find("do not agree"), std::string::npos) << out.log;
}

/// What is left of the places that are followed lies on rims and reflections, and does not go with the tissue.
TEST(OperationWithPictures, PlacesThatAreWornAccuseNobody) {
  const OperationOutcome out = operate({.seed = 41, .minutes = 0.5, .faults = FaultScript{}, .pictures = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.log.find("do not agree"), std::string::npos) << out.log;
}

/// Places that had been followed wrongly, and were fewer than a third, accused the poses at 216 s.
TEST(OperationWithPictures, MendedSeed33AccusesNobody) {
  const OperationOutcome out =
      operate({.seed = 33, .minutes = 4, .disk_fails = false, .more_befalls = false, .pictures = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
}

/// Pressed in haste with the pointer away from any landmark, Space once brought the overlay back, 30 mm off.
TEST(OperationWithPictures, ABumpThatWasSeenBringsNothingBackUnlooked) {
  FaultScript script;
  script.world = {{FaultKind::transmitter_bumped, 60, std::nullopt, {{"mm", 15}, {"deg", 5}, {"over_s", 0.2}}}};
  const OperationOutcome out = operate({.seed = 5, .minutes = 3.5, .faults = script, .pictures = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.laws.moved, 1U) << out.log;
  EXPECT_EQ(out.laws.moved_unwatched, 0U) << out.log;
  EXPECT_NE(out.log.find("not confirmed: the pointer is"), std::string::npos) << out.log;
  EXPECT_EQ(out.registrations, 2U) << "the second anew\n" << out.log;
  EXPECT_NE(out.log.rfind("the overlay is whole"), std::string::npos);
  EXPECT_GT(out.log.rfind("the overlay is whole"), out.log.rfind("the patient is not registered yet")) << out.log;
}

/// Without a reference: the overlay runs from 50 s on.
OperationOutcome operate_with(const Fault& of_world, std::vector<Fault> of_tracker = {}) {
  FaultScript script;
  script.world = {of_world};
  script.tracker = std::move(of_tracker);
  OperationOutcome out = operate({.seed = 3, .minutes = 1.1, .faults = script, .reference = false, .pictures = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  return out;
}

/// The operation's time (s) of the first line of the log, at from_s or later, that has this text. Infinite: none has.
double says_at_s(const std::string& log, const std::string& text, double from_s) {
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    const double at_s = std::stod(line);
    if (at_s >= from_s && line.find(text) != std::string::npos) return at_s;
  }
  return std::numeric_limits<double>::infinity();
}

/// The overlay stayed for five seconds once: the places in the video went round, and were lost before they told enough.
TEST(OperationWithPictures, AScopeThatTurnsInItsHolderTakesTheOverlayAway) {
  const OperationOutcome out = operate_with(usual(FaultKind::scope_turned, 60, 30, {{"deg", 30}, {"over_s", 0.5}}));
  EXPECT_LT(says_at_s(out.log, "there is no overlay", 60), 60.7) << out.log;
  const std::size_t turned = out.log.find("world scope_turned");
  EXPECT_GT(out.log.rfind("the overlay is whole", turned), out.log.rfind("there is no overlay", turned)) << out.log;
  EXPECT_EQ(out.log.find("the overlay is whole", turned), std::string::npos) << out.log;
}

/// The overlay stayed for five seconds once: as the scope turned, places that had begun to go with it made way for new
/// ones, to which only the rest of the turn was to be seen.
TEST(OperationWithPictures, AScopeThatTurnsWhileNewPlacesAreChosenTakesTheOverlayAway) {
  const OperationOutcome out = operate_with(usual(FaultKind::scope_turned, 59.3, 30, {{"deg", 30}, {"over_s", 0.5}}));
  EXPECT_LT(says_at_s(out.log, "there is no overlay", 59.3), 60) << out.log;
}

/// The overlay came back once: no pose came for 0.4 s, and the places in the video were lost meanwhile.
TEST(OperationWithPictures, AScopeThatTurnsWhileNoPoseComesIsNotDrawnBy) {
  const OperationOutcome out = operate_with(usual(FaultKind::scope_turned, 60, 30, {{"deg", 30}, {"over_s", 0.5}}),
                                            {usual(FaultKind::lost_record, 60.25, 0.2, {{"chance", 1}})});
  EXPECT_EQ(says_at_s(out.log, "the overlay is whole", 60.7), std::numeric_limits<double>::infinity()) << out.log;
}

/// The overlay came back twice once, 11 mm off: the places were just within what is allowed, and the next ones were
/// chosen there.
TEST(OperationWithPictures, MendedSeed6000094SawNoAgreementInPlacesThatAreNearlyOff) {
  FaultScript script;
  script.world = {usual(FaultKind::scope_turned, 33.621, 21.39, {{"deg", -37.635}, {"over_s", 0.5}})};
  const OperationOutcome out =
      operate({.seed = 6'000'094, .minutes = 0.7, .faults = script, .reference = false, .pictures = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(says_at_s(out.log, "the overlay is whole", 34.2), std::numeric_limits<double>::infinity()) << out.log;
}

TEST(OperationWithPictures, ALensThatIsZoomedTakesTheOverlayAway) {
  const OperationOutcome out = operate_with(usual(FaultKind::lens_zoomed, 52, 20, {{"factor", 1.3}, {"over_s", 0.5}}));
  const std::size_t zoomed = out.log.find("world lens_zoomed");
  EXPECT_NE(out.log.find("the round field is larger", zoomed), std::string::npos) << out.log;
  EXPECT_EQ(out.log.find("the overlay is whole", zoomed), std::string::npos) << out.log;
}

}  // namespace
}  // namespace birdseye::hw_sim
