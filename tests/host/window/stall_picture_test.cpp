#include "host/window/stall_picture.hpp"

#include <gtest/gtest.h>

#include "host/texts/texts.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

TEST(StallPicture, SaysInThePresentLanguageWhatItsFontCanWrite) {
  const testing::Scratch scratch;
  const std::string english = scratch.file("english.json", language_text());
  const auto drawn_in = [&](const std::string& json) {
    EXPECT_TRUE(speak(scratch.file("language.json", json)));
    Picture picture = stall_picture(1);
    EXPECT_TRUE(speak(english));
    return picture.rgb;
  };
  const auto in_english = stall_picture(1).rgb;
  EXPECT_NE(drawn_in(R"({"stall_not_live": "NICHT LIVE"})"), in_english);
  EXPECT_EQ(drawn_in(R"({"stall_not_live": "KEIN LIVE-BILD: ÄÖÜ"})"), in_english);
}

}  // namespace
}  // namespace birdseye::host
