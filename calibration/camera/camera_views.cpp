#include "calibration/camera/camera_views.hpp"

#include <fmt/format.h>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/calib3d.hpp>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

constexpr std::size_t kLeastPoints = 6;  // four fix a pose; two more say whether it is one

bool inside(const Eigen::Vector2d& p, int width_px, int height_px) {
  return p.x() >= -0.5 && p.y() >= -0.5 && p.x() <= width_px - 0.5 && p.y() <= height_px - 0.5;
}

/// Zhang's closed form and the pose of a single view want points of a plane, and not all on a line of it.
std::string shape_fault_of(const PatternView& view) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double extent = 0;
  for (const Eigen::Vector3d& p : view.points_in_marker_mm) {
    mean += p / static_cast<double>(view.ids.size());
    extent = std::max(extent, p.norm());
  }
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector3d& p : view.points_in_marker_mm) {
    if (std::abs(p.z()) > 1e-6 * extent) return "the board is not flat: its points must have z = 0";
    const Eigen::Vector2d from_mean = (p - mean).head<2>();
    scatter += from_mean * from_mean.transpose();
  }
  if (scatter.determinant() < 1e-4 * scatter.trace() * scatter.trace()) return "its points lie on a line";
  return {};
}

/// Why a view cannot be used, or nothing.
std::string fault_of(const PatternView& view, int width_px, int height_px) {
  if (view.ids.size() < kLeastPoints) return fmt::format("{} points, of at least {}", view.ids.size(), kLeastPoints);
  std::vector<int> ids = view.ids;
  std::sort(ids.begin(), ids.end());
  if (const auto twice = std::adjacent_find(ids.begin(), ids.end()); twice != ids.end())
    return fmt::format("point {} is there twice", *twice);
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    if (!view.points_px[i].allFinite() || !view.points_in_marker_mm[i].allFinite())
      return fmt::format("point {} is not a finite number", view.ids[i]);
    if (!inside(view.points_px[i], width_px, height_px)) {
      return fmt::format("point {} at ({:.0f}, {:.0f}) px lies outside the picture of {}x{}", view.ids[i],
                         view.points_px[i].x(), view.points_px[i].y(), width_px, height_px);
    }
  }
  return shape_fault_of(view);
}

SoundView sorted(const PatternView& view, std::size_t index) {
  std::vector<std::size_t> order(view.ids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return view.ids[a] < view.ids[b]; });
  SoundView out;
  out.index = index;
  out.name = view.name;
  for (const std::size_t i : order) {
    out.ids.push_back(view.ids[i]);
    out.bundle.points_mm.push_back(view.points_in_marker_mm[i]);
    out.bundle.points_px.push_back(view.points_px[i]);
  }
  out.bundle.weights.assign(order.size(), 1.0);
  return out;
}

bool comes_before(const SoundView& a, const SoundView& b) {
  const auto key = [](const Eigen::Vector2d& p) { return std::pair(p.x(), p.y()); };
  return std::lexicographical_compare(a.bundle.points_px.begin(), a.bundle.points_px.end(), b.bundle.points_px.begin(),
                                      b.bundle.points_px.end(),
                                      [&](const auto& p, const auto& q) { return key(p) < key(q); });
}

/// Whether two views show the board at the same place: a camera and a board that did not move between two pictures.
bool same_pose(const SoundView& a, const SoundView& b, int width_px) {
  constexpr double kStill = 0.5 / 1920;  // of the width: what detection alone moves corners by
  double squares = 0;
  std::size_t shared = 0;
  for (std::size_t i = 0, k = 0; i < a.ids.size() && k < b.ids.size();) {
    if (a.ids[i] == b.ids[k]) {
      squares += (a.bundle.points_px[i] - b.bundle.points_px[k]).squaredNorm();
      ++shared, ++i, ++k;
    } else {
      (a.ids[i] < b.ids[k] ? i : k)++;
    }
  }
  return shared >= kLeastPoints && std::sqrt(squares / static_cast<double>(shared)) < kStill * width_px;
}

void reject_twins(SoundViews& sound, int width_px) {
  std::vector<SoundView> kept;
  for (SoundView& view : sound.views) {
    const auto twin =
        std::find_if(kept.begin(), kept.end(), [&](const SoundView& k) { return same_pose(k, view, width_px); });
    if (twin != kept.end()) {
      sound.rejected.push_back({view.index, view.name, fmt::format("the same pose as in {}", twin->name)});
    } else {
      kept.push_back(std::move(view));
    }
  }
  sound.views = std::move(kept);
}

struct FlatView {
  std::vector<cv::Point3f> board;
  std::vector<cv::Point2f> pixels;
};

/// The points that one homography explains to within what a lens bends; empty where they are fewer than half.
FlatView flat_part(const SoundView& view, int width_px, bool robust) {
  constexpr double kBent = 0.03;  // of the width, over a board that fills the picture of a 100 degree lens
  FlatView all, flat;
  std::vector<cv::Point2f> plane;
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    const Eigen::Vector3f p = view.bundle.points_mm[i].cast<float>();
    const Eigen::Vector2f q = view.bundle.points_px[i].cast<float>();
    all.board.emplace_back(p.x(), p.y(), 0.0F);
    all.pixels.emplace_back(q.x(), q.y());
    plane.emplace_back(p.x(), p.y());
  }
  if (!robust) return all;
  cv::Mat mask;
  const cv::Mat homography = cv::findHomography(plane, all.pixels, cv::RANSAC, kBent * width_px, mask);
  if (homography.empty()) return {};
  for (std::size_t i = 0; i < all.board.size(); ++i) {
    if (mask.at<std::uint8_t>(static_cast<int>(i)) == 0) continue;
    flat.board.push_back(all.board[i]);
    flat.pixels.push_back(all.pixels[i]);
  }
  return 2 * flat.board.size() > all.board.size() && flat.board.size() >= kLeastPoints ? flat : FlatView{};
}

CameraModel first_lens(const std::vector<FlatView>& flat, int width_px, int height_px, double pixel_aspect) {
  std::vector<std::vector<cv::Point3f>> boards;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const FlatView& view : flat) {
    boards.push_back(view.board);
    pixels.push_back(view.pixels);
  }
  const cv::Mat matrix = cv::initCameraMatrix2D(boards, pixels, cv::Size(width_px, height_px), 1 / pixel_aspect);
  CameraModel camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  const double focal = matrix.at<double>(0, 0);
  // Boards that all face the camera leave the closed form without an answer, or with one far off.
  const bool likely = focal > 0.1 * width_px && focal < 50.0 * width_px;
  camera.fx_px = likely ? focal : width_px;
  camera.fy_px = pixel_aspect * camera.fx_px;
  camera.cx_px = (width_px - 1) / 2.0;
  camera.cy_px = (height_px - 1) / 2.0;
  return camera;
}

/// Empty where the points put the board nowhere before the camera.
std::optional<Transform<Camera, Marker>> first_pose(const FlatView& flat, const CameraModel& camera) {
  const cv::Mat matrix =
      (cv::Mat_<double>(3, 3) << camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1);
  cv::Mat r, t;
  if (!cv::solvePnP(flat.board, flat.pixels, matrix, cv::noArray(), r, t)) return std::nullopt;
  const Transform<Camera, Marker> pose(rotation_exp(Eigen::Vector3d(r.at<double>(0), r.at<double>(1), r.at<double>(2))),
                                       Eigen::Vector3d(t.at<double>(0), t.at<double>(1), t.at<double>(2)));
  for (const cv::Point3f& p : flat.board) {
    if (!((pose * Eigen::Vector3d(p.x, p.y, 0)).z() > 0)) return std::nullopt;
  }
  return pose;
}

}  // namespace

Error too_few_views(std::size_t usable, const std::vector<RejectedView>& rejected) {
  std::string what =
      fmt::format("{} usable views of the board, of at least {}: take more, with the board tilted to all sides", usable,
                  kLeastViews);
  for (std::size_t i = 0; i < rejected.size() && i < 3; ++i)
    what += fmt::format("; {}: {}", rejected[i].name, rejected[i].reason);
  if (rejected.size() > 3) what += fmt::format("; and {} more rejected", rejected.size() - 3);
  return Error{Errc::degenerate, what};
}

Result<SoundViews> sort_out(std::span<const PatternView> views, int width_px, int height_px) {
  if (width_px <= 0 || height_px <= 0)
    return Error{Errc::bad_value, fmt::format("a picture of {}x{} px: give its size", width_px, height_px)};
  SoundViews out;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const PatternView& view = views[v];
    if (view.points_in_marker_mm.size() != view.ids.size() || view.points_px.size() != view.ids.size()) {
      return Error{Errc::bad_value,
                   fmt::format("{}: {} ids, {} points of the board and {} of the picture", view.name, view.ids.size(),
                               view.points_in_marker_mm.size(), view.points_px.size())};
    }
    if (const std::string fault = fault_of(view, width_px, height_px); !fault.empty()) {
      out.rejected.push_back({v, view.name, fault});
    } else {
      out.views.push_back(sorted(view, v));
    }
  }
  std::stable_sort(out.views.begin(), out.views.end(), comes_before);
  reject_twins(out, width_px);
  return out;
}

Result<CameraModel> start_camera(SoundViews& sound, int width_px, int height_px, double pixel_aspect, bool robust) {
  try {
    std::vector<SoundView> kept;
    std::vector<FlatView> flat;
    for (SoundView& view : sound.views) {
      FlatView part = flat_part(view, width_px, robust);
      if (part.board.empty()) {
        sound.rejected.push_back(
            {view.index, view.name, "its points lie on no flat board: misnumbered, or another board's"});
        continue;
      }
      flat.push_back(std::move(part));
      kept.push_back(std::move(view));
    }
    if (kept.size() < kLeastViews) return too_few_views(kept.size(), sound.rejected);
    const CameraModel camera = first_lens(flat, width_px, height_px, pixel_aspect);
    sound.views.clear();
    for (std::size_t v = 0; v < kept.size(); ++v) {
      const auto pose = first_pose(flat[v], camera);
      if (!pose) {
        sound.rejected.push_back({kept[v].index, kept[v].name, "the board would be behind the camera"});
        continue;
      }
      kept[v].bundle.camera_from_marker = *pose;
      sound.views.push_back(std::move(kept[v]));
    }
    if (sound.views.size() < kLeastViews) return too_few_views(sound.views.size(), sound.rejected);
    return camera;
  } catch (const cv::Exception&) {
    return Error{Errc::degenerate, "the views do not determine a camera: take more, from different tilts and places"};
  }
}

}  // namespace birdseye::calibration
