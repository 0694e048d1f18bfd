#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>

#include "calibration/detect/detect.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "tests/support/grey_view.hpp"

namespace birdseye::calibration {
namespace {

using testing::view_of;

constexpr const char* kSymmetric = "dots:11x9:4mm";
constexpr const char* kAsymmetric = "dots:4x11:5mm:asymmetric";
constexpr const char* kBarred = "dots:19x15:3mm:bars=142-146,105-181";
constexpr const char* kMarked = "dots:25x18:3mm:markers=133,141,308,317";

const CameraModel kCamera{.width_px = 800,
                          .height_px = 600,
                          .fx_px = 700,
                          .fy_px = 705,
                          .cx_px = 405,
                          .cy_px = 296,
                          .k1 = -0.25,
                          .k2 = 0.08,
                          .p1 = 0.001,
                          .p2 = -0.0008};

/// How a grid is drawn and seen.
struct Scene {
  double tilt_deg = 0, tilt_axis_deg = 0;
  double turn_deg = 0;  ///< in the picture, clockwise
  double distance_mm = 80;
  Eigen::Vector2d middle = Eigen::Vector2d::Constant(0.5);  ///< what of the grid stands before the lens, as shares
  double ground = 200, dot = 40;
  double blur_px = 1, noise = 3;
  double larger_times = 1.5;    ///< the larger dots' diameter, in diameters of the others
  double diameter_steps = 0.5;  ///< of the other dots, in steps of the pattern
  std::set<int> without = {};
};

/// What was rendered, and where the dots' centres project to.
struct Picture {
  cv::Mat grey;
  std::vector<std::optional<Eigen::Vector2d>> truth_px;
};

Eigen::Isometry3d camera_from_marker(const Pattern& pattern, const Scene& scene) {
  const Eigen::Vector3d last = pattern_points_mm(pattern).back();
  const Eigen::Vector3d middle(scene.middle.x() * last.x(), scene.middle.y() * last.y(), 0);
  const auto rad = [](double deg) { return deg * std::numbers::pi / 180; };
  const Eigen::Vector3d axis(std::cos(rad(scene.tilt_axis_deg)), std::sin(rad(scene.tilt_axis_deg)), 0);
  return Eigen::Translation3d(0, 0, scene.distance_mm) * Eigen::AngleAxisd(rad(scene.tilt_deg), axis) *
         Eigen::AngleAxisd(rad(scene.turn_deg), Eigen::Vector3d::UnitZ()) * Eigen::Translation3d(-middle);
}

/// The rays through the corners of the pixels; one camera for all pictures.
const std::vector<Eigen::Vector3d>& corner_rays() {
  static const auto rays = [] {
    std::vector<Eigen::Vector3d> all;
    for (int y = 0; y <= kCamera.height_px; ++y) {
      for (int x = 0; x <= kCamera.width_px; ++x)
        all.push_back(unproject(kCamera, {x - 0.5, y - 0.5}).value_or(Eigen::Vector3d(9, 9, 1)));
    }
    return all;
  }();
  return rays;
}

/// Whether a bar as wide as a dot lies off a place of the grid, by so many steps: from place to place that it covers.
bool is_bar(const Pattern& pattern, const Eigen::Vector2i& place, const Eigen::Vector2d& off) {
  const auto covered = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < pattern.columns && y < pattern.rows &&
           std::ranges::binary_search(pattern.under_bars, y * pattern.columns + x);
  };
  constexpr double kHalf = 0.25;
  if (!covered(place.x(), place.y())) return false;
  const bool beside = covered(place.x() + (off.x() > 0 ? 1 : -1), place.y());
  const bool below = covered(place.x(), place.y() + (off.y() > 0 ? 1 : -1));
  return (std::abs(off.y()) < kHalf && (beside || std::abs(off.x()) < kHalf)) ||
         (std::abs(off.x()) < kHalf && (below || std::abs(off.y()) < kHalf));
}

/// Whether there is a dot, or a bar, at a place of the pattern, mm.
bool is_dot(const Pattern& pattern, const std::vector<double>& radius_mm, const Eigen::Vector2d& mm) {
  const int row = static_cast<int>(std::lround(mm.y() / pattern.spacing_mm));
  if (row < 0 || row >= pattern.rows) return false;
  const double step_mm = pattern.spacing_mm * (pattern.asymmetric ? 2 : 1);
  const double moved_mm = pattern.asymmetric ? row % 2 * pattern.spacing_mm : 0;
  const int column = static_cast<int>(std::lround((mm.x() - moved_mm) / step_mm));
  if (column < 0 || column >= pattern.columns) return false;
  const Eigen::Vector2d centre(column * step_mm + moved_mm, row * pattern.spacing_mm);
  if (is_bar(pattern, {column, row}, (mm - centre) / pattern.spacing_mm)) return true;
  return (mm - centre).norm() < radius_mm[static_cast<std::size_t>(row * pattern.columns + column)];
}

Picture render(const Pattern& pattern, const Scene& scene) {
  const auto points_mm = pattern_points_mm(pattern);
  std::vector<double> radius_mm(points_mm.size(),
                                scene.diameter_steps / 2 * pattern.spacing_mm * (pattern.asymmetric ? 1.4 : 1));
  for (const int id : pattern.larger_dots) radius_mm[static_cast<std::size_t>(id)] *= scene.larger_times;
  for (const int id : pattern.under_bars) radius_mm[static_cast<std::size_t>(id)] = 0;
  for (const int id : scene.without) radius_mm[static_cast<std::size_t>(id)] = 0;
  const Eigen::Isometry3d pose = camera_from_marker(pattern, scene);
  const Eigen::Isometry3d back = pose.inverse();
  std::vector<Eigen::Vector2d> corners_mm;
  for (const Eigen::Vector3d& ray : corner_rays()) {
    const Eigen::Vector3d along = back.linear() * ray;
    const double depth = -back.translation().z() / along.z();
    corners_mm.emplace_back(depth > 0 ? Eigen::Vector2d((back.translation() + depth * along).head<2>())
                                      : Eigen::Vector2d(1e6, 1e6));
  }
  cv::Mat light(kCamera.height_px, kCamera.width_px, CV_32F);
  constexpr int kSub = 4;
  const int across = kCamera.width_px + 1;
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      const Eigen::Vector2d* at = &corners_mm[static_cast<std::size_t>(y * across + x)];
      int hits = 0;
      for (int k = 0; k < kSub * kSub; ++k) {
        const double u = (k % kSub + 0.5) / kSub;
        const double v = (k / kSub + 0.5) / kSub;
        hits += is_dot(pattern, radius_mm,
                       (1 - v) * ((1 - u) * at[0] + u * at[1]) + v * ((1 - u) * at[across] + u * at[across + 1]));
      }
      light.at<float>(y, x) =
          static_cast<float>(scene.ground + (scene.dot - scene.ground) * hits / double(kSub * kSub));
    }
  }
  if (scene.blur_px > 0) cv::GaussianBlur(light, light, {0, 0}, scene.blur_px);
  cv::Mat noise(light.size(), CV_32F);
  cv::RNG random(7);
  random.fill(noise, cv::RNG::NORMAL, 0, scene.noise);
  light += noise;
  Picture picture;
  light.convertTo(picture.grey, CV_8U);
  for (const Eigen::Vector3d& p : points_mm) picture.truth_px.push_back(project(kCamera, pose * p));
  return picture;
}

struct Errors {
  double rms_px = 0, max_px = 0;
  int seen = 0;
};

/// Each dot against where its own number projects to; a turned numbering shows as an error of many pixels.
Errors errors_of(const Detection& detection, const Picture& picture) {
  Errors errors;
  if (!detection.view) return errors;
  for (std::size_t i = 0; i < detection.view->ids.size(); ++i) {
    const auto& truth = picture.truth_px[static_cast<std::size_t>(detection.view->ids[i])];
    const double off = truth ? (detection.view->points_px[i] - *truth).norm() : 1e9;
    errors.rms_px += off * off;
    errors.max_px = std::max(errors.max_px, off);
  }
  errors.seen = static_cast<int>(detection.view->ids.size());
  errors.rms_px = std::sqrt(errors.rms_px / std::max(1, errors.seen));
  return errors;
}

void expect_found(const std::string& spec, const Scene& scene, int least, const std::string& what) {
  const auto pattern = parse_pattern(spec);
  ASSERT_TRUE(pattern);
  const Picture picture = render(*pattern, scene);
  const Detection seen = detect(*pattern, view_of(picture.grey), what);
  ASSERT_TRUE(seen.view) << what << ": " << seen.rejected;
  const Errors errors = errors_of(seen, picture);
  EXPECT_GE(errors.seen, least) << what;
  // The centroids alone, not corrected for perspective, are up to 0.18 px off (RMS).
  EXPECT_LT(errors.rms_px, 0.08) << what;
  EXPECT_LT(errors.max_px, 0.3) << what;
  if (std::getenv("DOTS_FIGURES"))
    fmt::print("{}: {} dots, rms {:.3f} max {:.3f} px; edges {:.1f} px, contrast {:.0f}\n", what, errors.seen,
               errors.rms_px, errors.max_px, seen.sharpness_px, seen.contrast);
}

TEST(DetectDots, WholeGridsLieWhereTheyProjectTo) {
  for (const char* spec : {kSymmetric, kAsymmetric, kMarked}) {
    for (const double tilt_deg : {0.0, 30.0, 45.0}) {
      for (const double axis_deg : {20.0, 90.0, 135.0}) {
        if (tilt_deg == 0 && axis_deg > 20) continue;
        for (const bool dark : {true, false}) {
          Scene scene{.tilt_deg = tilt_deg, .tilt_axis_deg = axis_deg};
          if (spec == kMarked) scene.distance_mm = 105;
          if (!dark) std::swap(scene.ground, scene.dot);
          const auto pattern = parse_pattern(spec);
          expect_found(spec, scene, pattern->columns * pattern->rows,
                       fmt::format("{} tilted by {} about {}, {}", spec, tilt_deg, axis_deg, dark ? "dark" : "light"));
        }
      }
    }
  }
}

TEST(DetectDots, TurnedGridsKeepTheirNumbers) {
  for (const double turn_deg : {90.0, 180.0, 270.0}) {
    for (const char* spec : {kAsymmetric, kMarked}) {
      const bool marked = spec == kMarked;
      const auto pattern = parse_pattern(spec);
      expect_found(spec,
                   {.tilt_deg = 25, .tilt_axis_deg = 50, .turn_deg = turn_deg, .distance_mm = marked ? 130.0 : 90.0},
                   pattern->columns * pattern->rows, fmt::format("{} turned by {}", spec, turn_deg));
    }
  }
  // Half a turn of these looks the same; the columns run to the right.
  for (const double turn_deg : {-80.0, 0.0, 80.0})
    expect_found(kSymmetric, {.tilt_deg = 10, .turn_deg = turn_deg, .distance_mm = 90}, 99, "upright");
}

TEST(DetectDots, PartsOfMarkedGridsAreNumberedByTheirLargerDots) {
  for (const double turn_deg : {0.0, 90.0, 180.0, 270.0}) {
    for (const double tilt_deg : {0.0, 35.0}) {
      expect_found(kMarked, {.tilt_deg = tilt_deg, .tilt_axis_deg = 30, .turn_deg = turn_deg, .distance_mm = 50}, 100,
                   fmt::format("part, turned by {}, tilted by {}", turn_deg, tilt_deg));
    }
  }
}

/// Plates in use have larger dots of 1.3 to 3.5 times the others' diameter; dots of a fifth of a step leave room for 4.
TEST(DetectDots, LargerDotsAreOfAnySizeThatTheGridLeavesRoomFor) {
  for (const double times : {1.3, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0}) {
    Scene scene{.distance_mm = 60, .larger_times = times, .diameter_steps = std::min(0.5, 0.88 / times)};
    const auto like = [&](const char* how) { return fmt::format("larger dots {} times as wide, {}", times, how); };
    expect_found(kMarked, scene, 200, like("from ahead"));
    for (const double axis_deg : {20.0, 110.0}) {
      scene.tilt_deg = 45;
      scene.tilt_axis_deg = axis_deg;
      expect_found(kMarked, scene, 200, like("oblique"));
    }
    scene.tilt_deg = 20;
    scene.blur_px = 2;
    expect_found(kMarked, scene, 200, like("blurred"));
    scene.distance_mm = 105;
    scene.blur_px = 0.6;
    if (times <= 3) expect_found(kMarked, scene, 440, like("from afar"));
  }
}

TEST(DetectDots, BarsNumberAGridWholeOrInPart) {
  const auto pattern = parse_pattern(kBarred);
  ASSERT_TRUE(pattern);
  const int dots = 19 * 15 - static_cast<int>(pattern->under_bars.size());
  EXPECT_EQ(dots, 19 * 15 - 9);  // the bars cross
  EXPECT_FALSE(pattern->half_turn_ambiguous);
  for (const double turn_deg : {0.0, 90.0, 180.0, 270.0}) {
    expect_found(kBarred, {.tilt_deg = 20, .tilt_axis_deg = 40, .turn_deg = turn_deg, .distance_mm = 105}, dots - 2,
                 fmt::format("bars, turned by {}", turn_deg));
    expect_found(kBarred, {.tilt_deg = 25, .tilt_axis_deg = 40, .turn_deg = turn_deg, .distance_mm = 45}, 60,
                 fmt::format("part with bars, turned by {}", turn_deg));
  }
  const Picture corner = render(*pattern, {.distance_mm = 25, .middle = {0.05, 0.05}});
  const Detection seen = detect(*pattern, view_of(corner.grey), "");
  EXPECT_FALSE(seen.view);
  EXPECT_NE(seen.rejected.find("too little of its bars"), std::string::npos) << seen.rejected;
}

std::string rejected(const std::string& spec, const Scene& scene) {
  const auto pattern = parse_pattern(spec);
  const Detection seen = detect(*pattern, view_of(render(*pattern, scene).grey), "");
  EXPECT_EQ(seen.view.has_value(), seen.rejected.empty());
  return seen.rejected;
}

TEST(DetectDots, WhatCannotBeNumberedIsRejectedInWords) {
  const auto says = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  std::string why = rejected(kSymmetric, {.distance_mm = 28});
  EXPECT_TRUE(says(why, "part of the grid")) << why;
  why = rejected(kAsymmetric, {.distance_mm = 35});
  EXPECT_TRUE(says(why, "part of the grid")) << why;
  why = rejected(kMarked, {.distance_mm = 40, .middle = {0, 0}});
  EXPECT_TRUE(says(why, "too few larger dots")) << why;
  why = rejected(kMarked, {.distance_mm = 105, .without = {133, 141, 308, 317}});
  EXPECT_TRUE(says(why, "too few larger dots")) << why;
  why = rejected(kMarked, {.distance_mm = 60, .larger_times = 1});
  EXPECT_TRUE(says(why, "too few larger dots")) << why;
  why = rejected(kSymmetric, {.ground = 30, .dot = 5, .noise = 1});
  EXPECT_TRUE(says(why, "too dark")) << why;
  why = rejected(kSymmetric, {.dot = 200});
  EXPECT_TRUE(says(why, "no dot grid")) << why;
  why = rejected(kSymmetric, {.blur_px = 11, .noise = 1});
  EXPECT_TRUE(says(why, "blurred")) << why;
}

TEST(DetectDots, AGridSeenFromBehindIsNamed) {
  for (const char* spec : {kMarked, "dots:4x10:5mm:asymmetric"}) {
    const auto pattern = parse_pattern(spec);
    const cv::Mat grey = render(*pattern, {.tilt_deg = 20, .distance_mm = 105}).grey;
    EXPECT_TRUE(detect(*pattern, view_of(grey), "").view) << spec;
    cv::Mat mirrored;
    cv::flip(grey, mirrored, 1);
    const Detection seen = detect(*pattern, view_of(mirrored), "");
    EXPECT_FALSE(seen.view) << spec;
    EXPECT_NE(seen.rejected.find("seen from behind"), std::string::npos) << seen.rejected;
  }
}

/// Blur, noise, light, tilt and turn as they come.
Scene any_scene(cv::RNG& random, bool marked) {
  Scene scene{.tilt_deg = random.uniform(0.0, 55.0),
              .tilt_axis_deg = random.uniform(0.0, 360.0),
              .turn_deg = random.uniform(-80.0, 80.0),
              .distance_mm = marked ? random.uniform(35.0, 110.0) : random.uniform(100.0, 130.0)};
  if (marked) scene.turn_deg += 90 * random.uniform(0, 4);
  scene.blur_px = random.uniform(0.5, 2.5);
  scene.noise = random.uniform(1.0, 8.0);
  scene.dot = random.uniform(20.0, 120.0);
  return scene;
}

struct Tally {
  int found = 0, misnumbered = 0;
  double worst_px = 0, worst_rms_px = 0;
  std::string words;
};

Tally tally(
    const std::string& spec, int count, const std::function<void(cv::RNG&, cv::Mat&)>& disturb,
    const std::function<void(Scene&)>& change = [](Scene&) {}) {
  const auto pattern = parse_pattern(spec);
  cv::RNG random(3);
  Tally tally;
  for (int k = 0; k < count; ++k) {
    Scene scene = any_scene(random, !pattern->larger_dots.empty());
    change(scene);
    Picture picture = render(*pattern, scene);
    disturb(random, picture.grey);
    const Detection seen = detect(*pattern, view_of(picture.grey), "");
    tally.words += seen.rejected.empty() ? "" : "; " + seen.rejected;
    if (!seen.view) continue;
    const Errors errors = errors_of(seen, picture);
    ++tally.found;
    tally.misnumbered += errors.max_px > 3;
    tally.worst_px = std::max(tally.worst_px, errors.max_px);
    tally.worst_rms_px = std::max(tally.worst_rms_px, errors.rms_px);
  }
  if (std::getenv("DOTS_FIGURES"))
    fmt::print("{}: {} of {}, {} misnumbered, worst {:.2f} px{}\n", spec, tally.found, count, tally.misnumbered,
               tally.worst_px, tally.words);
  return tally;
}

TEST(DetectDots, ViewsAsTheyComeAreReadAndNeverMisnumbered) {
  for (const char* spec : {kSymmetric, kAsymmetric, kMarked}) {
    const Tally seen = tally(spec, 10, [](cv::RNG&, cv::Mat&) {});
    EXPECT_GE(seen.found, 9) << spec << seen.words;
    EXPECT_EQ(seen.misnumbered, 0) << spec;
    EXPECT_LT(seen.worst_px, 0.8) << spec;
  }
}

/// A tool across the picture, a lamp's reflection, spots like dots, light that falls off to one side.
void clutter(cv::RNG& random, cv::Mat& grey) {
  const auto any_px = [&] { return cv::Point(random.uniform(0, grey.cols), random.uniform(0, grey.rows)); };
  for (int x = 0; x < grey.cols; ++x) grey.col(x) *= 1 - 0.5 * x / grey.cols;
  cv::line(grey, any_px(), {0, random.uniform(0, grey.rows)}, 120, 25, cv::LINE_AA);
  cv::circle(grey, any_px(), 30, 255, -1, cv::LINE_AA);
  for (int k = 0; k < 8; ++k) cv::circle(grey, any_px(), random.uniform(3, 9), 30, -1, cv::LINE_AA);
}

/// The round picture of a scope, dark outside and falling off towards its rim; a finger over part of the grid.
void vignette_and_finger(cv::RNG& random, cv::Mat& grey) {
  const cv::Point2d middle(grey.cols / 2.0, grey.rows / 2.0);
  const double radius_px = 0.52 * grey.rows;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const double out = std::hypot(x - middle.x, y - middle.y) / radius_px;
      auto& pixel = grey.at<unsigned char>(y, x);
      pixel = out > 1 ? 4 : cv::saturate_cast<unsigned char>(pixel * (1 - 0.6 * out * out));
    }
  }
  const double angle_deg = random.uniform(0.0, 360.0);
  cv::ellipse(grey,
              {static_cast<int>(middle.x + 0.8 * radius_px * std::cos(angle_deg / 57.3)),
               static_cast<int>(middle.y + 0.8 * radius_px * std::sin(angle_deg / 57.3))},
              {70, 30}, angle_deg, 0, 360, 90, -1, cv::LINE_AA);
}

TEST(DetectDots, LargerDotsOfAnySizeAreReadInVignettesAndBehindFingers) {
  for (const double times : {1.3, 2.5, 3.5}) {
    const Tally seen = tally(kMarked, 12, vignette_and_finger, [&](Scene& scene) {
      scene.larger_times = times;
      scene.diameter_steps = std::min(0.5, 0.88 / times);
      scene.distance_mm = std::min(scene.distance_mm, 70.0);
      scene.blur_px = std::min(scene.blur_px, 1.8);
      scene.tilt_deg = std::min(scene.tilt_deg, 40.0);
    });
    EXPECT_GE(seen.found, 8) << times << seen.words;
    EXPECT_EQ(seen.misnumbered, 0) << times;
    EXPECT_LT(seen.worst_rms_px, 0.2) << times;  // a dot that the rim cuts by a tenth is off by a pixel or two
  }
}

TEST(DetectDots, ClutterIsNotTakenForDots) {
  const Tally marked = tally(kMarked, 12, clutter);
  EXPECT_GE(marked.found, 8) << marked.words;
  EXPECT_EQ(marked.misnumbered, 0);
  for (const char* spec : {kSymmetric, kAsymmetric}) {
    const Tally plain = tally(spec, 12, clutter);  // often covered in part, which a plain grid may not be
    EXPECT_GE(plain.found, 2) << plain.words;
    EXPECT_EQ(plain.misnumbered, 0) << spec;
  }
}

TEST(DetectDots, AnotherPatternIsNotForcedOnTheDots) {
  const auto shown = parse_pattern(kMarked);
  const Picture picture = render(*shown, {.tilt_deg = 20, .distance_mm = 105});
  for (const char* other : {"dots:25x18:3mm:markers=131,144,308,317", "dots:24x18:3mm", "dots:25x18:3mm:asymmetric"}) {
    const Detection seen = detect(*parse_pattern(other), view_of(picture.grey), "");
    EXPECT_FALSE(seen.view) << other;
    EXPECT_NE(seen.rejected.find("another pattern"), std::string::npos) << other << ": " << seen.rejected;
  }
}

}  // namespace
}  // namespace birdseye::calibration
