#include "host/calibrate/hand_eye_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "host/calibrate/camera_report.hpp"
#include "host/calibrate/picture_views.hpp"
#include "host/calibrate/residual_picture.hpp"
#include "host/calibrate/station_picture.hpp"
#include "host/report/bar_chart.hpp"
#include "host/report/line_plot.hpp"

namespace birdseye::host {

namespace {

using calibration::HandEyeResult;
using calibration::HandEyeStart;
using calibration::HandEyeStationFit;
using nlohmann::json;

template <typename Matrix>
json rows_of(const Matrix& m) {
  json out = json::array();
  for (Eigen::Index r = 0; r < m.rows(); ++r) {
    json row = json::array();
    for (Eigen::Index c = 0; c < m.cols(); ++c) row.push_back(m(r, c));
    out.push_back(row);
  }
  return out;
}

json json_of(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

struct StartDistance {
  double shift_mm, turn_deg;
};

StartDistance distance_of(const HandEyeStart& start, const HandEyeResult& r) {
  return {(start.camera_from_sensor.translation() - r.camera_from_sensor.translation()).norm(),
          rotation_angle_between(start.camera_from_sensor.rotation(), r.camera_from_sensor.rotation()) * kDegPerRad};
}

bool has_pictures(const HandEyeResult& r) {
  return r.corner_sigma_px > 0;
}

json starts_json(const HandEyeResult& r) {
  json out = json::array();
  for (const HandEyeStart& start : r.starts) {
    json one{{"method", start.method}, {"usable", start.failed.empty()}};
    if (start.failed.empty()) {
      const StartDistance far = distance_of(start, r);
      one["camera_from_sensor"] = rows_of(start.camera_from_sensor.matrix());
      one[has_pictures(r) ? "score_px" : "score_mm"] = start.score;
      one["from_answer_mm"] = far.shift_mm;
      one["from_answer_deg"] = far.turn_deg;
    } else {
      one["reason"] = start.failed;
    }
    out.push_back(one);
  }
  return out;
}

json stations_json(const HandEyeResult& r) {
  json out = json::array();
  for (const HandEyeStationFit& s : r.stations) {
    json one{{"name", s.name}, {"used", s.used}};
    if (!s.why_not.empty()) one["reason"] = s.why_not;
    if (s.used || s.why_not.starts_with("outlier")) {
      one.update({{"held_out_mm", s.held_out_mm},
                  {"turn_off_deg", s.turn_off_deg},
                  {"shift_off_mm", s.shift_off_mm},
                  {"distance_squared", s.distance_squared}});
      if (has_pictures(r))
        one.update({{"view_rms_px", s.view_rms_px},
                    {"tracked_px", s.tracked_px},
                    {"held_out_px", s.held_out_px},
                    {"corners_left_out", s.corners_left_out}});
    }
    out.push_back(one);
  }
  return out;
}

json solution_json(const HandEyeResult& r) {
  json out{{"camera_from_sensor", rows_of(r.camera_from_sensor.matrix())},
           {"held_out_mm", r.held_out_mm},
           {"sigma",
            {{"rotation_deg", json_of(r.rotation_sigma_deg())},
             {"translation_mm", json_of(r.translation_sigma_mm())},
             {"covariance_rad_mm", rows_of(r.covariance)},
             {"region95_distance_squared", r.region_limit}}},
           {"sigma_at_board_mm", r.sigma_at_board_mm()},
           {"of_lens_at_board_mm", r.of_lens_at_board_mm},
           {"working_distance_mm", r.working_distance_mm},
           {"tracker_noise",
            {{"position_mm", r.tracker_noise.position_sigma_mm},
             {"angle_deg", r.tracker_noise.angle_sigma_rad * kDegPerRad},
             {"estimated", r.noise_estimated},
             {"variance_factor", r.variance_factor}}},
           {"outliers", r.outliers},
           {"start", r.start},
           {"starts", starts_json(r)}};
  if (has_pictures(r))
    out.update({{"rms_px", r.rms_px},
                {"tracked_px", r.tracked_px},
                {"held_out_px", r.held_out_px},
                {"held_out_median_px", r.held_out_median_px},
                {"corner_sigma_px", r.corner_sigma_px}});
  return out;
}

void add_station_table(const HandEyeResult& r, HtmlPage& page) {
  std::vector<std::vector<std::string>> rows{{"number", "station", "held out, mm", "turn off, deg", "shift off, mm"}};
  if (has_pictures(r))
    rows.front() = {"number",       "station",      "corners, px",   "tracked, px",
                    "held out, px", "held out, mm", "turn off, deg", "shift off, mm"};
  rows.front().emplace_back("");
  for (const HandEyeStationFit& s : r.stations) {
    std::vector<std::string> row{std::to_string(rows.size()), s.name};
    if (!s.why_not.starts_with("rejected")) {
      std::vector<double> figures{s.held_out_mm, s.turn_off_deg, s.shift_off_mm};
      if (has_pictures(r)) figures.insert(figures.begin(), {s.view_rms_px, s.tracked_px, s.held_out_px});
      for (const double figure : figures) row.push_back(fmt::format("{:.2f}", figure));
    }
    row.resize(rows.front().size());
    row.back() = s.why_not;
    rows.push_back(std::move(row));
  }
  page.table(rows);
}

/// The station used at which an overlay would be off by most, over its picture.
void add_worst_picture(const HandEyeResult& r, const HandEyeRecording& recording, HtmlPage& page) {
  const HandEyeStationFit* worst = nullptr;
  for (const HandEyeStationFit& s : r.stations) {
    if (s.used && !s.seen_px.empty() && (worst == nullptr || s.held_out_px > worst->held_out_px)) worst = &s;
  }
  if (worst == nullptr) return;
  std::vector<PixelResidual> residuals;
  for (std::size_t i = 0; i < worst->seen_px.size(); ++i)
    residuals.push_back({worst->seen_px[i], worst->seen_px[i] - worst->tracked_corner_px[i]});
  const CameraModel& camera = *recording.input.camera;
  page.svg(residual_picture_svg(residuals, camera.width_px, camera.height_px, 0,
                                picture_of_view(recording.picture_files, worst->name)),
           fmt::format("The station used that is off by most, {}: {:.1f} px. Each arrow is by how much an overlay "
                       "would be off there.",
                       worst->name, worst->held_out_px));
}

/// Of all points that were seen; the origin where poses took the place of pictures.
Eigen::Vector3d board_middle_mm(const HandEyeRecording& recording) {
  Eigen::Vector3d sum_mm = Eigen::Vector3d::Zero();
  double count = 0;
  for (const auto& station : recording.input.stations) {
    for (const Eigen::Vector3d& point_mm : station.view.points_in_marker_mm) {
      sum_mm += point_mm;
      ++count;
    }
  }
  return count > 0 ? Eigen::Vector3d(sum_mm / count) : sum_mm;
}

/// Where tracker and picture put a place of the board by one hand-eye, in the frame that the board rests in.
Eigen::Vector3d tracked_place_mm(const calibration::HandEyeStation& station, const HandEyeStationFit& fit,
                                 const Transform<Camera, Sensor>& camera_from_sensor,
                                 const Eigen::Vector3d& in_marker_mm) {
  const Eigen::Vector3d in_tracker_mm =
      station.tracker_from_sensor * (camera_from_sensor.inverse() * (fit.camera_from_marker * in_marker_mm));
  return station.tracker_from_body ? station.tracker_from_body->inverse() * in_tracker_mm : in_tracker_mm;
}

/// By how much, seen through the scope, each station's place of the board lies off the mean of them all.
Curve scatter_of(const std::string& name, const HandEyeResult& r, const HandEyeRecording& recording,
                 const Transform<Camera, Sensor>& camera_from_sensor) {
  const Eigen::Vector3d middle_mm = board_middle_mm(recording);
  std::vector<Eigen::Vector3d> places_mm;
  Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero();
  double used = 0;
  for (std::size_t i = 0; i < r.stations.size(); ++i) {
    places_mm.push_back(tracked_place_mm(recording.input.stations[i], r.stations[i], camera_from_sensor, middle_mm));
    if (!r.stations[i].used) continue;
    mean_mm += places_mm.back();
    ++used;
  }
  mean_mm /= std::max(used, 1.0);
  Curve curve{name, {}};
  for (std::size_t i = 0; i < r.stations.size(); ++i) {
    if (!r.stations[i].used) continue;
    const calibration::HandEyeStation& station = recording.input.stations[i];
    const Eigen::Vector3d off_mm = places_mm[i] - mean_mm;
    const Eigen::Matrix3d tracker_from_body =
        station.tracker_from_body ? station.tracker_from_body->rotation() : Eigen::Matrix3d::Identity();
    const Eigen::Vector3d in_camera_mm =
        camera_from_sensor.rotation() * station.tracker_from_sensor.rotation().transpose() * tracker_from_body * off_mm;
    const Eigen::Vector3d sight = (r.stations[i].camera_from_marker * middle_mm).normalized();
    curve.points.emplace_back(static_cast<double>(i + 1), (in_camera_mm - sight.dot(in_camera_mm) * sight).norm());
  }
  return curve;
}

/// Each station before and after the refinement.
void add_before_after(const HandEyeResult& r, const HandEyeRecording& recording, HtmlPage& page) {
  const auto start = std::ranges::find_if(
      r.starts, [&](const HandEyeStart& one) { return one.failed.empty() && one.method == r.start; });
  if (start == r.starts.end() || recording.input.stations.size() != r.stations.size()) return;
  page.svg(plot_svg({{"The board's middle by the tracker, off its mean as the scope sees it",
                      "station, in the order of the table",
                      "distance, mm",
                      {scatter_of("before: " + start->method, r, recording, start->camera_from_sensor),
                       scatter_of("after refining", r, recording, r.camera_from_sensor)}}},
                    1, {920, 280}),
           "The board is at one place. By a wrong hand-eye the tracker puts it elsewhere at each station; what is left "
           "after refining is the tracker's own error. Refining weighs all corners and turns, so that single stations "
           "may come out farther off.");
}

void add_pictures(const HandEyeResult& r, const HandEyeRecording& recording, HtmlPage& page) {
  std::vector<StationMark> marks;
  std::vector<Bar> bars;
  std::vector<PixelResidual> residuals;
  for (std::size_t n = 0; n < r.stations.size(); ++n) {
    const HandEyeStationFit& s = r.stations[n];
    const bool odd = s.why_not.starts_with("outlier");
    if (!s.used && !odd) continue;
    marks.push_back({s.camera_from_marker, odd, std::to_string(n + 1)});
    bars.push_back({s.name, s.held_out_mm, odd ? kRed : kBlue});
    for (std::size_t i = 0; i < s.seen_px.size(); ++i)
      residuals.push_back({s.seen_px[i], s.seen_px[i] - s.tracked_corner_px[i], odd});
  }
  page.heading("Where the scope looked from");
  page.svg(
      station_picture_svg(marks),
      "Spread marks and ticks that point different ways determine hand-eye; marks on one spot or line do not. Red: "
      "stations that were left out. Numbers are those of the table below.");
  page.heading("What overlay would be off by");
  if (!residuals.empty() && recording.input.camera)
    page.svg(residual_picture_svg(residuals, recording.input.camera->width_px, recording.input.camera->height_px),
             "Each corner, from where the tracker and the hand-eye of all the other stations put it to where it was "
             "seen. The arrows of one station point one way: that is the tracker's error at that moment.");
  if (!residuals.empty() && recording.input.camera) add_worst_picture(r, recording, page);
  constexpr std::size_t kMostBars = 60;
  const char* const caption =
      "Each station, with the hand-eye of all the others; of a stream, of those outside its own block of time.";
  if (bars.size() <= kMostBars) {
    page.svg(bars_svg(bars, "held-out error at the board, mm"), caption);
    return;
  }
  Curve curve{"held out", {}};
  for (std::size_t i = 0; i < bars.size(); ++i) curve.points.emplace_back(static_cast<double>(i + 1), bars[i].value);
  page.svg(plot_svg({{"Held-out error at the board", "station", "error, mm", {curve}}}, 1, {920, 260}), caption);
}

void add_convergence(const HandEyeResult& r, const HandEyeRecording& recording, HtmlPage& page) {
  page.heading("How it was found");
  std::vector<std::vector<std::string>> rows{
      {"closed form", has_pictures(r) ? "tracked, px" : "tracked, mm", "from the answer, mm", "deg", ""}};
  for (const HandEyeStart& start : r.starts) {
    if (!start.failed.empty()) {
      rows.push_back({start.method, "", "", "", start.failed});
      continue;
    }
    const StartDistance far = distance_of(start, r);
    rows.push_back({start.method, fmt::format("{:.2f}", start.score), fmt::format("{:.2f}", far.shift_mm),
                    fmt::format("{:.2f}", far.turn_deg), start.method == r.start ? "refined" : ""});
  }
  page.table(rows);
  add_before_after(r, recording, page);
  Curve cost{"cost", {}};
  for (std::size_t i = 0; i < r.cost_trace.size(); ++i)
    cost.points.emplace_back(static_cast<double>(i), r.cost_trace[i]);
  if (cost.points.size() > 1)
    page.svg(plot_svg({{"refinement", "iteration", "cost (half sum of squares, in sigmas)", {cost}}}, 1),
             "The cost of all corners and tracked poses together.");
}

}  // namespace

namespace {

std::size_t right_views_used(const HandEyeResult& r, const HandEyeRecording& recording) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < r.stations.size(); ++i)
    count += r.stations[i].used && recording.input.stations[i].right_view ? 1 : 0;
  return count;
}

json right_json(const HandEyeResult& r, const HandEyeRecording& recording) {
  const auto& right_from_left = recording.input.right->right_from_camera;
  return {{"camera_from_sensor", rows_of((right_from_left * r.camera_from_sensor).matrix())},
          {"right_from_left", rows_of(right_from_left.matrix())},
          {"baseline_mm", right_from_left.translation().norm()},
          {"views_used", right_views_used(r, recording)}};
}

}  // namespace

json hand_eye_json(const HandEyeResult& r, const HandEyeRecording& recording) {
  json out{{"stations_used", r.observability.stations - r.outliers.size()},
           {"turns_deg", json_of(r.observability.turns_deg)},
           {"turn_axes_in_sensor", rows_of(r.observability.axes_in_sensor)},
           {"stations", stations_json(r)},
           {"notes", recording.notes}};
  if (r.observability.board_scale > 0)
    out["scale_estimate"] = {{"value", r.observability.board_scale}, {"sigma", r.observability.board_scale_sigma}};
  if (r.solved) {
    out.update(solution_json(r));
    const bool moving = recording.input.stations.front().tracker_from_body.has_value();
    const Transform<Marker, Marker> as_given(Eigen::Matrix3d::Identity(), -recording.judged_at_mm);
    out[moving ? "tracked_body_from_pattern" : "tracker_from_pattern"] =
        rows_of((r.body_from_marker * as_given).matrix());
    if (recording.input.right) out["right"] = right_json(r, recording);
  }
  if (recording.lens) out["lens"] = camera_json(*recording.lens);
  if (!recording.judged_at_mm.isZero(0)) out["judged_at_mm"] = json_of(recording.judged_at_mm);
  if (recording.stream_correlation > 0) {
    out["clock_offset_ms"] = -1000 * (recording.stream_offset_s + r.time_offset_s.value_or(0));
    out["clock_offset_sigma_ms"] = 1000 * r.time_offset_sigma_s;
    out["clock_correlation"] = recording.stream_correlation;
  }
  return out;
}

HtmlPage hand_eye_page(const HandEyeResult& r, const HandEyeRecording& recording) {
  HtmlPage page("Hand-eye calibration");
  if (r.solved) {
    const Eigen::Vector3d t = r.camera_from_sensor.translation();
    page.paragraph(fmt::format(
        "The sensor lies at ({:.2f}, {:.2f}, {:.2f}) mm in the camera's frame, sigma "
        "({:.2f}, {:.2f}, {:.2f}) mm; sigma of the rotation ({:.3f}, {:.3f}, {:.3f}) degrees.",
        t.x(), t.y(), t.z(), r.translation_sigma_mm().x(), r.translation_sigma_mm().y(), r.translation_sigma_mm().z(),
        r.rotation_sigma_deg().x(), r.rotation_sigma_deg().y(), r.rotation_sigma_deg().z()));
    if (const auto& right = recording.input.right)
      page.paragraph(fmt::format("A stereo scope: {} of the stations hold the right camera's view too, {:.2f} mm away.",
                                 right_views_used(r, recording), right->right_from_camera.translation().norm()));
    add_pictures(r, recording, page);
  }
  page.heading("Stations");
  add_station_table(r, page);
  if (r.solved) add_convergence(r, recording, page);
  for (const std::string& note : recording.notes) page.paragraph(note);
  return page;
}

}  // namespace birdseye::host
