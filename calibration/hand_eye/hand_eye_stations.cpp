#include "calibration/hand_eye/hand_eye_stations.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "calibration/base/median.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/hand_eye/hand_eye_observability.hpp"

namespace birdseye::calibration {

namespace {

/// No detector is better; exact corners would make it zero.
constexpr double kLeastCornerSigmaPx = 0.01;
/// Corners further off than so many sigmas are of something else: chance puts one in 10^8 there.
constexpr double kWrongCornerSigmas = 6;

PatternView sorted_by_place(const PatternView& view) {
  std::vector<std::size_t> order(view.points_px.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto key = [&](std::size_t i) {
    const Eigen::Vector3d& p = view.points_in_marker_mm[i];
    return std::tuple(p.z(), p.y(), p.x());
  };
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  PatternView out;
  for (const std::size_t i : order) {
    out.points_in_marker_mm.push_back(view.points_in_marker_mm[i]);
    out.points_px.push_back(view.points_px[i]);
  }
  return out;
}

bool finite(const PatternView& view) {
  return std::all_of(view.points_px.begin(), view.points_px.end(), [](const auto& p) { return p.allFinite(); }) &&
         std::all_of(view.points_in_marker_mm.begin(), view.points_in_marker_mm.end(),
                     [](const auto& p) { return p.allFinite(); });
}

template <typename To, typename From>
bool rigid(const Transform<To, From>& pose) {
  constexpr double kTolerance = 1e-3;  // as files of rounded numbers have
  const Eigen::Matrix3d& r = pose.rotation();
  return pose.matrix().allFinite() && (r.transpose() * r - Eigen::Matrix3d::Identity()).norm() < kTolerance &&
         r.determinant() > 0;
}

std::string fault_of(const HandEyeStation& s) {
  if (!rigid(s.tracker_from_sensor)) return "its pose holds no rotation, or numbers that are not finite";
  if (s.tracker_from_body && !rigid(*s.tracker_from_body))
    return "its board's pose holds no rotation, or numbers that are not finite";
  if (s.camera_from_marker && !rigid(*s.camera_from_marker))
    return "its camera's pose holds no rotation, or numbers that are not finite";
  if (!finite(s.view) || (s.right_view && !finite(*s.right_view))) return "a corner is not a finite number";
  return {};
}

/// What orders stations: all that they hold.
std::vector<double> key_of(const HandEyeStation& s) {
  std::vector<double> key;
  const auto add = [&key](const Eigen::Matrix4d& m) { key.insert(key.end(), m.data(), m.data() + 16); };
  add(s.tracker_from_sensor.matrix());
  if (s.tracker_from_body) add(s.tracker_from_body->matrix());
  if (s.camera_from_marker) add(s.camera_from_marker->matrix());
  double sum = 0;
  for (const auto& p : s.view.points_px) sum += p.x() + 1.7 * p.y();
  key.push_back(sum);
  return key;
}

PreparedStation without_picture(const HandEyeInput& in, std::size_t index) {
  const HandEyeStation& s = in.stations[index];
  PreparedStation out;
  out.index = index;
  out.corners.chain = {s.tracker_from_sensor, s.tracker_from_body.value_or(Transform<Tracker, TrackedBody>()),
                       s.sensor_motion, s.body_motion, s.tracker_from_body.has_value()};
  out.summed.chain = out.corners.chain;
  if (!s.camera_from_marker) return out;
  out.summed.camera_from_marker = *s.camera_from_marker;
  const auto square = [](double v) { return Eigen::Vector3d::Constant(v * v); };
  out.summed.view_covariance.diagonal() << square(in.view_noise.angle_sigma_rad),
      square(in.view_noise.position_sigma_mm);
  return out;
}

/// By the median error, which bad corners do not move: 1.1774 sigmas in the plane.
double corner_sigma(const std::vector<PreparedStation>& stations) {
  constexpr double kMedianSigmas = 1.1774;
  std::vector<double> errors;
  for (const PreparedStation& s : stations) {
    const auto sum = sum_corners(s.corners.corners, s.summed.camera_from_marker, 1);
    if (sum) errors.insert(errors.end(), sum->errors_px.begin(), sum->errors_px.end());
  }
  if (errors.empty()) return kLeastCornerSigmaPx;
  const double count = 2 * static_cast<double>(errors.size());
  const double for_fit = count / std::max(1.0, count - 6 * static_cast<double>(stations.size()));
  return std::max(kLeastCornerSigmaPx, median_of(std::move(errors)) / kMedianSigmas * std::sqrt(for_fit));
}

double least_distance(const PatternView& view) {
  double least = 0;
  for (std::size_t i = 1; i < view.points_in_marker_mm.size(); ++i) {
    const double d = (view.points_in_marker_mm[i] - view.points_in_marker_mm[i - 1]).norm();
    if (d > 0 && (least == 0 || d < least)) least = d;
  }
  return least;
}

/// Takes the corners from a view that lie too far from where the board's pose puts them; how many.
std::size_t drop_wrong_corners(const CameraModel& lens, const Transform<RightCamera, Camera>& lens_from_camera,
                               const Transform<Camera, Marker>& pose, double sigma_px, PatternView& view) {
  PatternView kept;
  for (std::size_t i = 0; i < view.points_px.size(); ++i) {
    const auto pixel = project(lens, lens_from_camera * (pose * view.points_in_marker_mm[i]));
    if (!pixel || (*pixel - view.points_px[i]).norm() > kWrongCornerSigmas * sigma_px) continue;
    kept.points_px.push_back(view.points_px[i]);
    kept.points_in_marker_mm.push_back(view.points_in_marker_mm[i]);
  }
  const std::size_t dropped = view.points_px.size() - kept.points_px.size();
  view = std::move(kept);
  return dropped;
}

/// Each picture's pose by its corners alone, twice: the second time with the sigma that the first tells, and without
/// the corners that are wrong by it.
void pose_views(const HandEyeInput& in, HandEyeStations& out) {
  constexpr double kFirstSigmaPx = 1;
  std::vector<PreparedStation> posed;
  for (PreparedStation& s : out.used) {
    const PatternView& view = out.views[s.index];
    if (view.points_px.empty()) {
      out.rejected.push_back({s.index, "the board is not seen"});
      continue;
    }
    s.corners.corners.push_back({&*in.camera, {}, &view});
    if (const PatternView& right = out.right_views[s.index]; !right.points_px.empty())
      s.corners.corners.push_back({&in.right->camera, in.right->right_from_camera, &right});
    const auto pose = find_view_pose(s.corners.corners, in.corner_sigma_px.value_or(kFirstSigmaPx));
    if (!pose) {
      out.rejected.push_back({s.index, pose.error().what});
      continue;
    }
    s.summed.camera_from_marker = pose->camera_from_marker;
    posed.push_back(std::move(s));
  }
  out.used = std::move(posed);
  out.corner_sigma_px = in.corner_sigma_px.value_or(corner_sigma(out.used));
  posed.clear();
  for (PreparedStation& s : out.used) {
    const auto& first = s.summed.camera_from_marker;
    s.corners_left_out = drop_wrong_corners(*in.camera, {}, first, out.corner_sigma_px, out.views[s.index]);
    if (s.corners.corners.size() > 1)
      s.corners_left_out += drop_wrong_corners(in.right->camera, in.right->right_from_camera, first,
                                               out.corner_sigma_px, out.right_views[s.index]);
    const auto pose = find_view_pose(s.corners.corners, out.corner_sigma_px);
    if (!pose) {
      out.rejected.push_back({s.index, pose.error().what});
      continue;
    }
    s.summed.camera_from_marker = pose->camera_from_marker;
    s.summed.view_covariance = out.corner_sigma_px * out.corner_sigma_px * pose->information.inverse();
    s.view_rms_px = pose->rms_px;
    posed.push_back(std::move(s));
  }
  out.used = std::move(posed);
  if (!out.used.empty()) out.square_mm = least_distance(out.views[out.used.front().index]);
}

/// Names the board's points alike in all pictures.
void turn_boards(const BoardSymmetry& symmetry, HandEyeStations& out) {
  std::vector<SummedStation> summed;
  for (const PreparedStation& s : out.used) summed.push_back(s.summed);
  const std::vector<int> turns = resolve_symmetry(summed, symmetry);
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (turns[i] == 0) continue;
    PreparedStation& s = out.used[i];
    const Transform<Marker, Marker> turn = symmetry.turned(turns[i]);
    // The origin lies elsewhere now, at the end of an arm from the old one, and moves with the board's turns.
    Matrix6d arm = Matrix6d::Identity();
    arm.bottomLeftCorner<3, 3>() = -cross_matrix(s.summed.camera_from_marker.rotation() * turn.translation());
    s.summed.view_covariance = arm * s.summed.view_covariance * arm.transpose();
    s.summed.camera_from_marker = s.summed.camera_from_marker * turn;
    for (PatternView* view : {&out.views[s.index], &out.right_views[s.index]}) {
      for (Eigen::Vector3d& p : view->points_in_marker_mm) p = turn.inverse() * p;
    }
  }
}

void drop_repeats(const HandEyeInput& in, HandEyeStations& out) {
  std::vector<SummedStation> summed;
  std::vector<std::string> names;
  for (const PreparedStation& s : out.used) {
    summed.push_back(s.summed);
    names.push_back(in.stations[s.index].name);
  }
  const std::vector<std::string> why = find_repeats(summed, names);
  std::vector<PreparedStation> kept;
  for (std::size_t i = 0; i < out.used.size(); ++i) {
    if (why[i].empty()) {
      kept.push_back(std::move(out.used[i]));
    } else {
      out.rejected.push_back({out.used[i].index, why[i]});
    }
  }
  out.used = std::move(kept);
}

}  // namespace

std::vector<SummedStation> summed_of(const std::vector<PreparedStation>& stations) {
  std::vector<SummedStation> summed;
  summed.reserve(stations.size());
  for (const PreparedStation& s : stations) summed.push_back(s.summed);
  return summed;
}

Result<void> check_stations(const HandEyeInput& in) {
  if (in.stations.empty()) return Error{Errc::bad_value, "no stations: give pictures of the board with tracked poses"};
  const HandEyeStation& first = in.stations.front();
  for (const HandEyeStation& s : in.stations) {
    if (s.tracker_from_body.has_value() != first.tracker_from_body.has_value())
      return Error{Errc::bad_value, fmt::format("station {}: of {} the board is tracked, of the other it is not: give "
                                                "a pose of the board with each station, or with none",
                                                s.name, first.name)};
    if (s.camera_from_marker.has_value() != first.camera_from_marker.has_value())
      return Error{Errc::bad_value,
                   fmt::format("stations {} and {}: one holds corners, the other a camera's pose", first.name, s.name)};
    for (const PatternView* v : {&s.view, s.right_view ? &*s.right_view : &s.view}) {
      if (v->points_px.size() != v->points_in_marker_mm.size())
        return Error{Errc::bad_value, fmt::format("station {}: {} corners seen, {} on the board", s.name,
                                                  v->points_px.size(), v->points_in_marker_mm.size())};
    }
    if (s.right_view && !in.right) return Error{Errc::bad_value, "a second lens's corners, and no second lens"};
  }
  if (first.camera_from_marker) return {};
  if (!in.camera) return Error{Errc::bad_value, "corners without a camera: calibrate it first"};
  if (in.right) {
    if (auto sound = check(in.right->camera); !sound) return sound;
  }
  return check(*in.camera);
}

HandEyeStations prepare_stations(const HandEyeInput& in) {
  HandEyeStations out;
  std::vector<std::pair<std::vector<double>, std::size_t>> order;
  for (std::size_t i = 0; i < in.stations.size(); ++i) {
    const HandEyeStation& s = in.stations[i];
    const std::string fault = fault_of(s);
    if (fault.empty()) {
      order.emplace_back(key_of(s), i);
    } else {
      out.rejected.push_back({i, fault});
    }
    out.views.push_back(sorted_by_place(s.view));
    out.right_views.push_back(s.right_view ? sorted_by_place(*s.right_view) : PatternView{});
  }
  std::sort(order.begin(), order.end());
  for (const auto& [key, index] : order) out.used.push_back(without_picture(in, index));
  if (!in.stations.front().camera_from_marker) pose_views(in, out);
  if (in.symmetry) turn_boards(*in.symmetry, out);
  drop_repeats(in, out);
  return out;
}

}  // namespace birdseye::calibration
