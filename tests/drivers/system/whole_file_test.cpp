// What is read whole: files, and nothing that keeps its reader waiting or has no end.
#include "drivers/system/whole_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>

#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

TEST(WholeFile, IsReadToTheByte) {
  const testing::Scratch scratch;
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{65'536}, std::size_t{200'001}}) {
    std::string text(size, 'x');
    for (std::size_t i = 0; i < size; i += 97) text[i] = static_cast<char>(i % 256);
    const auto read = read_whole_file(scratch.file("f", text), size);
    ASSERT_TRUE(read) << read.error().what;
    EXPECT_EQ(*read, text);
    if (size == 0) continue;
    const auto larger = read_whole_file(scratch / "f", size - 1);
    ASSERT_FALSE(larger);
    EXPECT_EQ(larger.error().code, Errc::unsupported);
  }
}

TEST(WholeFile, WhatIsNoFileIsRefusedByItsNameAtOnce) {
  const testing::Scratch scratch;
  const std::string pipe = scratch / "pipe", socket = scratch / "socket", link = scratch / "link";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  ASSERT_EQ(::mknod(socket.c_str(), S_IFSOCK | 0600, 0), 0);
  std::filesystem::create_symlink("/dev/zero", link);
  for (const std::string& path : {pipe, socket, link, std::string("/dev/zero"), scratch.path().string()}) {
    const auto read = read_whole_file(path, 1000);
    ASSERT_FALSE(read) << path;
    EXPECT_EQ(read.error().code, Errc::bad_value) << read.error().what;
    EXPECT_EQ(read.error().what.find(path + ": is no file but a "), 0U) << read.error().what;
  }
}

TEST(WholeFile, OneThatIsNotThereIsToldFromOneThatIsNoFile) {
  const auto read = read_whole_file("/nonexistent/file", 1000);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, Errc::not_found);
}

}  // namespace
}  // namespace birdseye
