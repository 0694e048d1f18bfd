#include "calibration/record/strict_json.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "calibration/record/calibration_record.hpp"
#include "tests/support/example_record.hpp"

namespace birdseye::calibration {
namespace {

TEST(StrictJson, TakesATextThatSaysOneThing) {
  for (const char* text : {"{}", R"({"a": {"b": 1}, "b": [{"b": 2}, {"b": 3}]})", " [1, 2]\n"})
    EXPECT_EQ(strict_json<nlohmann::json>(text), nlohmann::json::parse(text)) << text;
}

TEST(StrictJson, RefusesANameTwice) {
  for (const char* text :
       {R"({"a": 1, "a": 1})", R"({"a": 1, "b": {}, "a": 2})", R"([{"x": {"a": 1, "b": 2, "a": 3}}])"})
    EXPECT_TRUE(strict_json<nlohmann::json>(text).is_discarded()) << text;
}

TEST(StrictJson, RefusesWhatStandsBehind) {
  const std::string whole = R"({"a": 1})";
  for (const std::string& tail :
       {std::string("\0", 1), std::string("\0anything", 9), std::string("{}"), std::string("x")})
    EXPECT_TRUE(strict_json<nlohmann::json>(whole + tail).is_discarded());
}

TEST(StrictJson, RefusesListsWithoutEnd) {
  EXPECT_TRUE(strict_json<nlohmann::json>(std::string(100'000, '[') + std::string(100'000, ']')).is_discarded());
  std::string seems_flat = "1";
  for (int i = 0; i < 20'000; ++i) seems_flat = R"(["]",)" + seems_flat;
  EXPECT_TRUE(strict_json<nlohmann::json>(seems_flat + std::string(20'000, ']')).is_discarded());
}

TEST(StrictJson, WhatIsNoUtf8IsWrittenAllTheSame) {
  EXPECT_EQ(text_of_json(nlohmann::json{{"a", "p\xe9.csv"}}), "{\"a\":\"p\xef\xbf\xbd.csv\"}");
  EXPECT_EQ(text_of_json(nlohmann::ordered_json{{"b", 1}, {"a", "\xff"}}, 1),
            "{\n \"b\": 1,\n \"a\": \"\xef\xbf\xbd\"\n}");
  // Sum and signature are of what is written, so that it is read back.
  CalibrationRecord record = testing::straight_scope_record();
  record.scope = "Sc\xffope";
  record.tip->provenance.made_from = "p\xe9.csv";
  const auto read = parse_signed_record(record_text(record));
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->record.scope, "Sc\xef\xbf\xbdope");
  EXPECT_EQ(signed_sha256(read->record), signed_sha256(record));
}

TEST(StrictJson, ARecordThatOthersReadOtherwiseIsNone) {
  const std::string text = record_text(testing::straight_scope_record());
  ASSERT_TRUE(parse_signed_record(text)) << parse_signed_record(text).error().what;
  EXPECT_FALSE(parse_signed_record(text + std::string("\0more", 5)));
  const std::size_t format = text.find("\"format\"");
  ASSERT_NE(format, std::string::npos);
  EXPECT_FALSE(parse_signed_record(text.substr(0, format) + "\"format\": \"another\", " + text.substr(format)));
}

TEST(StrictJson, TellsWhichNameStandsTwice) {
  std::string twice;
  EXPECT_TRUE(strict_json<nlohmann::json>(R"({"a": {"b": 1, "b": 1}})", &twice).is_discarded());
  EXPECT_EQ(twice, "b");
  std::string none;
  EXPECT_FALSE(strict_json<nlohmann::json>(R"({"a": {"b": 1}, "b": 1})", &none).is_discarded());
  EXPECT_EQ(none, "");
}

}  // namespace
}  // namespace birdseye::calibration
