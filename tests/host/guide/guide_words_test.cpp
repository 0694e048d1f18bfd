#include "host/guide/guide_words.hpp"

#include <gtest/gtest.h>

#include "calibration/base/units.hpp"
#include "host/texts/texts.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using calibration::BoardPlace;
using calibration::PictureWay;
using calibration::ScopeMove;

ScopeMove turned(double degrees) {
  ScopeMove move;
  move.turn_rad = degrees * kRadPerDeg;
  return move;
}

TEST(GuideWords, NameWhatIsToBeDoneInOneSentence) {
  EXPECT_EQ(words_of(ScopeMove{}), "hold the scope where it is");
  ScopeMove move;
  move.tilt = {31 * kRadPerDeg, PictureWay::down_left};
  EXPECT_EQ(words_of(move), "tilt the scope 30 degrees down and to the left, as the picture shows it");
  move = {};
  move.nearer_mm = 20.2;
  EXPECT_EQ(words_of(move), "go 20 mm nearer");
  move.board = BoardPlace::lower_left;
  EXPECT_EQ(words_of(move), "go 20 mm nearer, and bring the board to the lower left of the picture");
  move.nearer_mm = -30;
  move.turn_rad = -90 * kRadPerDeg;
  EXPECT_EQ(words_of(move),
            "turn it a quarter of a turn anticlockwise about its long axis, draw back by 30 mm, and bring the board to "
            "the lower left of the picture");
}

TEST(GuideWords, NameTurnsByEighthsWhereTheyAreNear) {
  EXPECT_EQ(words_of(turned(90)), "turn it a quarter of a turn clockwise about its long axis");
  EXPECT_EQ(words_of(turned(45)), "turn it an eighth of a turn clockwise about its long axis");
  EXPECT_EQ(words_of(turned(70)), "turn it 70 degrees clockwise about its long axis");
  EXPECT_EQ(words_of(turned(135)), "turn it three eighths of a turn clockwise about its long axis");
  EXPECT_EQ(words_of(turned(-180)), "turn it half a turn anticlockwise about its long axis");
}

TEST(GuideWords, SayFromWhereAndWhatToDoFirst) {
  calibration::NextPose next;
  EXPECT_EQ(words_of(next), "bring the whole board into the picture: draw back, or take a smaller board");
  next.move.emplace();
  EXPECT_EQ(words_of(next), "hold the scope where it is");
  next.from_straight = true;
  EXPECT_EQ(words_of(next), "from straight before the board, its x axis to the right: hold the scope where it is");
  EXPECT_EQ(words_of(Grade::marginal), "marginal");
}

TEST(GuideWords, AreOfTheTableThatALanguageReplaces) {
  const testing::Scratch scratch;
  const auto english = scratch.file("english.json", language_text());
  ASSERT_TRUE(speak(scratch.file("german.json", R"({"guide_hold": "das Endoskop so halten"})")));
  EXPECT_EQ(words_of(ScopeMove{}), "das Endoskop so halten");
  EXPECT_TRUE(speak(english));
}

}  // namespace
}  // namespace birdseye::host
