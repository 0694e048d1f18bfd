#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/app/commands.hpp"
#include "host/files/write_files.hpp"
#include "host/report/slice_picture.hpp"
#include "host/volume/import.hpp"
#include "host/volume/marker_finder.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

struct VolumeMarkersOptions {
  std::filesystem::path path, out, picture, json;
  MarkerKind kind = MarkerKind::ball;
  double diameter_mm = 0, hole_mm = 0, height_mm = 0;
  std::optional<int> threshold_hu;
};

constexpr Colour kFound{90, 255, 120}, kDoubtful{255, 90, 80}, kText{255, 255, 255};

/// Left the whole CT from the front, right every marker in two slices through its centre.
Picture picture_of(const Volume& ct, const FoundMarkers& found, double diameter_mm) {
  constexpr int kTile_px = 150, kOverview_px = 600, kPairs = 3;
  const Vector3d last(ct.size[0] - 1, ct.size[1] - 1, ct.size[2] - 1);
  const Vector3d centre = ct.patient_from_voxel * Vector3d(0.5 * last);
  const Vector3d extent = (ct.patient_from_voxel.linear() * last.asDiagonal()).cwiseAbs().rowwise().sum();
  const double wide_mm = std::max(extent.x(), extent.z()) * 1.05;
  const SlicePlane front = slice_plane(SliceKind::coronal, centre, wide_mm, kOverview_px, kOverview_px);
  Picture overview = draw_brightest(ct, front, 0.5 * extent.y(), -200, 2000);
  draw_text(overview, {8, 18}, "from the front, brightest in depth", kText);

  const auto count = static_cast<int>(found.markers.size() + found.doubtful.size());
  const int rows = std::max(1, (count + kPairs - 1) / kPairs);
  Picture out{kOverview_px + 2 * kPairs * kTile_px, std::max(kOverview_px, rows * kTile_px), {}};
  out.rgb.resize(static_cast<std::size_t>(out.width_px) * static_cast<std::size_t>(out.height_px) * 3);
  int cell = 0;
  const auto show = [&](const Vector3d& at, const std::string& name, double high_hu, const Colour& colour) {
    draw_cross_hair(overview, front.px_of(at), 10, colour);
    draw_text(overview, front.px_of(at) + Eigen::Vector2d(8, -6), name, colour);
    for (const SliceKind kind : {SliceKind::axial, SliceKind::coronal}) {
      const SlicePlane plane = slice_plane(kind, at, 3 * diameter_mm, kTile_px, kTile_px);
      Picture tile = draw_slice(ct, plane, -200, high_hu);
      draw_cross_hair(tile, plane.px_of(at), 40, colour);
      draw_text(tile, {6, 18}, name, colour);
      draw_text(tile, {6, kTile_px - 8}, kind == SliceKind::axial ? "axial" : "coronal", kText);
      const int column = 2 * (cell % kPairs) + (kind == SliceKind::coronal ? 1 : 0);
      paste(out, tile, kOverview_px + column * kTile_px, cell / kPairs * kTile_px);
    }
    ++cell;
  };
  for (std::size_t i = 0; i < found.markers.size(); ++i)
    show(found.markers[i].centre_in_patient_mm, std::to_string(i + 1), found.markers[i].hu, kFound);
  for (const DoubtfulMarker& d : found.doubtful) show(d.centre_in_patient_mm, "?", 2000, kDoubtful);
  paste(out, overview, 0, 0);
  return out;
}

std::pair<std::string, std::vector<std::string>> judge(const FoundMarkers& found) {
  const std::size_t n = found.markers.size();
  std::vector<std::string> reasons{fmt::format("{} marker{} found", n, n == 1 ? "" : "s")};
  for (const DoubtfulMarker& d : found.doubtful) {
    const Vector3d& c = d.centre_in_patient_mm;
    reasons.push_back(
        fmt::format("what looks like a marker at ({:.1f}, {:.1f}, {:.1f}) mm {}", c.x(), c.y(), c.z(), d.reason));
  }
  if (n < 3) {
    reasons.push_back(
        fmt::format("a registration needs three: are shape and size right? {} bright thing{} of about the "
                    "size passed over",
                    found.passed_over, found.passed_over == 1 ? "" : "s"));
    return {"fail", reasons};
  }
  if (n < 5) reasons.emplace_back("with five or more a wrong touch can be named");
  return {found.doubtful.empty() ? "pass" : "marginal", reasons};
}

nlohmann::json place_json(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

Result<ExitCode> volume_markers(const VolumeMarkersOptions& options) {
  if (options.out.empty()) return Error{Errc::bad_value, "--out: is empty; name the file to write"};
  const MarkerShape shape{options.kind, options.diameter_mm, options.hole_mm, options.height_mm};
  if (auto sound = check(shape); !sound) return sound.error().with_context("--shape");
  const auto ct = import_volume(options.path);
  if (!ct) return ct.error();
  MarkerSearch search{shape, std::nullopt};
  if (options.threshold_hu) search.threshold_hu = static_cast<std::int16_t>(*options.threshold_hu);
  const FoundMarkers found = find_markers(*ct, search);
  const auto [verdict, reasons] = judge(found);

  nlohmann::json json;
  json["markers"] = json["doubtful"] = nlohmann::json::array();
  std::string points = "# marker centres, patient LPS, mm\n";
  for (const MarkerFit& m : found.markers) {
    const Vector3d& c = m.centre_in_patient_mm;
    points += fmt::format("{:.4f} {:.4f} {:.4f}\n", c.x(), c.y(), c.z());
    json["markers"].push_back({{"centre_mm", place_json(c)},
                               {"diameter_mm", m.scale * shape.diameter_mm},
                               {"hu", m.hu},
                               {"contrast_hu", m.contrast_hu},
                               {"explained", m.explained}});
    if (shape.kind != MarkerKind::ball) json["markers"].back()["axis"] = place_json(m.axis);
  }
  for (const DoubtfulMarker& d : found.doubtful)
    json["doubtful"].push_back({{"centre_mm", place_json(d.centre_in_patient_mm)}, {"reason", d.reason}});
  json["passed_over"] = found.passed_over;
  json["verdict"] = verdict;
  json["reasons"] = reasons;
  std::string png;
  if (!options.picture.empty()) {
    const Picture picture = picture_of(*ct, found, shape.widest_mm());
    png = png_of(picture.view());
  }
  if (auto written =
          write_files({{options.out, points}, {options.picture, std::move(png)}, {options.json, text_of(json)}});
      !written)
    return written.error();
  for (std::size_t i = 0; i < found.markers.size(); ++i) {
    const MarkerFit& m = found.markers[i];
    const Vector3d& c = m.centre_in_patient_mm;
    fmt::print("marker {:2}  ({:8.2f}, {:8.2f}, {:8.2f}) mm  {:.1f} mm across, {:.0f} HU\n", i + 1, c.x(), c.y(), c.z(),
               m.scale * shape.diameter_mm, m.hu);
  }
  for (const std::string& reason : reasons) fmt::print("{}\n", reason);
  fmt::print("verdict: {}\n", verdict);
  return verdict == "fail" ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_volume_markers(CLI::App& volume, CommandStatus& status) {
  const auto options = std::make_shared<VolumeMarkersOptions>();
  CLI::App& markers = *volume.add_subcommand("markers", "the centres of fiducial markers in a CT");
  markers.add_option("path", options->path, "the CT")->required();
  const std::map<std::string, MarkerKind> kinds{
      {"ball", MarkerKind::ball}, {"ring", MarkerKind::ring}, {"cylinder", MarkerKind::cylinder}};
  markers.add_option("--shape", options->kind, "ball, ring or cylinder (hollow)")
      ->required()
      ->transform(CLI::CheckedTransformer(kinds, CLI::ignore_case));
  markers.add_option("--diameter", options->diameter_mm, "from outside to outside, mm")->required();
  markers.add_option("--hole", options->hole_mm, "of a ring or cylinder: the hole's diameter, mm");
  markers.add_option("--height", options->height_mm, "of a cylinder, mm");
  markers
      .add_option("--threshold", options->threshold_hu, "HU that the markers exceed (default: 300, 700, 1500 in turn)")
      ->check(CLI::Range(-1000, 30000));
  markers.add_option("--out", options->out, "centres to write, x y z a line, mm, as `register fiducials` reads")
      ->required();
  markers.add_option("--picture", options->picture, "a PNG of what was found");
  markers.add_option("--json", options->json, "write the figures to this file");
  markers.callback([options, &status] {
    const auto done = volume_markers(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
