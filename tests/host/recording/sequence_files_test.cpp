#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <zlib.h>

#include <fstream>
#include <random>

#include "drivers/video/frame_source.hpp"
#include "host/files/frame_size.hpp"
#include "host/files/pose_files.hpp"
#include "host/recording/recording_reader.hpp"
#include "host/recording/sequence_reader.hpp"
#include "host/recording/sequence_writer.hpp"
#include "tests/support/data.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using testing::contents_of;
using testing::Scratch;

std::vector<std::uint8_t> noise(std::size_t bytes, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> out(bytes);
  for (std::uint8_t& byte : out) byte = static_cast<std::uint8_t>(random());
  return out;
}

Eigen::Matrix4d some_pose(int n) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation_exp(Eigen::Vector3d(0.1 * n, 0.2, -0.3 / (n + 1)));
  m.topRightCorner<3, 1>() = Eigen::Vector3d(1.0 / 3 * n, -20, 30);
  return m;
}

SequenceWriter::Fields fields(int n, bool seen = true) {
  return {{"Timestamp", seconds_text(12'345'678'901'234'567 + 40'000'000 * n)},
          {"ScopeToTrackerTransform", transform_text(some_pose(n))},
          {"ScopeToTrackerTransformStatus", seen ? "OK" : "INVALID"}};
}

static_assert(kMostFramePixels == drivers::kMostPixels, "what an appliance sends can be recorded and played");

constexpr int kWidth = 7, kHeight = 5;
constexpr std::size_t kBytes = 3 * kWidth * kHeight;

SequenceWriter write(const fs::path& folder, int frames) {
  auto writer = SequenceWriter::create(folder, "video", kWidth, kHeight);
  EXPECT_TRUE(writer) << writer.error().what;
  for (int n = 0; n < frames; ++n) {
    const auto added = writer->add(fields(n, n != 1), noise(kBytes, static_cast<unsigned>(n)));
    EXPECT_TRUE(added) << added.error().what;
  }
  return *std::move(writer);
}

void expect_frames(const fs::path& path, std::size_t count) {
  auto reader = SequenceReader::open(path);
  ASSERT_TRUE(reader) << reader.error().what;
  ASSERT_EQ(reader->frames(), count);
  for (std::size_t n = count; n-- > 0;) {  // backwards: nothing hangs on the order
    const auto rgb = reader->read(n);
    ASSERT_TRUE(rgb) << rgb.error().what;
    EXPECT_EQ(*rgb, noise(kBytes, static_cast<unsigned>(n))) << n;
  }
}

TEST(SequenceFiles, WhatLiesBesideASequenceThatIsJoinedIsLeftAlone) {
  const Scratch scratch;
  SequenceWriter writer = write(scratch.path(), 2);
  const std::string own = scratch.file("own.txt", "the user's own");
  fs::create_symlink(own, scratch / "video.igs.mha.part");
  const auto joined = writer.join();
  ASSERT_TRUE(joined) << joined.error().what;
  expect_frames(writer.path(), 2);
  EXPECT_EQ(contents_of(own), "the user's own");
  EXPECT_FALSE(fs::is_symlink(writer.path()));
  EXPECT_TRUE(fs::is_symlink(scratch / "video.igs.mha.part"));
  EXPECT_EQ(std::distance(fs::directory_iterator(scratch.path()), {}), 3) << "nothing else is left";
}

TEST(SequenceFiles, WhatIsWrittenIsReadBackAsAPairAndAsOneFile) {
  const Scratch scratch;
  SequenceWriter writer = write(scratch.path(), 4);
  EXPECT_EQ(writer.path(), scratch / "video.igs.mhd");
  expect_frames(writer.path(), 4);
  const auto joined = writer.join();
  ASSERT_TRUE(joined) << joined.error().what;
  EXPECT_EQ(writer.path(), scratch / "video.igs.mha");
  EXPECT_FALSE(fs::exists(scratch / "video.igs.mhd"));
  EXPECT_FALSE(fs::exists(scratch / "video.raw"));
  expect_frames(writer.path(), 4);
  // The reader of the calibrations finds the same poses, to the last digit, and passes over what was not seen.
  const auto poses = read_pose_set(writer.path(), {"ScopeToTracker"});
  ASSERT_TRUE(poses) << poses.error().what;
  ASSERT_EQ(poses->poses.size(), 3U);
  EXPECT_EQ(poses->rejected, std::vector<std::string>{"frame 1: INVALID"});
  EXPECT_EQ(poses->poses[2].tracker_from_sensor.matrix(), some_pose(3));
  EXPECT_DOUBLE_EQ(poses->poses[0].time_s, 12'345'678.901234567);
}

TEST(SequenceFiles, AFileIsWholeAfterEachFrame) {
  const Scratch scratch;
  auto writer = SequenceWriter::create(scratch.path(), "video", kWidth, kHeight);
  ASSERT_TRUE(writer);
  expect_frames(scratch / "video.igs.mhd", 0);
  for (int n = 0; n < 12; ++n) {
    ASSERT_TRUE(writer->add(fields(n), noise(kBytes, static_cast<unsigned>(n))));
    expect_frames(scratch / "video.igs.mhd", static_cast<std::size_t>(n) + 1);
  }
  EXPECT_FALSE(writer->add(fields(12), noise(kBytes - 1, 1)));
  expect_frames(scratch / "video.igs.mhd", 12);
}

TEST(SequenceFiles, PosesWithoutPicturesAreOneFileFromTheStart) {
  const Scratch scratch;
  auto writer = SequenceWriter::create(scratch.path(), "tracker", 0, 0);
  ASSERT_TRUE(writer);
  for (int n = 0; n < 3; ++n) ASSERT_TRUE(writer->add(fields(n), {}));
  const auto poses = read_pose_set(scratch / "tracker.igs.mha");
  ASSERT_TRUE(poses) << poses.error().what;
  EXPECT_EQ(poses->poses.size(), 3U);
  const auto reader = SequenceReader::open(scratch / "tracker.igs.mha");
  ASSERT_TRUE(reader) << reader.error().what;
  EXPECT_EQ(reader->width_px(), 0);
  EXPECT_EQ(reader->header().frames.size(), 3U);
}

TEST(SequenceFiles, ACutFileSaysHowManyFramesAreWhole) {
  const Scratch scratch;
  SequenceWriter writer = write(scratch.path(), 5);
  ASSERT_TRUE(writer.join());
  fs::resize_file(writer.path(), fs::file_size(writer.path()) - kBytes - 1);
  auto reader = SequenceReader::open(writer.path());
  ASSERT_TRUE(reader) << reader.error().what;
  EXPECT_EQ(reader->frames(), 3U);
  const auto beyond = reader->read(3);
  ASSERT_FALSE(beyond);
  EXPECT_NE(beyond.error().what.find("3 of 5 frames are whole"), std::string::npos) << beyond.error().what;
}

TEST(SequenceFiles, ADiskWithoutRoomKeepsTheFramesBefore) {
  const Scratch scratch;
  SequenceWriter writer = write(scratch.path(), 3);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  // First the pixels have no room, half a frame of it; then the header.
  for (const auto& [name, spare] : {std::pair{"video.raw", kBytes / 2}, {"video.igs.mhd", std::size_t{60}}}) {
    const std::size_t size = fs::file_size(scratch / name);
    const rlimit limit{static_cast<rlim_t>(size + spare), before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
    const auto added = writer.add(fields(3), noise(kBytes, 3));
    ::setrlimit(RLIMIT_FSIZE, &before);
    ASSERT_FALSE(added);
    EXPECT_NE(added.error().what.find("no room"), std::string::npos) << added.error().what;
    expect_frames(scratch / "video.igs.mhd", 3);
  }
  ::signal(SIGXFSZ, handler);
  // And once there is room again it goes on.
  ASSERT_TRUE(writer.add(fields(3), noise(kBytes, 3)));
  expect_frames(scratch / "video.igs.mhd", 4);
}

std::string header(const std::string& changed, const std::string& to) {
  std::string text =
      "ObjectType = Image\nNDims = 3\nCompressedData = False\nDimSize = 4 2 2\nElementNumberOfChannels = 1\n"
      "ElementType = MET_UCHAR\nUltrasoundImageOrientation = MFA\nSeq_Frame0000_Timestamp = 1\nElementDataFile = "
      "LOCAL\n";
  const auto at = text.find(changed);
  EXPECT_NE(at, std::string::npos);
  return text.replace(at, changed.size(), to);
}

TEST(SequenceFiles, GreyCompressedAndTurnedPicturesOfPlusAreRead) {
  const Scratch scratch;
  std::string pixels;
  for (char c = 1; c <= 16; ++c) pixels += c;
  std::vector<Bytef> zip(200);
  uLongf size = zip.size();
  ASSERT_EQ(::compress(zip.data(), &size, reinterpret_cast<const Bytef*>(pixels.data()), pixels.size()), Z_OK);
  const std::string zipped(reinterpret_cast<const char*>(zip.data()), size);
  const auto grey = [](const Result<std::vector<std::uint8_t>>& rgb) {
    std::vector<int> out;
    for (std::size_t i = 0; rgb && i < rgb->size(); i += 3) out.push_back((*rgb)[i]);
    return out;
  };
  const std::vector<int> second = {9, 10, 11, 12, 13, 14, 15, 16};
  auto plain = SequenceReader::open(scratch.file("a.igs.mha", header("MFA", "MFA") + pixels));
  ASSERT_TRUE(plain) << plain.error().what;
  EXPECT_EQ(grey(plain->read(1)), second);
  for (const std::string word : {"True", "true", "T", "1"}) {
    auto compressed = SequenceReader::open(
        scratch.file("b.igs.mha", header("CompressedData = False", "CompressedData = " + word) + zipped));
    ASSERT_TRUE(compressed) << compressed.error().what;
    EXPECT_EQ(compressed->frames(), 2U);
    EXPECT_EQ(grey(compressed->read(1)), second) << word;
    EXPECT_EQ(grey(compressed->read(0)).front(), 1);  // back again
  }
  EXPECT_TRUE(SequenceReader::open(scratch.file("e.igs.mha", header("NDims", "BinaryData = True\nNDims") + pixels)));
  const auto text =
      SequenceReader::open(scratch.file("f.igs.mha", header("NDims", "BinaryData = False\nNDims") + pixels));
  ASSERT_FALSE(text);
  EXPECT_NE(text.error().what.find("its pixels are text (BinaryData)"), std::string::npos) << text.error().what;
  auto turned = SequenceReader::open(scratch.file("c.igs.mha", header("MFA", "UN") + pixels));
  ASSERT_TRUE(turned) << turned.error().what;
  EXPECT_EQ(grey(turned->read(0)), (std::vector<int>{8, 7, 6, 5, 4, 3, 2, 1}));
  auto cut = SequenceReader::open(scratch.file(
      "d.igs.mha", header("CompressedData = False", "CompressedData = True") + zipped.substr(0, zipped.size() / 2)));
  ASSERT_TRUE(cut) << cut.error().what;
  const auto beyond = cut->read(1);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().code, Errc::bad_format);
  EXPECT_LT(cut->frames(), 2U);
  EXPECT_NE(beyond.error().what.find("of 2 frames are whole"), std::string::npos) << beyond.error().what;
}

TEST(SequenceFiles, CompressedFramesAreUnpackedWhenTheyAreAskedFor) {
  const Scratch scratch;
  std::string text = header("CompressedData = False", "CompressedData = True");
  text.replace(text.find("LOCAL"), 5, "pixels.zraw");
  // There are no pixels yet: opening looks at none.
  (void)scratch.file("pixels.zraw", "");
  auto reader = SequenceReader::open(scratch.file("a.igs.mhd", text));
  ASSERT_TRUE(reader) << reader.error().what;
  std::vector<Bytef> zip(200);
  uLongf size = zip.size();
  const std::string pixels = "0123456789abcdef";
  ASSERT_EQ(::compress(zip.data(), &size, reinterpret_cast<const Bytef*>(pixels.data()), pixels.size()), Z_OK);
  (void)scratch.file("pixels.zraw", std::string(reinterpret_cast<const char*>(zip.data()), size));
  for (const std::size_t n : {std::size_t{1}, std::size_t{0}}) {
    const auto rgb = reader->read(n);
    ASSERT_TRUE(rgb) << rgb.error().what;
    EXPECT_EQ((*rgb)[0], n == 0 ? '0' : '8');
  }
}

TEST(SequenceFiles, WhatCannotBeReadIsNamed) {
  const Scratch scratch;
  const auto expect = [&](const std::string& changed, const std::string& to, const std::string& word) {
    const auto opened = SequenceReader::open(scratch.file("bad.igs.mha", header(changed, to) + "0123456789abcdef"));
    ASSERT_FALSE(opened) << to;
    EXPECT_NE(opened.error().what.find(word), std::string::npos) << opened.error().what;
    EXPECT_NE(opened.error().what.find("bad.igs.mha"), std::string::npos) << opened.error().what;
  };
  expect("ObjectType = Image", "ObjectType = Mesh", "no MetaImage sequence");
  expect("ElementDataFile = LOCAL\n", "", "cut short");
  expect("4 2 2", "4 2", "DimSize = 4 2 is");
  expect("4 2 2", "4 -2 2", "DimSize");
  expect("4 2 2", "99999999 2 2", "DimSize");
  expect("4 2 2", "16384 16384 2", "16384x16384 px, more than a camera's 16777216 px");
  expect("4 2 2", "4096 4097 2", "4096x4097 px");
  expect("MET_UCHAR", "MET_SHORT", "MET_SHORT");
  expect("NumberOfChannels = 1", "NumberOfChannels = 4", "pixels of 4");
  expect("MFA", "FMA", "orientation is FMA");
  expect("= LOCAL", "= gone.raw", "gone.raw");
  expect("= LOCAL", "= /etc/passwd", "/etc/passwd");
  expect("= LOCAL", "= .", "is not beside it");
  EXPECT_TRUE(SequenceReader::open(scratch.file("large.igs.mha", header("4 2 2", "4096 4096 2"))));
  EXPECT_FALSE(SequenceReader::open(scratch / "none.igs.mha"));
  EXPECT_FALSE(SequenceWriter::create(scratch / "no folder", "video", 2, 2));
}

/// A sequence without pictures: each frame has one transform, of a name that no other has.
std::string sequence_of_names(std::size_t names) {
  std::string text = "ObjectType = Image\nNDims = 3\nDimSize = 0 0 " + std::to_string(names) + "\n";
  for (std::size_t n = 0; n < names; ++n) {
    const std::string field = "Seq_Frame" + std::to_string(n) + "_";
    text += field + "T" + std::to_string(n) + "ToTrackerTransform = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n";
    text += field + "Timestamp = " + std::to_string(n) + "\n";
  }
  return text + "ElementDataFile = LOCAL\n";
}

TEST(SequenceFiles, ARecordingHasNoMoreTransformsThanATrackerHasSensors) {
  const Scratch scratch;
  const RecordingReader::Settings settings{.transform = "T0ToTracker"};
  const auto all = RecordingReader::open(scratch.file("all.igs.mha", sequence_of_names(64)), settings);
  ASSERT_TRUE(all) << all.error().what;
  for (std::size_t n = 0; n < 64; ++n) {
    const auto event = (*all)->next(Deadline::after(Duration::from_ms(60'000)));
    ASSERT_TRUE(event && *event) << n;
    const auto& birds = std::get<wire::Birds>(**event).birds;
    ASSERT_EQ(birds.size(), 1U) << "those of its own frame";
    EXPECT_EQ(birds[0].name, "t" + std::to_string(n));
  }
  const auto more = RecordingReader::open(scratch.file("more.igs.mha", sequence_of_names(65)), settings);
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().code, Errc::unsupported);
  for (const char* word : {"more.igs.mha", "65 names", "64 sensors", "leave the rest out"})
    EXPECT_NE(more.error().what.find(word), std::string::npos) << more.error().what;
}

TEST(SequenceFiles, APlusRecordingIsRead) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "BIRDSEYE_DATA is not set";
  const auto folder = *data / "em_tracker_sequences";
  auto compressed = SequenceReader::open(folder / "TransformInterpolationTest.igs.mha");
  ASSERT_TRUE(compressed) << compressed.error().what;
  EXPECT_EQ(compressed->frames(), 500U);
  EXPECT_TRUE(compressed->read(499));
  const auto poses = SequenceReader::open(folder / "EightLandmarkPointsTrackedForPhantomRegistration.igs.mha");
  ASSERT_TRUE(poses) << poses.error().what;
  EXPECT_EQ(poses->header().frames.size(), 1000U);
}

}  // namespace
}  // namespace birdseye::host
