#include "host/recording/recording_signature.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/recording/recording_reader.hpp"
#include "host/recording/recording_writer.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;

using testing::contents_of;
using testing::Scratch;

std::unique_ptr<RecordingWriter> begin(const fs::path& folder, const Authors& authors, bool pair = false) {
  auto writer = RecordingWriter::create({.folder = folder, .source = "test", .pair = pair, .machine = authors.machine});
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

/// As an editor saves it, or whoever forges it: the name has another file from then on.
void replace(const fs::path& file, const std::string& text) {
  std::ofstream(file.string() + ".new") << text;
  fs::rename(file.string() + ".new", file);
}

void change_within(const fs::path& file, std::streamoff at) {
  std::fstream out(file, std::ios::in | std::ios::out | std::ios::binary);
  out.seekg(at);
  const char changed = static_cast<char>(out.get() ^ 1);
  out.seekp(at);
  out.put(changed);
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

/// The poses that a link leads to are the recording's, by whatever name they are given.
TEST(RecordingSignature, AFileThatALinkLeadsToIsTheRecordingsToo) {
  const Scratch scratch;
  const Authors own = Authors::for_once();
  record(scratch / "r", own);
  for (const char* folder : {"cart", "other", "plain"}) fs::create_directory(scratch / folder);
  fs::create_symlink("../r/tracker.igs.mha", scratch / "cart/latest.igs.mha");
  fs::create_symlink(scratch / "cart/latest.igs.mha", scratch / "other/link.igs.mha");
  fs::create_directory_symlink("r", scratch / "linked");
  fs::create_symlink("linked/tracker.igs.mha", scratch / "through.igs.mha");
  fs::create_directory_symlink("cart", scratch / "cart_too");
  const std::vector<std::string> names = {"cart/latest.igs.mha",
                                          "other/link.igs.mha",
                                          "linked",
                                          "linked/tracker.igs.mha",
                                          "through.igs.mha",
                                          "cart_too/latest.igs.mha",
                                          "cart/../cart_too/latest.igs.mha"};
  for (const std::string& name : names) {
    const auto found = recording_at(scratch / name);
    ASSERT_TRUE(found) << name;
    EXPECT_TRUE(fs::equivalent(*found, scratch / "r")) << name << " " << *found;
    EXPECT_EQ(refusal(scratch / name, own), "") << name;
  }
  std::ofstream(scratch / "r/tracker.igs.mha", std::ios::app) << "added";
  for (const std::string& name : names)
    EXPECT_NE(refusal(scratch / name, {own.machine, true}).find("was changed since"), std::string::npos) << name;
  // What a recording's name leads to elsewhere stands in the place of its file.
  (void)scratch.file("plain/poses.igs.mha", "other poses");
  fs::remove(scratch / "r/tracker.igs.mha");
  fs::create_symlink(scratch / "plain/poses.igs.mha", scratch / "r/tracker.igs.mha");
  for (const char* name : {"r/tracker.igs.mha", "cart/latest.igs.mha", "other/link.igs.mha"})
    EXPECT_NE(refusal(scratch / name, {own.machine, true}).find("was changed since"), std::string::npos) << name;
  // A link that leads to no recording, to nothing, or round and round.
  fs::create_symlink("poses.igs.mha", scratch / "plain/link.igs.mha");
  fs::create_symlink("none", scratch / "plain/nothing");
  fs::create_symlink("round", scratch / "plain/round");
  for (const char* name : {"link.igs.mha", "nothing", "round"})
    EXPECT_FALSE(recording_at(scratch / "plain" / name)) << name;
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

TEST(RecordingSignature, WhatWasChangedOrTakenAwayWhileItWasRecordedIsNamedAndSignedByNobody) {
  using Act = std::function<void(const fs::path&)>;
  const Act forge = [](const fs::path& file) { replace(file, contents_of(file)); };
  const Act lengthen = [](const fs::path& file) { std::ofstream(file, std::ios::app) << "{}\n"; };
  const Act change = [](const fs::path& file) { change_within(file, 5); };
  const Act change_later = [](const fs::path& file) {
    change_within(file, static_cast<std::streamoff>(fs::file_size(file)) - 30);
  };
  const Act change_end = [](const fs::path& file) {
    change_within(file, static_cast<std::streamoff>(fs::file_size(file)) - 3);
  };
  const Act remove = [](const fs::path& file) { fs::remove(file); };
  const Authors own = Authors::for_once();
  for (const char* file : {"events.jsonl", "tracker.igs.mha", "video.igs.mhd", "video.raw"}) {
    int number = 0;
    for (const Act& act : {forge, lengthen, change, change_later, change_end, remove}) {
      for (const bool pair : {true, false}) {
        if (pair && !std::string(file).starts_with("video")) continue;  // the other files are the same
        const Scratch scratch;
        const auto writer = begin(scratch / "r", own, pair);
        act(scratch / "r" / file);
        const std::string of = std::string(file) + (pair ? " of a pair, act " : ", act ") + std::to_string(number);
        EXPECT_FALSE(writer->finish("the test is over")) << of;
        ASSERT_EQ(writer->damage().size(), 1U) << of;
        EXPECT_NE(writer->damage()[0].find((scratch / "r" / file).string() + ": was "), std::string::npos)
            << of << "\n"
            << writer->damage()[0];
        const auto seal = read_recording_seal(scratch / "r");
        ASSERT_TRUE(seal) << seal.error().what;
        EXPECT_TRUE(seal->ended && !seal->signature) << of;
        EXPECT_NE(refusal(scratch / "r", own).find("not signed"), std::string::npos) << of;
        EXPECT_NE(contents_of(scratch / "r/recording.json").find("\"damage\""), std::string::npos) << of;
      }
      ++number;
    }
  }
}

TEST(RecordingSignature, WhatElseLiesInTheFolderIsNotSignedAndNamed) {
  for (const bool pair : {false, true}) {
    const Scratch scratch;
    const Authors own = Authors::for_once();
    const auto writer = begin(scratch / "r", own, pair);
    for (const char* name : {"planted.txt", "video-2.igs.mha"}) (void)scratch.file(std::string("r/") + name, "mine");
    EXPECT_TRUE(writer->finish("the test is over"));
    EXPECT_TRUE(writer->damage().empty());
    ASSERT_EQ(writer->notes().size(), 1U);
    EXPECT_NE(writer->notes()[0].find("planted.txt, video-2.igs.mha"), std::string::npos) << writer->notes()[0];
    const auto seal = read_recording_seal(scratch / "r");
    ASSERT_TRUE(seal) << seal.error().what;
    EXPECT_TRUE(seal->signature);
    EXPECT_EQ(seal->added, (std::vector<std::string>{"planted.txt", "video-2.igs.mha"}));
    EXPECT_TRUE(seal->changed.empty() && seal->missing.empty());
    for (const char* name : {"planted.txt", "video-2.igs.mha"}) fs::remove(scratch / "r" / name);
    EXPECT_EQ(refusal(scratch / "r", own), "") << "once it is moved away";
  }
}

TEST(RecordingSignature, SumsWhatAPairAndSeveralVideosHold) {
  for (const bool pair : {false, true}) {
    const Scratch scratch;
    const Authors own = Authors::for_once();
    const auto writer = begin(scratch / "r", own, pair);
    for (int n = 0; n < 2000; ++n) {
      wire::VideoFrame other;
      other.info.sequence = static_cast<std::uint64_t>(n) + 3;
      other.info.acquired = other.info.arrived = {120'000'000LL + 1'000'000LL * n};
      other.width_px = 64;
      other.height_px = 48;
      other.rgb = std::make_shared<const std::vector<std::uint8_t>>(3 * 64 * 48, static_cast<std::uint8_t>(n));
      ASSERT_TRUE(writer->add(other));
    }
    ASSERT_TRUE(writer->finish("the test is over"));
    EXPECT_EQ(refusal(scratch / "r", own), "") << "pieces of 4 MB";
    const auto sums = nlohmann::json::parse(contents_of(scratch / "r/recording.json")).at("sha256");
    EXPECT_EQ(sums.size(), pair ? 6U : 4U);
  }
}

TEST(RecordingSignature, AFolderThatWasRemovedOrRenamedIsNamedAndNothingIsWrittenIntoAnother) {
  for (const bool renamed : {false, true}) {
    const Scratch scratch;
    const Authors own = Authors::for_once();
    const auto writer = begin(scratch / "r", own);
    EXPECT_TRUE(writer->check_folder());
    if (renamed) {
      fs::rename(scratch / "r", scratch / "moved");
      fs::create_directory(scratch / "r");
    } else {
      fs::remove_all(scratch / "r");
    }
    EXPECT_FALSE(writer->check_folder());
    EXPECT_FALSE(writer->finish("the test is over"));
    ASSERT_EQ(writer->damage().size(), 1U);
    EXPECT_NE(writer->damage()[0].find((scratch / "r").string() + ": was removed or renamed"), std::string::npos);
    EXPECT_TRUE(writer->notes().empty()) << writer->notes()[0];
    EXPECT_EQ(fs::exists(scratch / "r"), renamed);
    if (!renamed) continue;
    EXPECT_TRUE(fs::is_empty(scratch / "r"));
    EXPECT_NE(refusal(scratch / "moved", own).find("cut short"), std::string::npos);
  }
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

/// An encoder that takes all and then fails: of the film there is nothing.
TEST(RecordingSignature, OneWhoseFilmWasNotFinishedIsSignedByNobody) {
  const Scratch scratch;
  fs::create_directory(scratch / "programs");
  const fs::path program = scratch.file("programs/ffmpeg", "#!/bin/sh\necho no room left >&2\nwc -c >&2\nexit 1\n");
  fs::permissions(program, fs::perms::owner_all);
  const std::string before = ::getenv("PATH");
  ::setenv("PATH", ((scratch / "programs").string() + ":" + before).c_str(), 1);
  const Authors own = Authors::for_once();
  const auto writer =
      RecordingWriter::create({.folder = scratch / "r", .source = "test", .compressed = true, .machine = own.machine});
  ASSERT_TRUE(writer);
  for (int n = 0; n < 3; ++n) {
    wire::VideoFrame frame;
    frame.info.sequence = static_cast<std::uint64_t>(n);
    frame.info.acquired = frame.info.arrived = {40'000'000LL * n};
    frame.width_px = 64;
    frame.height_px = 48;
    frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(std::size_t{3} * 64 * 48, std::uint8_t{7});
    EXPECT_TRUE((*writer)->add(frame));
  }
  const auto finished = (*writer)->finish("the test is over");
  ::setenv("PATH", before.c_str(), 1);
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().what.find("no room left"), std::string::npos) << finished.error().what;
  EXPECT_NE(refusal(scratch / "r", own), "");
  const auto sheet = nlohmann::json::parse(contents_of(scratch / "r" / kRecordingSheet));
  EXPECT_FALSE(sheet.contains("signed")) << sheet;
  EXPECT_FALSE(sheet.contains("sha256")) << sheet;
}

/// What lies there is another's, and a link leads to one.
TEST(RecordingSignature, AFileThatIsThereAlreadyIsNeitherEmptiedNorFollowed) {
  const Scratch scratch;
  (void)scratch.file("other.txt", "another's");
  for (const bool link : {false, true}) {
    const std::string folder = link ? "linked" : "there";
    fs::create_directory(scratch / folder);
    if (link) fs::create_symlink(scratch / "other.txt", scratch / folder / "tracker.igs.mha");
    if (!link) (void)scratch.file(folder + "/tracker.igs.mha", "another's");
    const auto writer = RecordingWriter::create({.folder = scratch / folder, .source = "test"});
    ASSERT_FALSE(writer);
    EXPECT_NE(writer.error().what.find("choose another --out"), std::string::npos) << writer.error().what;
    EXPECT_EQ(contents_of(scratch / folder / "tracker.igs.mha"), "another's");
  }
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
