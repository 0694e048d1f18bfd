#include "host/calibrate/camera_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "calibration/base/units.hpp"
#include "host/calibrate/lens_picture.hpp"
#include "host/calibrate/picture_views.hpp"
#include "host/calibrate/residual_picture.hpp"
#include "host/calibrate/station_picture.hpp"
#include "host/report/bar_chart.hpp"
#include "host/report/line_plot.hpp"

namespace birdseye::host {

namespace {

using namespace calibration;

nlohmann::json named(const CameraVector& values) {
  nlohmann::json out;
  for (std::size_t i = 0; i < kCameraParameterNames.size(); ++i)
    out[kCameraParameterNames[i]] = values[static_cast<Eigen::Index>(i)];
  return out;
}

std::vector<std::vector<double>> matrix_rows(const Eigen::MatrixXd& matrix) {
  std::vector<std::vector<double>> out;
  for (const auto& row : matrix.rowwise()) out.emplace_back(row.begin(), row.end());
  return out;
}

nlohmann::json outliers_json(const CameraCalibration& c) {
  nlohmann::json out = nlohmann::json::array();
  for (const FittedPoint& p : c.points) {
    if (!p.outlier) continue;
    out.push_back({{"name", c.views[p.view].name}, {"id", p.id}, {"off_px", p.residual_px.norm()}});
  }
  return out;
}

void add_tables(HtmlPage& page, const CameraCalibration& c, const std::string& which) {
  page.heading(which + "lens");
  std::vector<std::vector<std::string>> rows{
      {"parameter", "value", "sigma", "of noise", "between views", "between models"}};
  const CameraVector values = parameters_of(c.camera), sigma = c.sigma(), noise = c.noise_sigma();
  for (std::size_t i = 0; i < kCameraParameterNames.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    rows.push_back({kCameraParameterNames[i], fmt::format("{:.6g}", values[k]), fmt::format("{:.2g}", sigma[k]),
                    fmt::format("{:.2g}", noise[k]), fmt::format("{:.2g}", c.sigma_between_views[k]),
                    fmt::format("{:.2g}", c.sigma_between_models[k])});
  }
  page.table(rows);
  page.heading(which + "lens models");
  page.paragraph(
      "Chosen is the one with the least held-out error, or a simpler one that is as good: a larger model always fits "
      "better what it was fitted to.");
  rows = {{"model", "fitted rms, px", "held out, px", "held out, mm", ""}};
  for (const LensModelFit& m : c.models) {
    rows.push_back({name_of(m.model), fmt::format("{:.4f}", m.rms_px), fmt::format("{:.4f}", m.held_out_px),
                    fmt::format("{:.4f}", m.held_out_mm),
                    m.folds              ? "rejected: folds inside the picture"
                    : m.model == c.model ? "chosen"
                                         : ""});
  }
  page.table(rows);
}

void add_views(HtmlPage& page, const CameraCalibration& c, const std::string& which) {
  page.heading(which + "views");
  std::vector<Bar> bars;
  std::vector<std::vector<std::string>> rows{
      {"view", "points", "outliers", "rms, px", "held out, px", "tilt, degrees", "distance, mm", ""}};
  for (const FittedView& v : c.views) {
    bars.push_back({v.name, v.held_out_px, 2 * v.held_out_px > 3 * c.held_out_px ? kRed : kBlue});
    rows.push_back({v.name, std::to_string(v.points), std::to_string(v.outliers), fmt::format("{:.3f}", v.rms_px),
                    fmt::format("{:.3f}", v.held_out_px), fmt::format("{:.0f}", v.tilt_deg),
                    fmt::format("{:.1f}", v.distance_mm), ""});
  }
  for (const RejectedView& v : c.rejected) rows.push_back({v.name, "", "", "", "", "", "", "rejected: " + v.reason});
  page.svg(bars_svg(bars, "held-out error, px (red: half as much again as the mean)"),
           "Each view with the lens of the others: only its pose is its own.");
  page.table(rows);
}

/// Each point of a view over its picture, where that can still be read.
void add_view_picture(HtmlPage& page, const CameraCalibration& c, std::size_t view, const std::string& what,
                      const std::vector<std::filesystem::path>& files) {
  std::vector<PixelResidual> residuals;
  for (const FittedPoint& p : c.points) {
    if (p.view == view) residuals.push_back({p.pixel_px, p.residual_px, p.outlier});
  }
  const std::string& name = c.views[view].name;
  page.svg(
      residual_picture_svg(residuals, c.camera.width_px, c.camera.height_px, 0, picture_of_view(files, name)),
      fmt::format("{}, {}: {:.2f} px held out. At each corner an arrow, from where the lens puts it towards where it "
                  "was seen.",
                  what, name, c.views[view].held_out_px));
}

/// The worst view and the one in the middle.
void add_view_pictures(HtmlPage& page, const CameraCalibration& c, const std::string& which,
                       const std::vector<std::filesystem::path>& files) {
  if (c.views.empty()) return;
  std::vector<std::size_t> order(c.views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return c.views[a].held_out_px > c.views[b].held_out_px; });
  page.heading(which + "what it leaves in single views");
  add_view_picture(page, c, order.front(), "The view that fits worst", files);
  if (order.size() > 2) add_view_picture(page, c, order[order.size() / 2], "A view of the middle", files);
}

void add_places(HtmlPage& page, const CameraCalibration& c, const std::string& which) {
  std::vector<StationMark> marks;
  for (const auto& camera_from_marker : c.camera_from_marker) marks.push_back({camera_from_marker});
  page.heading(which + "where the board was looked at from");
  page.svg(station_picture_svg(marks),
           "Tilted boards tell focal length from distance: marks should lie all round, out to 30 degrees and more, and "
           "ticks point different ways.");
}

void add_regions_to(HtmlPage& page, const CameraCalibration& c, const std::string& which) {
  page.heading(which + "regions");
  std::vector<PixelResidual> means;
  std::vector<std::vector<std::string>> rows{{"column, row", "points", "rms, px", "mean x, px", "mean y, px"}};
  for (const RegionResidual& r : c.regions) {
    if (r.count == 0) continue;
    means.push_back(
        {{(r.column + 0.5) * c.camera.width_px / c.columns, (r.row + 0.5) * c.camera.height_px / c.rows}, r.mean_px});
    rows.push_back({fmt::format("{}, {}", r.column + 1, r.row + 1), std::to_string(r.count),
                    fmt::format("{:.3f}", r.rms_px), fmt::format("{:+.3f}", r.mean_px.x()),
                    fmt::format("{:+.3f}", r.mean_px.y())});
  }
  page.svg(residual_picture_svg(means, c.camera.width_px, c.camera.height_px),
           "Mean residual of each region. Arrows that form a pattern are a lens that the model does not follow; arrows "
           "any way are noise.");
  page.table(rows);
}

}  // namespace

nlohmann::json rejected_json(const std::vector<RejectedView>& rejected) {
  nlohmann::json out = nlohmann::json::array();
  for (const RejectedView& v : rejected) out.push_back({{"name", v.name}, {"reason", v.reason}});
  return out;
}

nlohmann::json camera_json(const CameraCalibration& c) {
  const CameraModel& m = c.camera;
  nlohmann::json out{{"image_width_px", m.width_px},
                     {"image_height_px", m.height_px},
                     {"model", name_of(c.model)},
                     {"camera_matrix", {{m.fx_px, 0.0, m.cx_px}, {0.0, m.fy_px, m.cy_px}, {0.0, 0.0, 1.0}}},
                     {"distortion", {m.k1, m.k2, m.p1, m.p2, m.k3}},
                     {"sigma", named(c.sigma())},
                     {"sigma_of_noise", named(c.noise_sigma())},
                     {"sigma_between_views", named(c.sigma_between_views)},
                     {"sigma_between_models", named(c.sigma_between_models)},
                     {"covariance", matrix_rows(c.covariance)},
                     {"rms_px", c.rms_px},
                     {"held_out_px", c.held_out_px},
                     {"held_out_mm", c.held_out_mm},
                     {"noise_sigma_px", c.noise_sigma_px},
                     {"views_used", c.views.size()},
                     {"views_rejected", rejected_json(c.rejected)},
                     {"points", c.points.size()},
                     {"outliers", outliers_json(c)},
                     {"board_sag_mm", c.board_sag_mm},
                     {"coverage", c.coverage},
                     {"tilt_spread_deg", c.tilt_spread_deg},
                     {"distance_mm", {c.least_distance_mm, c.mean_distance_mm, c.largest_distance_mm}}};
  for (const FittedView& v : c.views) {
    out["views"].push_back({{"name", v.name},
                            {"points", v.points},
                            {"outliers", v.outliers},
                            {"rms_px", v.rms_px},
                            {"held_out_px", v.held_out_px},
                            {"tilt_deg", v.tilt_deg},
                            {"distance_mm", v.distance_mm}});
  }
  for (const LensModelFit& f : c.models) {
    out["models"].push_back({{"name", name_of(f.model)},
                             {"rms_px", f.rms_px},
                             {"held_out_px", f.held_out_px},
                             {"held_out_mm", f.held_out_mm},
                             {"folds", f.folds}});
  }
  for (const RegionResidual& r : c.regions) {
    out["regions"].push_back({{"column", r.column},
                              {"row", r.row},
                              {"points", r.count},
                              {"rms_px", r.rms_px},
                              {"mean_px", {r.mean_px.x(), r.mean_px.y()}}});
  }
  return out;
}

nlohmann::json stereo_json(const StereoCalibration& c) {
  const Eigen::Matrix<double, 6, 1> sigma = c.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  return {{"right_from_left", matrix_rows(c.right_from_left.matrix())},
          {"covariance", matrix_rows(c.covariance)},
          {"sigma_turn_deg", {sigma[0] * kDegPerRad, sigma[1] * kDegPerRad, sigma[2] * kDegPerRad}},
          {"sigma_shift_mm", {sigma[3], sigma[4], sigma[5]}},
          {"baseline_mm", c.baseline_mm},
          {"rms_px", c.rms_px},
          {"held_out_px", c.held_out_px},
          {"epipolar_rms_px", c.epipolar_rms_px},
          {"pairs_used", c.pairs.size()},
          {"pairs_rejected", rejected_json(c.rejected)}};
}

void add_camera_to(HtmlPage& page, const CameraCalibration& c, const std::vector<std::filesystem::path>& files,
                   const std::string& which) {
  page.paragraph(
      fmt::format("{}{} of {} points in {} views fitted to {:.3f} px rms; views that were held out to {:.3f} "
                  "px, which is {:.3f} mm at the boards' mean distance of {:.0f} mm.",
                  which, c.points.size() - c.outliers, c.points.size(), c.views.size(), c.rms_px, c.held_out_px,
                  c.held_out_mm, c.mean_distance_mm));
  page.heading(which + "what the fit leaves");
  std::vector<PixelResidual> residuals;
  std::vector<Eigen::Vector2d> points;
  for (const FittedPoint& p : c.points) {
    residuals.push_back({p.pixel_px, p.residual_px, p.outlier});
    points.push_back(p.pixel_px);
  }
  page.svg(residual_picture_svg(residuals, c.camera.width_px, c.camera.height_px),
           "Each point's residual, from where the lens puts it towards where it was seen; red: left out.");
  page.heading(which + "coverage");
  page.svg(coverage_picture_svg(points, c.camera.width_px, c.camera.height_px, c.columns, c.rows),
           "Points in each cell of the picture. Where there are none, the distortion is a guess.");
  page.heading(which + "what the lens does");
  page.svg(lens_picture_svg(c.camera), "Straight lines of the world, evenly spaced, as this lens shows them.");
  add_places(page, c, which);
  add_view_pictures(page, c, which, files);
  add_tables(page, c, which);
  add_views(page, c, which);
  add_regions_to(page, c, which);
  Panel panel{which + "convergence", "step", "rms, px", {{"rms", {}}}};
  for (std::size_t i = 0; i < c.convergence_px.size(); ++i)
    panel.curves[0].points.emplace_back(static_cast<double>(i), c.convergence_px[i]);
  page.svg(plot_svg({panel}, 1), "The last refinement, from the fit of the next simpler model.");
}

}  // namespace birdseye::host
