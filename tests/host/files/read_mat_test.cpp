#include "host/files/read_mat.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "host/confine/run_confined.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/picture.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::Scratch;

cv::Mat pattern(int type) {
  cv::Mat out(30, 40, type);
  for (std::size_t i = 0; i < out.total() * out.elemSize(); ++i) out.data[i] = static_cast<std::uint8_t>(7 * i);
  return out;
}

/// How many page faults those copies have had that the process which stands by has waited for.
long faults_of_decoders() {
  static const std::string process =
      run_confined([](std::string_view) { return std::to_string(::getppid()); }, "", 100).value();
  std::ifstream stat("/proc/" + process + "/stat");
  std::string field;
  for (int i = 0; i < 11; ++i) stat >> field;
  return std::stol(field);
}

bool has_a_decoder(const std::function<void()>& read) {
  const long before = faults_of_decoders();
  read();
  return faults_of_decoders() > before;
}

TEST(ReadMat, BringsEachPixelFromTheDecodersProcess) {
  const Scratch scratch;
  const std::string path = (scratch / "p.png").string();
  ASSERT_TRUE(cv::imwrite(path, pattern(CV_8UC3)));
  EXPECT_TRUE(has_a_decoder([&] {
    const auto colour = read_bgr_mat(path);
    ASSERT_TRUE(colour) << colour.error().what;
    EXPECT_EQ(cv::norm(*colour, pattern(CV_8UC3), cv::NORM_INF), 0);
  }));
  ASSERT_TRUE(cv::imwrite(path, pattern(CV_8UC1)));
  EXPECT_TRUE(has_a_decoder([&] {
    const auto grey = read_grey_mat(path);
    ASSERT_TRUE(grey) << grey.error().what;
    EXPECT_EQ(cv::norm(*grey, pattern(CV_8UC1), cv::NORM_INF), 0);
  }));
}

TEST(ReadMat, SaysWhyThereIsNoPicture) {
  const Scratch scratch;
  const auto why = [](const std::filesystem::path& path) {
    const auto read = read_grey_mat(path);
    return read ? "" : read.error().what;
  };
  EXPECT_EQ(why(scratch.file("empty.png", "")), "the file is empty");
  EXPECT_EQ(why(scratch.file("cut.png", "\x89PNG and more")), "the file is cut short");
  EXPECT_EQ(why(scratch.file("no.png", "text")), "the file is damaged, or no picture");
  EXPECT_EQ(why(scratch.path()), "it is no file but a folder, a pipe or a device");
  EXPECT_EQ(why(scratch / "nowhere.png"), "the file cannot be opened");
}

TEST(ReadMat, APipeInPlaceOfAPictureIsNamedAndNotWaitedFor) {
  const Scratch scratch;
  const auto pipe = scratch / "pipe.png";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(read_grey_mat(pipe).error().what, "it is no file but a folder, a pipe or a device");
  EXPECT_EQ(read_picture(pipe).error().what.find(pipe.string() + ": is no file but a pipe"), 0U);
  EXPECT_EQ(read_picture(scratch / "none.png").error().code, Errc::not_found);
}

TEST(CameraFiles, AreParsedInTheDecodersProcess) {
  const Scratch scratch;
  const CameraModel lens{640, 480, 500, 500, 320, 240};
  const std::string path = scratch.file("camera.yaml", camera_text(lens));
  EXPECT_TRUE(has_a_decoder([&] { EXPECT_EQ(read_camera(path).value(), lens); }));
  EXPECT_TRUE(has_a_decoder([&] { EXPECT_FALSE(read_camera_covariance(path).value()); }));
}

}  // namespace
}  // namespace birdseye::host
