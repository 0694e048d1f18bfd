#include "host/files/film.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <iterator>

#include "drivers/system/child_process.hpp"
#include "host/files/picture.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using testing::Scratch;

std::vector<std::uint8_t> flat(int width_px, int height_px, std::size_t n) {
  return std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px),
                                   static_cast<std::uint8_t>(20 * n + 40));
}

fs::path film_of(const fs::path& path, int width_px, int height_px, std::size_t frames) {
  auto film = Film::open(path, width_px, height_px, 25);
  EXPECT_TRUE(film) << film.error().what;
  for (std::size_t n = 0; n < frames; ++n) EXPECT_TRUE(film->add(flat(width_px, height_px, n)));
  const auto finished = film->finish();
  EXPECT_TRUE(finished) << finished.error().what;
  return path;
}

void expect_refused_film(const fs::path& path, int width_px, int height_px, const std::vector<std::string>& words) {
  auto reader = FilmReader::open(path, width_px, height_px);
  Error error = reader ? Error{} : reader.error();
  if (reader) {
    const auto frame = reader->read(0);
    ASSERT_FALSE(frame) << path;
    error = frame.error();
  }
  EXPECT_NE(error.code, Errc::bad_format) << "that is a film's end";
  EXPECT_NE(error.what.find(path.string()), std::string::npos) << error.what;
  for (const std::string& word : words)
    EXPECT_NE(error.what.find(word), std::string::npos) << word << "\n" << error.what;
}

TEST(Film, ItsFramesAreReadInTheirOrderAndItsEndIsTold) {
  const Scratch scratch;
  // A name as no address may be, and a size that is padded.
  auto reader = FilmReader::open(film_of(scratch / "http:%03d film.mp4", 62, 46, 5), 62, 46);
  ASSERT_TRUE(reader) << reader.error().what;
  for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{3}}) {
    const auto rgb = reader->read(n);
    ASSERT_TRUE(rgb) << rgb.error().what;
    ASSERT_EQ(rgb->size(), flat(62, 46, n).size());
    EXPECT_NEAR((*rgb)[3000], flat(62, 46, n)[3000], 4) << n;
  }
  EXPECT_EQ(reader->read(2).error().code, Errc::bad_value) << "passed over";
  EXPECT_TRUE(reader->read(4));
  const auto beyond = reader->read(5);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().code, Errc::bad_format);
  EXPECT_NE(beyond.error().what.find("5 frames are whole"), std::string::npos) << beyond.error().what;
}

/// As ffmpeg names protocols and options.
TEST(Film, InARelativeFolderOfAnyNameIsWrittenAndRead) {
  const Scratch scratch;
  const fs::path before = fs::current_path();
  fs::current_path(scratch.path());
  for (const char* folder : {"2026-11-30T16:30:00", "-x", "--", "http:", "%03d"}) {
    fs::create_directory(folder);
    auto reader = FilmReader::open(film_of(fs::path(folder) / "film.mp4", 64, 48, 2), 64, 48);
    EXPECT_TRUE(reader && reader->read(1)) << folder;
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1) << folder;
  }
  fs::current_path(before);
}

TEST(Film, OneOfAnotherSizeIsRefusedByBothSizes) {
  const Scratch scratch;
  const fs::path path = film_of(scratch / "film.mp4", 128, 96, 2);
  expect_refused_film(path, 64, 48, {"128x96 px", "64x48 px"});
  expect_refused_film(path, 96, 128, {"128x96 px", "96x128 px"});  // as many bytes
  expect_refused_film(path, 128, 94, {"128x96 px", "128x94 px"});
  expect_refused_film(path, 1280, 960, {"128x96 px", "1280x960 px"});
  expect_refused_film(film_of(scratch / "small.mp4", 2, 2, 1), 1920, 1080, {"2x2 px", "1920x1080 px"});
}

TEST(Film, SizesThatNoCameraHasAreRefused) {
  const Scratch scratch;
  const fs::path path = film_of(scratch / "film.mp4", 64, 48, 1);
  expect_refused_film(path, 1 << 30, 1 << 30, {"1073741824x1073741824"});
  expect_refused_film(path, 4096, 4098, {"4096x4098"});
  expect_refused_film(path, 2, 16386, {"2x16386"});
  expect_refused_film(path, -64, 48, {"-64x48"});
  expect_refused_film(path, 64, 0, {"64x0"});
}

TEST(Film, WhatIsNoFilmIsNotTakenForOneByItsContent) {
  const Scratch scratch;
  const std::string none = "no H.264 film in an MP4 file";
  Picture picture{64, 48, flat(64, 48, 1)};
  expect_refused_film(scratch.file("picture.mp4", png_of(picture.view())), 64, 48, {none});
  film_of(scratch / "film.mp4", 64, 48, 2);
  expect_refused_film(scratch.file("list.mp4", "ffconcat version 1.0\nfile film.mp4\n"), 64, 48, {none});
  expect_refused_film(scratch.file("empty.mp4", ""), 64, 48, {none});
  // A film, and another codec's.
  const fs::path other = scratch / "other.mp4";
  auto ffmpeg = ChildProcess::start(
      {"ffmpeg", "-loglevel", "error", "-i", (scratch / "film.mp4").string(), "-c:v", "mpeg4", other.string()},
      "/dev/null");
  ASSERT_TRUE(ffmpeg) << ffmpeg.error().what;
  ASSERT_EQ(ffmpeg->wait(Deadline::after(Duration::from_ms(60'000))), 0);
  expect_refused_film(other, 64, 48, {none});
}

TEST(Film, WhereThereIsNoFfmpegThatIsSaid) {
  const Scratch scratch;
  const fs::path film = film_of(scratch / "film.mp4", 64, 48, 2);
  fs::create_directory(scratch / "programs");
  fs::create_symlink("/usr/bin/env", scratch / "programs/env");
  const std::string before = ::getenv("PATH");
  ::setenv("PATH", (scratch / "programs").c_str(), 1);
  auto reader = FilmReader::open(film, 64, 48);
  ::setenv("PATH", before.c_str(), 1);
  ASSERT_TRUE(reader) << reader.error().what;
  const auto frame = reader->read(0);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, Errc::not_found);
  EXPECT_NE(frame.error().what.find("ffmpeg: cannot be started"), std::string::npos) << frame.error().what;
}

TEST(Film, NothingIsLeftOfOneThatIsNotFinished) {
  const Scratch scratch;
  fs::create_directory(scratch / "out");
  const fs::path path = scratch / "out/film.mp4";
  {
    auto film = Film::open(path, 64, 48, 25);
    ASSERT_TRUE(film) << film.error().what;
    EXPECT_TRUE(film->add(flat(64, 48, 1)));
  }
  EXPECT_TRUE(fs::is_empty(scratch / "out"));

  // An encoder that takes all and then fails.
  fs::create_directory(scratch / "programs");
  const fs::path program = scratch.file("programs/ffmpeg", "#!/bin/sh\necho no room left >&2\nwc -c >&2\nexit 1\n");
  fs::permissions(program, fs::perms::owner_all);
  const std::string before = ::getenv("PATH");
  ::setenv("PATH", ((scratch / "programs").string() + ":" + before).c_str(), 1);
  {
    auto film = Film::open(path, 64, 48, 25);
    ::setenv("PATH", before.c_str(), 1);
    ASSERT_TRUE(film) << film.error().what;
    EXPECT_TRUE(film->add(flat(64, 48, 1)));
    const auto finished = film->finish();
    ASSERT_FALSE(finished);
    EXPECT_NE(finished.error().what.find(path.string()), std::string::npos) << finished.error().what;
    EXPECT_NE(finished.error().what.find("no room left"), std::string::npos) << finished.error().what;
  }
  EXPECT_TRUE(fs::is_empty(scratch / "out"));
}

}  // namespace
}  // namespace birdseye::host
