#include "host/registration/similarity/overlap_mask.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "tests/support/data.hpp"

namespace birdseye::host {
namespace {

using ::testing::HasSubstr;

struct Video {
  int width_px, height_px;
  std::vector<std::uint8_t> rgb;
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x);
  }
  std::uint8_t* at(int x, int y) { return &rgb[3 * index(x, y)]; }
  [[nodiscard]] RgbView view() const { return {rgb, width_px, height_px}; }
};

/// Noisy tissue inside the field, and a dark surround of noise outside; tissue is dark in the shadow of a corner.
Video tissue(int width_px, int height_px, const std::optional<LensField>& field) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> noise(-6, 6);
  Video video{width_px, height_px,
              std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px))};
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      const bool inside = !field || std::hypot((x - field->centre_x_px) / field->radius_x_px,
                                               (y - field->centre_y_px) / field->radius_y_px) < 1;
      const bool shadow = x < width_px / 3 && y > height_px / 2;
      const int level = !inside ? 6 : shadow ? 10 : 120 + static_cast<int>(40 * std::sin(0.03 * x + 0.02 * y));
      const int rgb[] = {level, level / 2, level / 3};
      for (int c = 0; c < 3; ++c) video.at(x, y)[c] = static_cast<std::uint8_t>(std::max(0, rgb[c] + noise(random)));
    }
  }
  return video;
}

std::vector<std::uint8_t> mask_of(const Video& video, std::span<const std::uint8_t> instruments = {}) {
  auto mask = overlap_mask(video.view(), instruments);
  EXPECT_TRUE(mask);
  return mask ? *std::move(mask) : std::vector<std::uint8_t>{};
}

void expect_field(const std::optional<LensField>& found, const LensField& truth, double within_px) {
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->centre_x_px, truth.centre_x_px, within_px);
  EXPECT_NEAR(found->centre_y_px, truth.centre_y_px, within_px);
  EXPECT_NEAR(found->radius_x_px, truth.radius_x_px, within_px);
  EXPECT_NEAR(found->radius_y_px, truth.radius_y_px, within_px);
}

TEST(OverlapMask, FindsTheLensFieldWholeOrCutDespiteShadow) {
  // Whole; cut above and below, which leaves less to fit; of pixels that are not square.
  const LensField whole{330, 250, 210, 210}, cut{300, 230, 280, 280}, oblong{370, 290, 250, 270};
  expect_field(find_lens_field(tissue(640, 480, whole).view()), whole, 1.5);
  expect_field(find_lens_field(tissue(640, 480, cut).view()), cut, 4);
  expect_field(find_lens_field(tissue(720, 576, oblong).view()), oblong, 2);
}

TEST(OverlapMask, APictureWithoutSurroundKeepsAll) {
  const Video video = tissue(320, 240, std::nullopt);
  EXPECT_THAT(mask_of(video), ::testing::Each(::testing::Ne(0)));
  // Nor is an organ before black a lens field.
  Video organ = tissue(320, 240, std::nullopt);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      const double angle = std::atan2(y - 120, x - 160);
      if (std::hypot(x - 160, y - 120) > 80 + 25 * std::sin(3 * angle)) std::fill_n(organ.at(x, y), 3, std::uint8_t{3});
    }
  }
  EXPECT_FALSE(find_lens_field(organ.view()));
  EXPECT_THAT(mask_of(organ), ::testing::Each(::testing::Ne(0)));
}

TEST(OverlapMask, LeavesOutTheSurroundAndItsBlurredEdge) {
  const LensField field{160, 120, 110, 110};
  const Video video = tissue(320, 240, field);
  const auto mask = mask_of(video);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      const double r = std::hypot(x - 160, y - 120);
      const bool kept = mask[video.index(x, y)] != 0;
      EXPECT_TRUE(r <= 109 || !kept) << x << " " << y;
      EXPECT_TRUE(r >= 104 || kept) << x << " " << y;
    }
  }
}

TEST(OverlapMask, LeavesOutHighlightsAndInstrumentsButNotBrightColours) {
  Video video = tissue(320, 240, std::nullopt);
  const auto paint = [&](int x0, std::array<std::uint8_t, 3> rgb) {
    for (int y = 40; y < 50; ++y) {
      for (int x = x0; x < x0 + 10; ++x) std::copy(rgb.begin(), rgb.end(), video.at(x, y));
    }
  };
  paint(50, {255, 250, 245});  // highlight
  paint(150, {250, 200, 90});  // fat
  std::vector<std::uint8_t> instruments(video.rgb.size() / 3, 0);
  for (int y = 100; y < 120; ++y) std::fill_n(&instruments[video.index(200, y)], 30, std::uint8_t{1});
  const auto mask = mask_of(video, instruments);
  const auto kept = [&](int x, int y) { return mask[video.index(x, y)] != 0; };
  EXPECT_FALSE(kept(55, 45));
  EXPECT_FALSE(kept(48, 45));  // its rim
  EXPECT_TRUE(kept(44, 45));
  EXPECT_TRUE(kept(155, 45));
  EXPECT_FALSE(kept(215, 110));
  EXPECT_TRUE(kept(235, 110));
}

TEST(OverlapMask, RefusesInOneLine) {
  const Video video = tissue(64, 48, std::nullopt);
  const std::vector<std::uint8_t> small(10), all(video.rgb.size() / 3, 1);
  EXPECT_THAT(overlap_mask(video.view(), small).error().what, HasSubstr("instrument mask: 10"));
  EXPECT_THAT(overlap_mask({video.rgb, 64, 47}).error().what, HasSubstr("video picture"));
  EXPECT_EQ(overlap_mask(video.view(), all).error().code, Errc::degenerate);
}

TEST(OverlapMask, FindsTheFieldsOfRealLaparoscopes) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings";
  // From the first and last lit pixels of a few rows, to about 1 % of a radius. The stereo endoscope's pixels are not
  // square.
  const std::pair<const char*, LensField> fields[] = {
      {"laparoscopic_liver_patient/image0232.jpg", {880, 557, 704, 704}},
      {"stereo_endoscope_ct_surface/Stereo_SD_d_complete_22_IMG_left.bmp", {367.5, 294, 269.5, 288}}};
  for (const auto& [name, truth] : fields) {
    cv::Mat picture = cv::imread((*data / name).string());
    if (picture.empty()) GTEST_SKIP() << "no " << name;
    cv::cvtColor(picture, picture, cv::COLOR_BGR2RGB);
    expect_field(find_lens_field({{picture.data, picture.total() * 3}, picture.cols, picture.rows}), truth,
                 0.015 * truth.radius_x_px);
  }
  const char* const unround = "overlay_projection_reference/fig06_case1b.png";
  cv::Mat picture = cv::imread((*data / unround).string());
  if (picture.empty()) GTEST_SKIP() << "no " << unround;
  EXPECT_FALSE(find_lens_field({{picture.data, picture.total() * 3}, picture.cols, picture.rows}));
}

}  // namespace
}  // namespace birdseye::host
