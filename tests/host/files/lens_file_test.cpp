#include <gtest/gtest.h>

#include <cmath>

#include "host/files/camera_files.hpp"
#include "tests/support/lens.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::Scratch;

TEST(LensFile, HoldsHowWellTheLensIsKnown) {
  const Scratch scratch;
  CameraMatrix covariance = CameraMatrix::Random();
  covariance = CameraMatrix(covariance * covariance.transpose());
  const std::string lens = camera_text(testing::wide_lens());
  const std::string path = scratch.file("lens.yaml", lens + camera_covariance_text(covariance));
  const auto camera = read_camera(path);
  ASSERT_TRUE(camera) << camera.error().what;
  EXPECT_EQ(*camera, testing::wide_lens());
  const auto read = read_camera_covariance(path);
  ASSERT_TRUE(read) << read.error().what;
  ASSERT_TRUE(*read);
  EXPECT_EQ(**read, covariance);

  const auto none = read_camera_covariance(scratch.file("other.yaml", lens));
  ASSERT_TRUE(none);
  EXPECT_FALSE(*none);
  CameraMatrix negative = covariance, beyond_one = covariance;
  negative(2, 2) = -1;
  beyond_one(0, 1) = beyond_one(1, 0) = 1.1 * std::sqrt(covariance(0, 0) * covariance(1, 1));
  for (const CameraMatrix& none_of_these : {negative, beyond_one}) {
    const auto wrong = read_camera_covariance(scratch.file("wrong.yaml", lens + camera_covariance_text(none_of_these)));
    ASSERT_FALSE(wrong);
    EXPECT_NE(wrong.error().what.find("is no covariance"), std::string::npos) << wrong.error().what;
  }
  const auto small = read_camera_covariance(scratch.file(
      "small.yaml",
      lens + "camera_covariance: !!opencv-matrix\n   rows: 1\n   cols: 2\n   dt: d\n   data: [ 1., 2. ]\n"));
  ASSERT_FALSE(small);
  EXPECT_NE(small.error().what.find("1x2, of 9x9"), std::string::npos) << small.error().what;
}

}  // namespace
}  // namespace birdseye::host
