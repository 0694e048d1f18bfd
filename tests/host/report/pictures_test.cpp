// What the pictures of reports show, and that everybody can tell it apart.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <limits>
#include <regex>

#include "host/report/even_colours.hpp"
#include "host/report/line_plot.hpp"
#include "host/report/place_views.hpp"
#include "host/report/slice_picture.hpp"

namespace birdseye::host {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

/// Linear RGB of "#rrggbb".
Vector3d linear(const std::string& colour) {
  Vector3d out;
  for (int c = 0; c < 3; ++c) {
    const double value =
        static_cast<double>(std::strtol(colour.substr(static_cast<std::size_t>(1 + 2 * c), 2).c_str(), nullptr, 16));
    out[c] = std::pow(value / 255, 2.2);
  }
  return out;
}

/// As somebody without the middle cones sees it: F. Vienot, H. Brettel and J. Mollon, Color Res. Appl. 24(4), 1999.
Vector3d as_a_deuteranope_sees(const Vector3d& rgb) {
  Eigen::Matrix3d lms_from_rgb;
  lms_from_rgb << 17.8824, 43.5161, 4.11935, 3.45565, 27.1554, 3.86714, 0.0299566, 0.184309, 1.46709;
  Vector3d lms = lms_from_rgb * rgb;
  lms[1] = 0.494207 * lms[0] + 1.24827 * lms[2];
  return (lms_from_rgb.inverse() * lms).cwiseMax(0).array().pow(1 / 2.2);
}

TEST(ReportPictures, ColoursAreToldApartWithoutTheMiddleCones) {
  const std::vector<std::string> together{kBlue, kOrange, kGreen, kPurple, kInk};
  for (std::size_t i = 0; i < together.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GT((as_a_deuteranope_sees(linear(together[i])) - as_a_deuteranope_sees(linear(together[j]))).norm(), 0.15)
          << together[i] << " and " << together[j];
  }
  EXPECT_GT((as_a_deuteranope_sees(linear(kBlue)) - as_a_deuteranope_sees(linear(kRed))).norm(), 0.3);
}

TEST(ReportPictures, EvenColoursGrowBrighterAllTheWay) {
  double before = -1;
  for (int i = 0; i <= 20; ++i) {
    const Colour colour = even_colour(i / 20.0);
    const double bright = 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2];
    EXPECT_GT(bright, before);
    before = bright;
  }
  EXPECT_EQ(even_colour(-3), even_colour(0));
  EXPECT_EQ(even_colour(7), even_colour(1));
  for (const double none : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(even_colour(none), (Colour{128, 128, 128}));
}

std::vector<std::string> all_of(const std::string& text, const std::string& pattern) {
  const std::regex what(pattern);
  std::vector<std::string> out;
  for (std::sregex_iterator at(text.begin(), text.end(), what), end; at != end; ++at) out.push_back((*at)[1].str());
  return out;
}

TEST(ReportPictures, CurvesDifferInDashesToo) {
  const Curve a{"a", {{0, 1}, {1, 2}}}, b{"b", {{0, 2}, {1, 1}}};
  const std::string svg = plot_svg({{"one", "x", "y", {a, b}}, {"other", "x", "y", {b}}}, 2);
  const auto dashes = all_of(svg, "<polyline[^>]*stroke-dasharray='([^']*)'");
  ASSERT_EQ(dashes.size(), 3U);
  EXPECT_NE(dashes[0], dashes[1]);
  EXPECT_EQ(dashes[1], dashes[2]) << "one name, one look";
}

/// Centres of what is drawn as a dot, in the order of panels and marks.
std::vector<Eigen::Vector2d> dots_of(const std::string& svg) {
  const auto x = all_of(svg, "<circle cx='([^']*)'"), y = all_of(svg, "<circle cx='[^']*' cy='([^']*)'");
  std::vector<Eigen::Vector2d> out;
  for (std::size_t i = 0; i < x.size(); ++i) out.emplace_back(std::stod(x[i]), std::stod(y[i]));
  return out;
}

TEST(PlaceViews, OneScaleInAllPanels) {
  PlaceViews views;
  views.marks = {{{0, 0, 0}}, {{100, 0, 0}}, {{0, 50, 0}}, {{0, 0, 25}}};
  const auto dots = dots_of(place_views_svg(views, 1));
  ASSERT_EQ(dots.size(), 12U);
  const double per_mm = (dots[1].x() - dots[0].x()) / 100;
  EXPECT_GT(per_mm, 0);
  EXPECT_NEAR(dots[0].y() - dots[2].y(), 50 * per_mm, 0.2) << "y upwards in the first panel";
  EXPECT_NEAR(dots[4].y() - dots[7].y(), 25 * per_mm, 0.2) << "z upwards in the second";
  EXPECT_NEAR(dots[10].x() - dots[8].x(), 50 * per_mm, 0.2) << "y across in the third";
}

TEST(PlaceViews, ArrowsAreDrawnAsManyTimesAsLong) {
  PlaceViews views;
  views.marks = {{{0, 0, 0}, {1, 0, 0}}, {{100, 0, 0}}};
  const double times = arrow_times(views.marks);
  EXPECT_GE(times, 10);
  EXPECT_LE(times, 25) << "a sixth of the extent";
  const std::string svg = place_views_svg(views, times);
  const auto dots = dots_of(svg);
  const auto ends = all_of(svg, "<path d='M[0-9.]+ [0-9.]+L([0-9.]+) [0-9.]+M");
  ASSERT_FALSE(ends.empty());
  EXPECT_NEAR(std::stod(ends[0]) - dots[0].x(), times / 100 * (dots[1].x() - dots[0].x()), 0.3);
}

TEST(PlaceViews, LeavesOutWhatIsNoNumber) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  PlaceViews views;
  views.marks = {{{0, 0, 0}}, {{kNone, 0, 0}}, {{1, 2, 3}, {0, kNone, 0}}};
  const std::string svg = place_views_svg(views, arrow_times(views.marks));
  EXPECT_EQ(dots_of(svg).size(), 3U);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(place_views_svg({}, arrow_times({})).find("nan"), std::string::npos);
}

TEST(ThreePlanes, MarkAPlaceWhereEachPlaneShowsIt) {
  constexpr int kSide_px = 100;
  const ThreePlanes planes({10, 20, 30}, 50, kSide_px);
  Picture picture{3 * kSide_px, kSide_px, std::vector<std::uint8_t>(std::size_t{9} * kSide_px * kSide_px, 0)};
  planes.mark(picture, {100, 20, 30}, {255, 0, 0});
  // Far to the left: outside of the axial and the coronal slice, in the middle of the sagittal one.
  const auto red_in = [&](int tile) {
    int count = 0;
    for (int y = 0; y < kSide_px; ++y) {
      for (int x = tile * kSide_px; x < (tile + 1) * kSide_px; ++x)
        count += picture.rgb[static_cast<std::size_t>(3 * (y * picture.width_px + x))] > 100 ? 1 : 0;
    }
    return count;
  };
  EXPECT_EQ(red_in(0), 0);
  EXPECT_EQ(red_in(1), 0);
  EXPECT_GT(red_in(2), 40);
}

}  // namespace
}  // namespace birdseye::host
