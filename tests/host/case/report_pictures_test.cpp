// What the reports of registrations show.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibration/geometry/rotations.hpp"
#include "host/case/fiducial_report.hpp"
#include "host/case/marker_picture.hpp"
#include "host/case/registration_report.hpp"
#include "host/report/svg.hpp"

namespace birdseye::host {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::array<int, 3> colour_at(const Picture& picture, int x, int y) {
  const auto at = static_cast<std::size_t>(3 * (y * picture.width_px + x));
  return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
}

ImageRgba square(int from, int to) {
  ImageRgba out{64, 64, std::vector<std::uint8_t>(std::size_t{4} * 64 * 64, 0)};
  for (int y = from; y < to; ++y) {
    for (int x = from; x < to; ++x) out.rgba[static_cast<std::size_t>(4 * (y * 64 + x) + 3)] = 255;
  }
  return out;
}

TEST(OutlinePicture, HasBothOutlinesAndNothingElse) {
  const Picture view{64, 64, std::vector<std::uint8_t>(std::size_t{3} * 64 * 64, 10)};
  const Picture picture = outline_picture(view, square(8, 56), square(20, 44));
  const std::array<int, 3> orange{230, 159, 0}, blue{86, 180, 233}, ground{10, 10, 10};
  for (int x = 20; x < 44; ++x) EXPECT_EQ(colour_at(picture, x, 20), blue) << x;
  int dashes = 0;
  for (int x = 8; x < 56; ++x) dashes += colour_at(picture, x, 8) == orange ? 1 : 0;
  EXPECT_GT(dashes, 16);
  EXPECT_LT(dashes, 40) << "dashed, for prints without colours";
  EXPECT_EQ(colour_at(picture, 32, 32), ground) << "the organ stays as the video shows it";
  EXPECT_EQ(colour_at(picture, 3, 3), ground);
}

TEST(OutlinePicture, OfAnOrganThatFillsTheViewIsTheView) {
  const Picture view{64, 64, std::vector<std::uint8_t>(std::size_t{3} * 64 * 64, 10)};
  EXPECT_EQ(outline_picture(view, square(0, 64), square(0, 64)).rgb, view.rgb);
}

/// Six markers, the fourth touched 9 mm off.
struct Touched {
  FiducialInput input;
  FiducialsFound found;
  Touched() {
    input.ct_mm = {{-152, -50, 40}, {-78, -101, 106}, {-15, -113, 132},
                   {70, -105, 86},  {-99, -95, -38},  {34, -114, -56}};
    const Transform<Tracker, Patient> move(rotation_exp(Eigen::Vector3d(0.3, -0.8, 0.4)), {300, 20, -40});
    for (std::size_t i = 0; i < input.ct_mm.size(); ++i) {
      const auto k = static_cast<double>(i);
      input.touched_mm.push_back(move * input.ct_mm[i] + 0.3 * Eigen::Vector3d(std::sin(5 * k), std::cos(3 * k), 0.2));
    }
    input.touched_mm[3] += Eigen::Vector3d(6, 6, -3);
    auto done = register_fiducials({}, input);
    if (done) found = *std::move(done);
  }
};

TEST(FiducialReport, HasEachPictureAndMarksTheWrongTouch) {
  Touched t;
  t.input.targets_mm = {{-48, -20, 10}};
  t.found.tre_mm = {1.5};
  const std::string page = fiducials_page(t.input, t.found, judge_fiducials(t.found)).html();
  for (const char* heading : {"Where the markers are", "By how much each touch is off", "Error to be expected"})
    EXPECT_THAT(page, HasSubstr(std::string("<h2>") + heading));
  ASSERT_EQ(t.found.odd.named.size(), 1U);
  EXPECT_THAT(page, HasSubstr(fmt::format("fill='{}'>4</text>", kRed)));
  EXPECT_THAT(page, Not(HasSubstr(fmt::format("fill='{}'>5</text>", kRed))));
  EXPECT_THAT(page, HasSubstr("target 1"));
  EXPECT_THAT(page, Not(HasSubstr("The markers in the CT"))) << "there is no CT";
  EXPECT_THAT(page, Not(HasSubstr("before and after"))) << "nor a surface";
}

TEST(FiducialReport, ShowsTheMarkersInTheCt) {
  Touched t;
  Volume ct;
  ct.size = {20, 20, 20};
  ct.spacing_mm = {10, 10, 10};
  ct.patient_from_voxel = Eigen::Translation3d(-150, -150, -60) * Eigen::Scaling(10.0);
  ct.hu.assign(8000, 40);
  t.input.volume = ct;
  EXPECT_THAT(fiducials_page(t.input, t.found, {}).html(), HasSubstr("The markers in the CT"));
}

TEST(MarkerPicture, HasThreeSlicesOfEachMarker) {
  Volume ct;
  ct.size = {20, 20, 20};
  ct.spacing_mm = {10, 10, 10};
  ct.patient_from_voxel = Eigen::Translation3d(-100, -100, -100) * Eigen::Scaling(10.0);
  ct.hu.assign(8000, 0);
  FoundMarkers found;
  found.markers.resize(1);
  found.markers[0].hu = 1000;
  found.doubtful.push_back({{20, 0, 0}, "cut"});
  const Picture picture = draw_markers(ct, found, 30);
  // Cross hairs beside the middles of six tiles, which are left open: the found one's blue, the doubtful one's orange.
  for (int tile = 0; tile < 6; ++tile) {
    const auto [red, green, blue] = colour_at(picture, 600 + 150 * tile + 75 + 20, 74);
    EXPECT_EQ(blue > red, tile < 3) << tile;
    EXPECT_NE(red, blue) << tile;
    const auto middle = colour_at(picture, 600 + 150 * tile + 75, 75);
    EXPECT_EQ(middle[0], middle[2]) << "hides the marker";
  }
}

}  // namespace
}  // namespace birdseye::host
