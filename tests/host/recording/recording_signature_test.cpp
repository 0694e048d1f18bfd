#include "host/recording/recording_signature.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "host/recording/recording_writer.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;

using testing::contents_of;
using testing::Scratch;

std::unique_ptr<RecordingWriter> begin(const fs::path& folder, const Authors& authors) {
  auto writer = RecordingWriter::create({.folder = folder, .source = "test", .machine = authors.machine});
  EXPECT_TRUE(writer);
  for (int n = 0; n < 3; ++n) {
    wire::VideoFrame frame;
    frame.info.sequence = static_cast<std::uint64_t>(n);
    frame.info.acquired = frame.info.arrived = {40'000'000LL * n};
    frame.width_px = 2;
    frame.height_px = 2;
    frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(12, std::uint8_t{7});
    EXPECT_TRUE((*writer)->add(frame));
  }
  return *std::move(writer);
}

void record(const fs::path& folder, const Authors& authors) {
  EXPECT_TRUE(begin(folder, authors)->finish("the test is over"));
}

std::string refusal(const fs::path& folder, const Authors& authors) {
  const auto admitted = admit_recording(folder, authors);
  return admitted ? "" : admitted.error().what;
}

TEST(RecordingSignature, OfThisMachineIsAdmittedAndCoversEachOfItsFiles) {
  const Authors own = Authors::for_once();
  for (const char* file : {"events.jsonl", "tracker.igs.mha", "video.igs.mha", "recording.json"}) {
    const Scratch scratch;
    record(scratch / "r", own);
    ASSERT_EQ(refusal(scratch / "r", own), "");
    const std::string text = contents_of(scratch / "r" / file);
    for (const std::size_t at : {text.size() / 3, text.size() - 1}) {
      std::string changed = text;
      changed[at] = static_cast<char>(changed[at] ^ 1);
      (void)scratch.file(std::string("r/") + file, changed);
      const std::string why = refusal(scratch / "r", {own.machine, true});
      EXPECT_NE(why, "") << file << " " << at;
      if (std::string(file) != kRecordingSheet) {
        EXPECT_NE(why.find(file), std::string::npos) << why;
      }
    }
    (void)scratch.file(std::string("r/") + file, text);
    ASSERT_EQ(refusal(scratch / "r", own), "");
    fs::remove(scratch / "r" / file);
    EXPECT_NE(refusal(scratch / "r", own), "") << file;
  }
}

TEST(RecordingSignature, NamesWhatWasChangedTakenAwayAndAdded) {
  const Scratch scratch;
  const Authors own = Authors::for_once();
  record(scratch / "r", own);
  (void)scratch.file("r/video.igs.mha", "other");
  (void)scratch.file("r/notes.txt", "mine");
  fs::remove(scratch / "r/tracker.igs.mha");
  const auto seal = read_recording_seal(scratch / "r");
  ASSERT_TRUE(seal) << seal.error().what;
  EXPECT_EQ(seal->changed, std::vector<std::string>{"video.igs.mha"});
  EXPECT_EQ(seal->missing, std::vector<std::string>{"tracker.igs.mha"});
  EXPECT_EQ(seal->added, std::vector<std::string>{"notes.txt"});
}

TEST(RecordingSignature, AVideoThatWasPutBeforeTheSignedOneIsRefused) {
  const Scratch scratch;
  const Authors own = Authors::for_once();
  record(scratch / "r", own);
  (void)scratch.file("r/video.igs.mhd", "other");
  for (const bool accept : {false, true})
    EXPECT_NE(refusal(scratch / "r", {own.machine, accept}).find("added"), std::string::npos) << accept;
}

TEST(RecordingSignature, ASheetThatNestsWithoutEndIsRefused) {
  const Scratch scratch;
  fs::create_directory(scratch / "r");
  const std::size_t deep = 200'000;
  (void)scratch.file("r/recording.json",
                     R"({"birdseye_recording": 2, "a": )" + std::string(deep, '[') + std::string(deep, ']') + "}");
  EXPECT_NE(refusal(scratch / "r", Authors::for_once()).find("damaged"), std::string::npos);
}

TEST(RecordingSignature, OneThatWasCutShortIsUnsignedAndSaysSo) {
  const Scratch scratch;
  const Authors own = Authors::for_once();
  begin(scratch / "r", own);  // and goes, as if it were killed
  EXPECT_NE(refusal(scratch / "r", own).find("cut short"), std::string::npos) << refusal(scratch / "r", own);
  const auto accepted = admit_recording(scratch / "r", {own.machine, true});
  ASSERT_TRUE(accepted) << accepted.error().what;
  EXPECT_NE(accepted->find("not signed"), std::string::npos) << *accepted;
}

TEST(RecordingSignature, OfAnUnknownMachineIsUsedOnlyWhenAskedTo) {
  const Scratch scratch;
  const Authors own = Authors::for_once(), other = Authors::for_once();
  record(scratch / "r", other);
  EXPECT_NE(refusal(scratch / "r", own).find("not known here"), std::string::npos) << refusal(scratch / "r", own);
  EXPECT_TRUE(admit_recording(scratch / "r", {own.machine, true}));
}

}  // namespace
}  // namespace birdseye::host
