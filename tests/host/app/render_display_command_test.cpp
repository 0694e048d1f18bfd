#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "host/overlay/undistortion.hpp"
#include "tests/support/command.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/lens_file.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"
#include "tests/support/strong_lens.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::expect_refused;
using testing::read_json;
using testing::run;
using testing::Scratch;
using testing::small_ct;

CameraModel lens() {
  return testing::strong_lens(160, 120);
}

std::vector<std::uint8_t> pixels_of(const fs::path& path) {
  const cv::Mat read = cv::imread(path.string(), cv::IMREAD_COLOR);
  return {read.data, read.data + 3 * read.total()};
}

/// The small CT's ball, off the axis of a camera 50 mm before it, over a frame of video.
struct Case {
  Scratch scratch;
  std::string common;
  Case() {
    std::string frame = "P6\n160 120\n255\n";
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 160; ++x)
        frame +=
            {static_cast<char>(60 + x), static_cast<char>(60 + y), static_cast<char>((x / 20 + y / 20) % 2 * 90 + 30)};
    }
    testing::write_lens(scratch / "lens.yaml", lens());
    common = "render --volume " + small_ct(scratch) + " --transfer skin --over " + scratch.file("frame.ppm", frame) +
             " --pose " + scratch.file("pose.txt", "1 0 0 14\n0 1 0 9\n0 0 1 50\n0 0 0 1\n");
  }
  [[nodiscard]] std::string camera() const { return " --camera " + (scratch / "lens.yaml").string(); }
};

TEST(RenderDisplay, TheStraightPictureIsTheBentOneStraightened) {
  const Case c;
  for (const std::string engine : {"cpu", "gl"}) {
    const std::string command = c.common + c.camera() + " --engine " + engine + " --out ";
    const fs::path bent = c.scratch / "bent.png";
    ASSERT_EQ(run("birdseye", command + bent.string()).code, 0);
    for (const auto& [display, kept] :
         {std::pair{"undistorted", host::Kept::centre_scale}, {"undistorted-whole", host::Kept::every_pixel}}) {
      const fs::path straight = c.scratch / "straight.png", json_path = c.scratch / "straight.json";
      const auto result =
          run("birdseye", command + straight.string() + " --display " + display + " --json " + json_path.string());
      ASSERT_EQ(result.code, 0) << result.output;
      const host::FrameUndistorter straighten(lens(), host::pinhole_for(lens(), kept));
      const std::vector<std::uint8_t> expected = straighten.apply(pixels_of(bent)), drawn = pixels_of(straight);
      ASSERT_EQ(expected.size(), drawn.size());
      double sum = 0, unlike_bent = 0;
      const std::vector<std::uint8_t> as_it_came = pixels_of(bent);
      for (std::size_t i = 0; i < drawn.size(); ++i) {
        sum += std::abs(drawn[i] - expected[i]);
        unlike_bent += std::abs(drawn[i] - as_it_came[i]);
      }
      EXPECT_LT(sum / static_cast<double>(drawn.size()), 1.5) << engine << " " << display;
      EXPECT_GT(unlike_bent / static_cast<double>(drawn.size()), 6) << engine << " " << display;
      const nlohmann::json json = read_json(json_path);
      EXPECT_EQ(json["display"], display);
      EXPECT_NEAR(json["camera_matrix"][0][0].get<double>(), straighten.to().fx_px, 1e-9);
      EXPECT_NEAR(json["camera_matrix"][1][2].get<double>(), straighten.to().cy_px, 1e-9);
    }
  }
}

TEST(RenderDisplay, IsAsTheLensTookItUnlessAskedFor) {
  const Case c;
  const fs::path plain = c.scratch / "plain.png", asked = c.scratch / "asked.png";
  ASSERT_EQ(run("birdseye", c.common + c.camera() + " --out " + plain.string()).code, 0);
  ASSERT_EQ(run("birdseye", c.common + c.camera() + " --display distorted --out " + asked.string()).code, 0);
  EXPECT_EQ(pixels_of(plain), pixels_of(asked));
}

TEST(RenderDisplay, IsRefusedWithoutALensAndForOtherWords) {
  const Case c;
  const fs::path out = c.scratch / "o.png";
  expect_refused("birdseye", "render --volume ct --display undistorted --out " + out.string(),
                 {"--display", "--camera"}, out);
  expect_refused("birdseye", c.common + c.camera() + " --display flat --out " + out.string(),
                 {"--display", "undistorted"}, out);
}

}  // namespace
}  // namespace birdseye
