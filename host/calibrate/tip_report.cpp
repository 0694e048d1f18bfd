#include "host/calibrate/tip_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/calibrate/tip_pictures.hpp"

namespace birdseye::host {

namespace {

using calibration::Pivot;

nlohmann::json vector_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

nlohmann::json vectors_json(const std::vector<Eigen::Vector3d>& points) {
  nlohmann::json out = nlohmann::json::array();
  for (const Eigen::Vector3d& point : points) out.push_back(vector_json(point));
  return out;
}

nlohmann::json names_of(const std::vector<std::size_t>& indices, const std::vector<TimedPose>& poses) {
  nlohmann::json out = nlohmann::json::array();
  for (const std::size_t i : indices) out.push_back(poses[i].name);
  return out;
}

/// "frame 8: INVALID" as name and reason.
nlohmann::json rejected_poses_json(const PoseSet& set) {
  nlohmann::json out = nlohmann::json::array();
  for (const std::string& text : set.rejected) {
    const auto colon = std::min(text.size(), text.find(": "));
    out.push_back({{"name", text.substr(0, colon)}, {"reason", text.substr(std::min(text.size(), colon + 2))}});
  }
  return out;
}

nlohmann::json fit_json(const calibration::PivotFit& fit) {
  return {{"tip_in_sensor_mm", vector_json(fit.tip_in_sensor_mm)},
          {"pivot_in_tracker_mm", vector_json(fit.pivots_in_tracker_mm[0])},
          {"pivots_in_tracker_mm", vectors_json(fit.pivots_in_tracker_mm)},
          {"rms_mm", fit.rms_mm},
          {"component_rms_mm", fit.component_rms_mm}};
}

void add_pivot(const Pivot& pivot, const TipInput& input, nlohmann::json& out) {
  out.update(fit_json(pivot.robust));
  out["algebraic"] = fit_json(pivot.algebraic);
  out["outliers"] = names_of(pivot.outliers, input.set.poses);
  if (std::isfinite(pivot.tip_sigma_mm)) {
    nlohmann::json covariance = nlohmann::json::array();
    for (int i = 0; i < 3; ++i) covariance.push_back(vector_json(Eigen::Vector3d(pivot.tip_covariance_mm2.row(i))));
    out["sigma"] = {
        {"tip_mm", vector_json(Eigen::Vector3d(pivot.tip_covariance_mm2.diagonal().cwiseMax(0).cwiseSqrt()))},
        {"worst_mm", pivot.tip_sigma_mm},
        {"tip_covariance_mm2", covariance}};
  }
  out["held_out_mm"] = pivot.held_out_mm;
  out["tilt_deg"] = pivot.tilt.widest_deg;
  out["weakest"] = {{"direction_in_sensor", vector_json(pivot.tilt.weakest_in_sensor)},
                    {"swing_deg", pivot.tilt.weakest_swing_deg}};
  out["slid"] = {{"mm", pivot.slid_mm}, {"sigma_mm", pivot.slid_sigma_mm}, {"divot", pivot.slid_divot + 1}};
  out["residuals"] = nlohmann::json::array();
  for (std::size_t i = 0; i < input.poses.size(); ++i) {
    out["residuals"].push_back(
        {{"name", input.set.poses[i].name}, {"divot", input.poses[i].divot + 1}, {"mm", pivot.residuals_mm[i]}});
  }
}

std::vector<std::vector<std::string>> figures_table(const Pivot& pivot) {
  const auto row = [](const std::string& name, const calibration::PivotFit& fit) {
    return std::vector<std::string>{name, xyz_text(fit.tip_in_sensor_mm), xyz_text(fit.pivots_in_tracker_mm[0]),
                                    fmt::format("{:.3f}", fit.rms_mm), fmt::format("{:.3f}", fit.component_rms_mm)};
  };
  return {{"", "tip in the sensor's frame, mm", "pivot (the first), mm", "rms, mm", "rms of a coordinate, mm"},
          row("without outliers", pivot.robust),
          row("all poses, algebraic", pivot.algebraic)};
}

std::vector<std::vector<std::string>> odd_poses_table(const TipFound& found, const TipInput& input) {
  constexpr std::size_t kRows = 100;
  std::vector<std::vector<std::string>> rows{{"pose", "distance from the pivot, mm", ""}};
  for (const std::size_t i : found.pivot ? found.pivot->outliers : std::vector<std::size_t>{})
    rows.push_back({input.set.poses[i].name, fmt::format("{:.2f}", found.pivot->residuals_mm[i]), "outlier"});
  for (const std::string& text : input.set.rejected) {
    const auto colon = std::min(text.size(), text.find(": "));
    rows.push_back({text.substr(0, colon), "", "rejected" + text.substr(colon)});
  }
  if (rows.size() > kRows) {
    const std::size_t more = rows.size() - kRows;
    rows.resize(kRows);
    rows.push_back({fmt::format("and {} more", more), "", "in the JSON file"});
  }
  return rows;
}

}  // namespace

nlohmann::json tip_json(const TipFound& found, const TipInput& input) {
  nlohmann::json out{
      {"poses", input.poses.size()}, {"rejected", rejected_poses_json(input.set)}, {"notes", input.set.notes}};
  if (found.pivot) add_pivot(*found.pivot, input, out);
  if (found.axis) {
    out["axis"] = {{"axis_in_sensor", vector_json(found.axis->axis_in_sensor)},
                   {"sigma_deg", found.axis->sigma_deg},
                   {"wobble_deg", found.axis->wobble_deg},
                   {"turned_deg", found.axis->turned_deg},
                   {"outliers", names_of(found.axis->outliers, input.spin->poses)},
                   {"rejected", rejected_poses_json(*input.spin)}};
  }
  return out;
}

HtmlPage tip_page(const TipFound& found, const TipInput& input) {
  HtmlPage page("Pointer tip");
  for (const std::string& note : input.set.notes) page.paragraph(note);
  if (found.pivot) {
    page.table(figures_table(*found.pivot));
    page.heading("To which sides the pointer leaned");
    page.svg(
        tilt_coverage_svg(input.poses, *found.pivot),
        "Angle from the mean direction, as seen along it. Shaded: sides to which it leaned by less than 10 degrees.");
    page.heading("Where the sensor was");
    page.svg(
        tip_places_svg(input.poses, *found.pivot),
        "Place of the sensor at each pose about its divot, along the tracker's axes. A tip that stands still keeps "
        "it on the dashed sphere. The more of the sphere is covered, the better the tip is known. Red crosses: "
        "outliers.");
    page.heading("Where the tip was");
    page.svg(tip_cloud_svg(*found.pivot),
             "Place of the tip at each pose about its pivot, along the tracker's axes. Dashed: the root mean square "
             "distance. Red: outliers; hollow where they lie outside of the picture.");
    page.heading("How far from its pivot, pose by pose");
    page.svg(tip_residuals_svg(input.poses, *found.pivot),
             "A tip that slides shows as bars that grow or fall in time; a pose that is wrong as one red bar.");
  }
  if (found.axis) {
    page.heading("The shaft");
    page.paragraph(
        fmt::format("Axis of the spin in the sensor's frame {}, standard error {:.2f} degrees, by {} poses "
                    "turned through {:.0f} degrees.",
                    xyz_text(found.axis->axis_in_sensor, 4), found.axis->sigma_deg, found.axis->residuals_deg.size(),
                    found.axis->turned_deg));
  }
  if (const auto rows = odd_poses_table(found, input); rows.size() > 1) {
    page.heading("Poses that were not used");
    page.table(rows);
  }
  return page;
}

std::string tip_text(const TipFound& found) {
  if (!found.pivot) return {};
  const Eigen::Vector3d& tip = found.pivot->robust.tip_in_sensor_mm;
  std::string text = fmt::format(
      "# a pointer's tip in the frame of its sensor, mm: x y z\n# verdict {}, {}, held-out error {:.3f} mm "
      "rms\n{:.17g} {:.17g} {:.17g}\n",
      name_of(found.verdict.grade), tip_sigma_text(*found.pivot), found.pivot->held_out_mm, tip.x(), tip.y(), tip.z());
  if (!found.axis) return text;
  const Eigen::Vector3d& axis = found.axis->axis_in_sensor;
  return text + fmt::format("# its shaft, towards the tip: {:.17g} {:.17g} {:.17g} (standard error {:.3f} degrees)\n",
                            axis.x(), axis.y(), axis.z(), found.axis->sigma_deg);
}

std::string tip_sigma_text(const Pivot& pivot) {
  return std::isfinite(pivot.tip_sigma_mm) ? fmt::format("standard error {:.3f} mm", pivot.tip_sigma_mm)
                                           : "no standard error: the poses leave a direction open";
}

std::string xyz_text(const Eigen::Vector3d& v, int digits) {
  return fmt::format("({1:.{0}f}, {2:.{0}f}, {3:.{0}f})", digits, v.x(), v.y(), v.z());
}

}  // namespace birdseye::host
