#include "host/recording/recording_signature.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "host/recording/recording_reader.hpp"
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
      EXPECT_EQ(refusal(scratch / "r" / "video.igs.mha", {own.machine, true}), why) << "a file of it is named";
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

TEST(RecordingSignature, NoBitOfASheetMakesARecordingOneThatNobodySigned) {
  const Scratch scratch;
  const Authors own = Authors::for_once();
  record(scratch / "r", own);
  const std::string text = contents_of(scratch / "r" / kRecordingSheet);
  for (std::size_t at = 0; at < text.size(); ++at) {
    for (const int bit : {1, 32}) {
      std::string changed = text;
      changed[at] = static_cast<char>(changed[at] ^ bit);
      (void)scratch.file("r/recording.json", changed);
      // A hexadecimal digit's case is no part of what a signature says.
      const auto admitted = admit_recording(scratch / "r", {own.machine, true});
      EXPECT_TRUE(!admitted || admitted->doubt.empty()) << at << " " << changed.substr(at, 20);
    }
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

/// Why it ends, read as far as it goes.
Error end_of(RecordingReader& reader) {
  for (;;) {
    const auto event = reader.next(Deadline::after(Duration::from_ms(20'000)));
    if (!event) return event.error();
  }
}

TEST(RecordingSignature, EventsThatWereChangedAfterTheyWereVerifiedAreFoundOut) {
  const Scratch scratch;
  const Authors own = Authors::for_once();
  record(scratch / "r", own);
  const auto admitted = admit_recording(scratch / "r", own);
  ASSERT_TRUE(admitted) << admitted.error().what;
  const std::string text = contents_of(scratch / "r" / "events.jsonl");
  const std::size_t last = text.rfind('\n', text.size() - 2) + 1;
  for (const std::string& read : {text, text.substr(0, last), text + text.substr(last)}) {
    (void)scratch.file("r/events.jsonl", read);
    const auto reader = RecordingReader::open(scratch / "r", {.events_sha256 = admitted->events_sha256});
    ASSERT_TRUE(reader) << reader.error().what;
    const Error end = end_of(**reader);
    EXPECT_EQ(end.code, read == text ? Errc::disconnected : Errc::bad_format) << end.what;
    EXPECT_EQ(end.what.find("changed after it was verified") != std::string::npos, read != text) << end.what;
  }
}

TEST(RecordingSignature, AFileThatIsNoneIsRefusedByItsNameAndWaitedForByNobody) {
  const Authors own = Authors::for_once();
  for (const char* file : {"events.jsonl", "video.igs.mha", "recording.json"}) {
    const Scratch scratch;
    record(scratch / "r", own);
    fs::remove(scratch / "r" / file);
    ASSERT_EQ(::mkfifo((scratch / "r" / file).c_str(), 0600), 0);
    const std::string why = refusal(scratch / "r", {own.machine, true});
    EXPECT_NE(why.find(std::string(file) + ": is no file but a pipe"), std::string::npos) << why;
    if (std::string(file) != "video.igs.mha") {
      EXPECT_FALSE(RecordingReader::open(scratch / "r", {}));
    }
  }
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
  EXPECT_NE(accepted->doubt.find("not signed"), std::string::npos) << accepted->doubt;
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
