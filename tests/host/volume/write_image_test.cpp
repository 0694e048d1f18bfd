#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <random>

#include "host/volume/image_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;

using testing::contents_of;

/// Of noise, which no compression makes smaller.
ImageFile noise() {
  ImageFile image;
  image.size = {64, 64, 32};
  image.axes.setIdentity();
  image.spacing_mm.setOnes();
  image.origin_mm.setZero();
  std::mt19937 random(1);
  for (int i = 0; i < 64 * 64 * 32; ++i) image.hu.push_back(static_cast<std::int16_t>(random() % 256));
  return image;
}

/// A file of this process may have so many bytes, as on a disk that is full after them.
class Full {
 public:
  explicit Full(rlim_t bytes) : heeded_(::signal(SIGXFSZ, SIG_IGN)) {
    EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &before_), 0);
    const rlimit lowered{bytes, before_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &lowered), 0);
  }
  ~Full() {
    (void)::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, heeded_);
  }
  Full(const Full&) = delete;
  Full& operator=(const Full&) = delete;

 private:
  sighandler_t heeded_;
  rlimit before_{};
};

TEST(WriteImage, OnAFullDiskIsAnErrorAndTheFormerFileIsThere) {
  for (const char* name : {"a.nii.gz", "a.nii", "a.nrrd", "a.mha"}) {
    for (const rlim_t room : {0U, 300U, 50'000U}) {
      const testing::Scratch scratch;
      (void)scratch.file(name, "the former");
      Result<void> written;
      {
        const Full full(room);
        written = write_image(scratch / name, noise(), StoredAs::int16);
      }
      ASSERT_FALSE(written) << name << ", " << room;
      EXPECT_NE(written.error().what.find(name), std::string::npos) << written.error().what;
      EXPECT_NE(written.error().what.find("disk"), std::string::npos) << written.error().what;
      EXPECT_EQ(contents_of(scratch / name), "the former");
      EXPECT_EQ(std::distance(fs::directory_iterator(scratch.path()), {}), 1) << "nothing is left of it";
    }
  }
}

TEST(WriteImage, IsReadBackAsItIs) {
  const testing::Scratch scratch;
  const ImageFile image = noise();
  for (const char* name : {"a.nii.gz", "a.nrrd", "a.mha"}) {
    for (const StoredAs stored : {StoredAs::int16, StoredAs::uint8}) {
      const auto written = write_image(scratch / name, image, stored);
      ASSERT_TRUE(written) << written.error().what;
      const auto read = read_image(scratch / name, 1);
      ASSERT_TRUE(read) << read.error().what;
      EXPECT_EQ(read->hu, image.hu) << name;
    }
  }
}

TEST(WriteImage, WhatLiesBesideItStays) {
  const testing::Scratch scratch;
  (void)scratch.file("victim", "a user's");
  fs::create_symlink("victim", scratch / "part-a.nrrd");
  (void)scratch.file("part-b.nrrd", "another's");
  for (const char* name : {"a.nrrd", "b.nrrd"}) {
    const auto written = write_image(scratch / name, noise(), StoredAs::uint8);
    ASSERT_TRUE(written) << written.error().what;
    EXPECT_FALSE(fs::is_symlink(scratch / name)) << name;
  }
  EXPECT_EQ(contents_of(scratch / "victim"), "a user's");
  EXPECT_TRUE(fs::is_symlink(scratch / "part-a.nrrd"));
  EXPECT_EQ(contents_of(scratch / "part-b.nrrd"), "another's");
  EXPECT_EQ(std::distance(fs::directory_iterator(scratch.path()), {}), 5);
}

TEST(WriteImage, RefusesAFolderAPipeAndANameThatIsOfTwoFiles) {
  const testing::Scratch scratch;
  fs::create_directory(scratch / "dir.nrrd");
  ASSERT_EQ(::mkfifo((scratch / "pipe.nrrd").c_str(), 0600), 0);
  for (const auto& [name, why] : {std::pair{"dir.nrrd", "is a folder"},
                                  {"pipe.nrrd", "is a pipe"},
                                  {"s.mhd", "name it .nii.gz, .nrrd or .mha"},
                                  {"s.nhdr", "name it .nii.gz, .nrrd or .mha"},
                                  {"s.hdr", "name it .nii.gz, .nrrd or .mha"},
                                  {"s.img", "name it .nii.gz, .nrrd or .mha"},
                                  {"s.img.gz", "name it .nii.gz, .nrrd or .mha"}}) {
    const auto written = write_image(scratch / name, noise(), StoredAs::uint8);
    ASSERT_FALSE(written) << name;
    EXPECT_NE(written.error().what.find(name), std::string::npos) << written.error().what;
    EXPECT_NE(written.error().what.find(why), std::string::npos) << written.error().what;
  }
  EXPECT_TRUE(fs::is_fifo(scratch / "pipe.nrrd"));
  EXPECT_EQ(std::distance(fs::directory_iterator(scratch.path()), {}), 2) << "nothing else is there";
}

}  // namespace
}  // namespace birdseye::host
