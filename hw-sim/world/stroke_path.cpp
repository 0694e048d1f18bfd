#include "hw-sim/world/stroke_path.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr double kStrokePace_mm_s = 40;
// A hand that goes to another place is faster than any stroke.
constexpr double kLiftPace_mm_s = 400, kWayPace_mm_s = 250;
constexpr double kLift_mm = 30;
constexpr double kAcross_mm = 90, kLinesApart_mm = 12, kPlacesApart_mm = 2;
constexpr int kLines = 6;
constexpr double kFacesHand = 0.5;  // cosine: where it is steeper the tip would slip off

/// The surface as the hand sees it: heights towards the hand over a plane.
class FaceOfHand {
 public:
  FaceOfHand(const Mesh& surface, const Vector3d& towards_hand)
      : triangles_(surface.triangles), up_(towards_hand), x_(towards_hand.unitOrthogonal()), y_(up_.cross(x_)) {
    places_.reserve(surface.vertices.size());
    for (const Eigen::Vector3f& vertex : surface.vertices) {
      const Vector3d place = vertex.cast<double>();
      places_.emplace_back(place.dot(x_), place.dot(y_), place.dot(up_));
    }
  }

  /// The middle of what faces the hand, in the plane. Empty: nothing does.
  [[nodiscard]] std::optional<Eigen::Vector2d> middle() const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double area = 0;
    for (const auto& triangle : triangles_) {
      const auto [a, b, c] = corners(triangle);
      const Vector3d normal = (b - a).cross(c - a);
      if (!(normal.z() > kFacesHand * normal.norm())) continue;
      sum += normal.z() * (a + b + c).head<2>() / 3;
      area += normal.z();
    }
    if (!(area > 0)) return std::nullopt;
    return Eigen::Vector2d(sum / area);
  }

  /// The place of the surface that the hand sees at a place of the plane. Empty: none, or it is too steep there.
  [[nodiscard]] std::optional<Vector3d> place_mm(const Eigen::Vector2d& at) const {
    std::optional<double> highest;
    bool steep = false;
    for (const auto& triangle : triangles_) {
      const auto [a, b, c] = corners(triangle);
      const Vector3d normal = (b - a).cross(c - a);
      if (normal.z() == 0) continue;
      const auto beside = [&at](const Vector3d& from, const Vector3d& to) {
        return (to.x() - from.x()) * (at.y() - from.y()) - (to.y() - from.y()) * (at.x() - from.x());
      };
      const std::array sides{beside(a, b), beside(b, c), beside(c, a)};
      const bool inside = std::all_of(sides.begin(), sides.end(), [](double s) { return s >= 0; }) ||
                          std::all_of(sides.begin(), sides.end(), [](double s) { return s <= 0; });
      if (!inside) continue;
      const double height = a.z() - (normal.head<2>().dot(at - a.head<2>())) / normal.z();
      if (highest && height <= *highest) continue;
      highest = height;
      steep = normal.z() < kFacesHand * normal.norm();
    }
    if (!highest || steep) return std::nullopt;
    return Vector3d(at.x() * x_ + at.y() * y_ + *highest * up_);
  }

  [[nodiscard]] const Vector3d& up() const { return up_; }

 private:
  [[nodiscard]] std::array<Vector3d, 3> corners(const std::array<std::uint32_t, 3>& triangle) const {
    return {places_[triangle[0]], places_[triangle[1]], places_[triangle[2]]};
  }

  const std::vector<std::array<std::uint32_t, 3>>& triangles_;
  Vector3d up_, x_, y_;
  std::vector<Vector3d> places_;  ///< of the vertices, by the axes
};

/// The longest run of places of a line that follow one another.
std::vector<Vector3d> longest_run(const std::vector<std::optional<Vector3d>>& line) {
  std::vector<Vector3d> longest, run;
  for (const auto& place : line) {
    if (!place) {
      run.clear();
      continue;
    }
    run.push_back(*place);
    if (run.size() > longest.size()) longest = run;
  }
  return longest;
}

}  // namespace

StrokePath StrokePath::over(const Mesh& surface, const Vector3d& towards_hand, const Vector3d& park_mm) {
  const FaceOfHand face(surface, towards_hand);
  StrokePath path;
  const auto middle = face.middle();
  if (!middle) return path;
  path.stops_.push_back({0, park_mm, false});
  const Vector3d lift = kLift_mm * face.up();
  const int along = static_cast<int>(std::lround(kAcross_mm / kPlacesApart_mm));
  for (int line = 0; line < kLines; ++line) {
    std::vector<std::optional<Vector3d>> places;
    for (int i = 0; i <= along; ++i) {
      const Eigen::Vector2d from_middle(i * kPlacesApart_mm - 0.5 * kAcross_mm,
                                        (line - 0.5 * (kLines - 1)) * kLinesApart_mm);
      places.push_back(face.place_mm(*middle + from_middle));
    }
    if (line % 2 == 1) std::reverse(places.begin(), places.end());
    const std::vector<Vector3d> run = longest_run(places);
    if (run.size() < 2) continue;
    path.go_to(run.front() + lift, kWayPace_mm_s);
    path.go_to(run.front(), kLiftPace_mm_s);
    for (std::size_t i = 1; i < run.size(); ++i) path.go_to(run[i], kStrokePace_mm_s, true);
    path.go_to(run.back() + lift, kLiftPace_mm_s);
  }
  if (path.stops_.size() < 2) return {};
  path.go_to(park_mm, kWayPace_mm_s);
  return path;
}

void StrokePath::go_to(const Vector3d& tip_mm, double pace_mm_s, bool along_surface) {
  const Stop& last = stops_.back();
  stops_.push_back({last.at_s + (tip_mm - last.tip_mm).norm() / pace_mm_s, tip_mm, along_surface});
}

std::size_t StrokePath::stop_after(double since_s) const {
  const auto after =
      std::upper_bound(stops_.begin(), stops_.end(), since_s, [](double s, const Stop& stop) { return s < stop.at_s; });
  return static_cast<std::size_t>(std::distance(stops_.begin(), after));
}

Vector3d StrokePath::tip_in_patient_mm(double since_s) const {
  const std::size_t after = stop_after(since_s);
  if (after == 0) return stops_.front().tip_mm;
  if (after == stops_.size()) return stops_.back().tip_mm;
  const Stop &from = stops_[after - 1], &to = stops_[after];
  return from.tip_mm + (since_s - from.at_s) / (to.at_s - from.at_s) * (to.tip_mm - from.tip_mm);
}

bool StrokePath::on_surface(double since_s) const {
  const std::size_t after = stop_after(since_s);
  return after > 0 && after < stops_.size() && stops_[after].stroked_to;
}

}  // namespace birdseye::hw_sim
