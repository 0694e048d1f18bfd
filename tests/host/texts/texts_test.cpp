#include "host/texts/texts.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::Scratch;

TEST(Texts, EachKeyIsThereOnceWithWordsThatAFormatTakes) {
  std::set<std::string_view> keys;
  for (const EnglishText& text : kEnglish) {
    EXPECT_TRUE(keys.insert(text.key).second) << text.key << " is there twice";
    EXPECT_FALSE(text.english.empty()) << text.key;
    EXPECT_GE(places_in(text.english), 0) << text.key;
  }
}

TEST(Texts, AreSentencesInPlainWords) {
  for (const EnglishText& text : kEnglish) {
    EXPECT_EQ(text.english.find("+-"), std::string_view::npos) << text.key << ": write ±";
    EXPECT_EQ(text.english.find("  "), std::string_view::npos) << text.key;
    // What is read in a glance: no sentence of more than 20 words.
    std::size_t words_so_far = 1;
    for (std::size_t i = 0; i < text.english.size(); ++i) {
      const char c = text.english[i];
      if (c == ' ') ++words_so_far;
      if (c == '.' || c == ':' || c == ';') words_so_far = 0;
      EXPECT_LE(words_so_far, 20U) << text.key << ": " << text.english;
    }
  }
}

TEST(Texts, CountsWhatATextTakes) {
  EXPECT_EQ(places_in("so"), 0);
  EXPECT_EQ(places_in("{} of {:.1f} mm"), 2);
  EXPECT_EQ(places_in("{1} {0:.1f} {1}"), 2);
  EXPECT_EQ(places_in("{0} {}"), -1);
  EXPECT_EQ(places_in("{0"), -1);
}

/// The language is the process's: what a test sets, it takes back.
class Language : public ::testing::Test {
 protected:
  ~Language() override { EXPECT_TRUE(speak(english_)); }
  Result<void> speak_text(const std::string& json) { return speak(scratch_.file("language.json", json)); }

 private:
  Scratch scratch_;
  std::filesystem::path english_ = scratch_.file("english.json", language_text());
};

TEST_F(Language, AnotherOneMayOrderFiguresAnew) {
  ASSERT_TRUE(speak_text(R"({"from_nearest": "{1}: noch {0:.1f} mm", "do_go_on": "weiter"})"));
  EXPECT_EQ(words("from_nearest", 2.345, "Tumor"), "Tumor: noch 2.3 mm");
  EXPECT_EQ(words("do_go_on"), "weiter");
  EXPECT_EQ(words("do_begin"), "begin") << "what the file leaves out stays";
}

TEST_F(Language, AFileThatIsNoneChangesNothing) {
  for (const char* wrong :
       {"", "[]", "{\"go_on\": \"weiter\"", R"({"do_go_on": 3})", R"({"no_such_key": "weiter"})",
        R"({"do_go_on": "weiter {}"})", R"({"from_nearest": "{:.1f} mm"})", R"({"from_nearest": "{} mm von {}"})",
        R"({"from_nearest": "{:.1f} mm von {"})", R"({"from_nearest": "{:.1f} mm {:>99999999}"})",
        R"({"do_go_on": "weiter", "do_begin": "}"})"}) {
    const auto spoken = speak_text(wrong);
    ASSERT_FALSE(spoken) << wrong;
    EXPECT_NE(spoken.error().what.find("language.json: "), std::string::npos) << spoken.error().what;
    EXPECT_EQ(words("do_go_on"), "go on");
  }
  EXPECT_EQ(speak("/no/such/file").error().code, Errc::not_found);
  const Scratch scratch;
  ASSERT_EQ(::mkfifo((scratch / "pipe").c_str(), 0600), 0);
  for (const auto& none : {scratch.path(), scratch / "pipe"})
    EXPECT_NE(speak(none).error().what.find(none.string() + ": is no file but a"), std::string::npos);
  EXPECT_FALSE(speak(scratch.file("large.json", std::string(2'000'000, ' ') + "{}")));
}

TEST_F(Language, TheTableIsAFileThatIsReadBack) {
  const auto json = nlohmann::json::parse(language_text());
  EXPECT_EQ(json.size(), kEnglish.size());
  EXPECT_TRUE(speak_text(language_text()));
}

}  // namespace
}  // namespace birdseye::host
