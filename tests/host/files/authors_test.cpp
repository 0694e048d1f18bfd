#include "host/files/authors.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "host/files/record_file.hpp"
#include "host/files/sealed_text.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

calibration::CalibrationRecord small_record(const std::string& scope = "no. 17") {
  calibration::CalibrationRecord record;
  record.scope = scope;
  record.tracker = {{"model", "miniBIRD"}};
  return record;
}

Authors accepting(const Authors& authors) {
  return {authors.machine, true};
}

TEST(SignedRecord, IsAdmittedOfThisMachineWithoutADoubt) {
  const Authors own = Authors::for_once();
  const auto read = admit_record(record_text(small_record(), *own.machine), own);
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->doubt, "");
  EXPECT_EQ(record_text(read->record), record_text(small_record())) << "the signature is no part of the record";
  const auto full = testing::example_record(640, 480, {{"model", "miniBIRD"}}, {});
  EXPECT_TRUE(admit_record(record_text(full, *own.machine), own)) << "numbers read back as they were signed";
}

TEST(SignedRecord, WithOneBitChangedIsRefused) {
  const Authors own = Authors::for_once();
  const std::string text = record_text(small_record(), *own.machine);
  for (std::size_t bit = 0; bit < 8 * text.size(); ++bit) {
    std::string changed = text;
    changed[bit / 8] = static_cast<char>(changed[bit / 8] ^ (1 << bit % 8));
    const auto read = admit_record(changed, accepting(own));
    if (!read) continue;
    EXPECT_EQ(read->doubt, "") << bit;
    EXPECT_EQ(record_text(read->record), record_text(small_record())) << "only white space may differ: " << bit;
  }
  for (std::size_t length = 0; length + 1 < text.size(); ++length)
    EXPECT_FALSE(admit_record(text.substr(0, length), accepting(own))) << length;
}

TEST(SignedRecord, WithItsSumsMadeAnewIsRefusedAllTheSame) {
  const Authors own = Authors::for_once();
  const auto read = calibration::parse_signed_record(record_text(small_record(), *own.machine));
  ASSERT_TRUE(read && read->signature);
  // Another record, a checksum that fits, and the signature of the first.
  const std::string forged = record_text(small_record("no. 18"), *read->signature);
  ASSERT_TRUE(calibration::parse_record(forged));
  for (const Authors& authors : {own, accepting(own)}) {
    const auto admitted = admit_record(forged, authors);
    ASSERT_FALSE(admitted);
    EXPECT_NE(admitted.error().what.find("the signature is of another file"), std::string::npos)
        << admitted.error().what;
  }
}

TEST(SignedRecord, OfNobodyOrAnUnknownMachineIsUsedOnlyWhenAskedTo) {
  const Authors own = Authors::for_once(), other = Authors::for_once();
  const std::pair<std::string, const char*> cases[] = {
      {record_text(small_record()), "is not signed"},
      {record_text(small_record(), *other.machine), "by a machine that is not known here"}};
  for (const auto& [text, why] : cases) {
    const auto refused = admit_record(text, own);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().what.find(why), std::string::npos) << refused.error().what;
    EXPECT_NE(refused.error().what.find("--accept-unsigned"), std::string::npos) << refused.error().what;
    const auto accepted = admit_record(text, accepting(own));
    ASSERT_TRUE(accepted) << accepted.error().what;
    EXPECT_NE(accepted->doubt, "");
  }
  EXPECT_NE(admit_record(cases[1].first, own).error().what.find("birdseye verify --trust NAME"), std::string::npos);
}

TEST(SignedRecord, AnEntryThatRestsOnWhatNobodySignedSaysSoWhoeverSignsIt) {
  const testing::Scratch scratch;
  const Authors own = Authors::for_once();
  const std::string path = scratch.file("record.json", record_text(small_record(), *own.machine));
  RecordEntry entry{"a test", [](auto& record, const auto& provenance) {
                      record.tip = calibration::TipEntry{provenance, {0, 0, 150}, Eigen::Matrix3d::Identity(), 0.3};
                    }};
  const auto with = [&](const std::string& doubt) {
    entry.doubt = doubt;
    const auto text = record_with(path, entry, Grade::marginal, own);
    return text ? *text : text.error().what;
  };
  EXPECT_TRUE(admit_record(with(""), own));
  const std::string doubtful = with("the map of the field is not signed");
  const auto refused = admit_record(doubtful, own);
  ASSERT_FALSE(refused);
  for (const char* words : {"rests on what no known machine signed", "its tip: the map", "--accept-unsigned"})
    EXPECT_NE(refused.error().what.find(words), std::string::npos) << refused.error().what;
  const auto accepted = admit_record(doubtful, accepting(own));
  ASSERT_TRUE(accepted) << accepted.error().what;
  EXPECT_NE(accepted->doubt.find("the map of the field is not signed"), std::string::npos);
  // Another entry is made into it only by who asks for it, and does not wash it clean.
  const std::string kept = scratch.file("doubtful.json", doubtful);
  const RecordEntry further{"a test", [](auto& record, const auto&) { record.scope = "no. 18"; }};
  EXPECT_FALSE(record_with(kept, further, Grade::pass, own));
  const auto more = record_with(kept, further, Grade::pass, accepting(own));
  ASSERT_TRUE(more) << more.error().what;
  EXPECT_FALSE(admit_record(*more, own));
  // Calibrated anew it is sound again.
  entry.doubt.clear();
  const auto anew = record_with(kept, entry, Grade::pass, accepting(own));
  ASSERT_TRUE(anew);
  EXPECT_TRUE(admit_record(*anew, own));
}

TEST(SignedRecord, AnEntryIsNotMadeIntoARecordOfAnUnknownMachine) {
  const testing::Scratch scratch;
  const Authors own = Authors::for_once(), other = Authors::for_once();
  const std::string path = scratch.file("record.json", record_text(small_record(), *other.machine));
  const RecordEntry entry{"a test", [](auto& record, const auto&) { record.scope = "no. 18"; }};
  EXPECT_FALSE(record_with(path, entry, Grade::pass, own));
  const auto with = record_with(path, entry, Grade::pass, accepting(own));
  ASSERT_TRUE(with) << with.error().what;
  const auto read = admit_record(*with, own);
  ASSERT_TRUE(read) << "who asks for it signs it: " << read.error().what;
  EXPECT_EQ(read->record.scope, "no. 18");
}

TEST(SignedRecord, AnEntryThatNoReaderWouldTakeIsNotMade) {
  const testing::Scratch scratch;
  const Authors own = Authors::for_once();
  const std::string path = scratch.file("record.json", record_text(small_record(), *own.machine));
  const RecordEntry entry{"a test", [](auto& record, const auto& provenance) {
                            record.tip = calibration::TipEntry{provenance, {1, 2, 3}, Eigen::Matrix3d::Zero(), -1};
                          }};
  const auto refused = record_with(path, entry, Grade::pass, own);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("record.json is left as it was, for with this entry"), std::string::npos);
  EXPECT_NE(refused.error().what.find("rms_mm is -1"), std::string::npos) << refused.error().what;
}

TEST(FileSignature, HasFourPartsAndNoMore) {
  nlohmann::json json = calibration::json_of_signature({"machine", "key", "utc", "signature"});
  EXPECT_EQ(calibration::signature_of_json(json).machine, "machine");
  json["more"] = 1;
  EXPECT_THROW(calibration::signature_of_json(json), nlohmann::json::exception);
}

TEST(SealedText, OfASignedOneOnlyWhatWasSignedIsRead) {
  const Authors own = Authors::for_once();
  const std::string text = sealed_text({{"a", 1}, {"b", "two"}}, "a kind", *own.machine);
  const auto read = unseal(text);
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(*read, nlohmann::json({{"a", 1}, {"b", "two"}}));
  const SealedBy by = sealed_by(text);
  EXPECT_EQ(own.admit("a kind", by.sha256, by.signature).value(), "");
  EXPECT_FALSE(own.admit("another kind", by.sha256, by.signature));
  for (std::size_t bit = 0; bit < 8 * text.size(); ++bit) {
    std::string changed = text;
    changed[bit / 8] = static_cast<char>(changed[bit / 8] ^ (1 << bit % 8));
    const auto damaged = unseal(changed);
    ASSERT_FALSE(damaged) << bit;
    EXPECT_NE(damaged.error().what.find("was changed or damaged"), std::string::npos) << damaged.error().what;
  }
  // More parts, with sums that fit, behind the signature of the first: they are refused.
  const std::size_t from = text.find("\"signed\": "), to = text.find('\n', from);
  const nlohmann::json signature = nlohmann::json::parse("{" + text.substr(from, to - from - 1) + "}").at("signed");
  const std::string longer = sealed_text({{"a", 1}, {"b", "two"}, {"signed", signature}, {"c", 3}});
  ASSERT_FALSE(unseal(longer));
  EXPECT_NE(unseal(longer).error().what.find("holds more than was signed"), std::string::npos);
  EXPECT_EQ(*unseal(sealed_text({{"a", 1}, {"b", "two"}, {"signed", signature}})), *read) << "the signed one alone";
  // Another part before it: it does not fit.
  const SealedBy other = sealed_by(sealed_text({{"a", 2}, {"b", "two"}, {"signed", signature}}));
  EXPECT_FALSE(own.admit("a kind", other.sha256, other.signature));
  const SealedBy none = sealed_by(sealed_text({{"a", 1}}));
  EXPECT_FALSE(none.signature);
}

}  // namespace
}  // namespace birdseye::host
