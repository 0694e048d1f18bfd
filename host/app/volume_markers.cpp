#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/files/write_files.hpp"
#include "host/report/slice_picture.hpp"
#include "host/volume/import.hpp"
#include "host/volume/marker_finder.hpp"
#include "host/volume/marker_near.hpp"
#include "host/volume/post_finder.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

struct VolumeMarkersOptions {
  VolumeSource source;
  std::filesystem::path out, picture, json;
  std::optional<MarkerKind> kind;
  double diameter_mm = 0, hole_mm = 0, height_mm = 0;
  std::vector<std::string> near;
  std::optional<int> threshold_hu;
};

constexpr double kLeastShown_mm = 8;  // of the CT round a marker, in the picture: three times as much
const std::map<std::string, MarkerKind> kKinds{{name_of(MarkerKind::ball), MarkerKind::ball},
                                               {name_of(MarkerKind::ring), MarkerKind::ring},
                                               {name_of(MarkerKind::cylinder), MarkerKind::cylinder},
                                               {name_of(MarkerKind::post), MarkerKind::post}};

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

struct Findings {
  FoundMarkers found;
  std::string verdict;
  std::vector<std::string> reasons;
  std::vector<std::string> of_picks;  ///< of each place that was pointed at, what is there
};

std::string place_text(const Vector3d& v) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", v.x(), v.y(), v.z());
}

Findings search_whole(const Volume& ct, const VolumeMarkersOptions& options, const MarkerShape& shape) {
  MarkerSearch search{shape, std::nullopt};
  if (options.threshold_hu) search.threshold_hu = static_cast<std::int16_t>(*options.threshold_hu);
  Findings out;
  out.found = find_markers(ct, search);
  const std::size_t n = out.found.markers.size();
  out.reasons.push_back(fmt::format("{} marker{} found", n, n == 1 ? "" : "s"));
  for (const DoubtfulMarker& d : out.found.doubtful)
    out.reasons.push_back(
        fmt::format("what looks like a marker at {} {}", place_text(d.centre_in_patient_mm), d.reason));
  if (n < 3) {
    out.reasons.push_back(
        fmt::format("a registration needs three: are shape and size right? {} thing{} of about the size passed over; "
                    "point at a marker that was missed by --near",
                    out.found.passed_over, out.found.passed_over == 1 ? "" : "s"));
    const std::size_t posts = shape.kind == MarkerKind::post ? 0 : find_hollow_posts(ct, {}).markers.size();
    if (posts > 0) out.reasons.push_back(fmt::format("hollow posts are seen ({}): find them by --shape post", posts));
    out.verdict = "fail";
    return out;
  }
  if (n < 5) out.reasons.emplace_back("with five or more a wrong touch can be named");
  out.verdict = out.found.doubtful.empty() ? "pass" : "marginal";
  return out;
}

Result<Vector3d> parse_place(const std::string& text) {
  std::istringstream in(text);
  Vector3d place;
  char comma = ',';
  for (int axis = 0; axis < 3; ++axis) {
    if ((axis > 0 && !(in >> comma)) || comma != ',' || !(in >> place[axis]) || !std::isfinite(place[axis]))
      return Error{Errc::bad_value, fmt::format("--near: '{}' is no place; give X,Y,Z, patient LPS mm", text)};
  }
  if (in >> comma) return Error{Errc::bad_value, fmt::format("--near: '{}' has more than X,Y,Z", text)};
  return place;
}

/// Of each place the marker nearest to it, in the order of the places, which that of the touches may be.
Result<Findings> search_near(const Volume& ct, const std::vector<Vector3d>& places,
                             const std::optional<MarkerShape>& shape) {
  Findings out;
  out.verdict = "pass";
  for (const Vector3d& place : places) {
    const auto fit = find_marker_near(ct, place, shape);
    if (!fit && fit.error().code != Errc::not_found) return fit.error().with_context("--near");
    std::string what = fit ? "" : fit.error().what;
    if (fit) {
      const auto again = std::find_if(out.found.markers.begin(), out.found.markers.end(), [&](const MarkerFit& other) {
        return (other.centre_in_patient_mm - fit->centre_in_patient_mm).norm() < 0.5 * fit->diameter_mm;
      });
      if (again != out.found.markers.end()) {
        what = fmt::format("{} is nearest to the same marker as a place before it: leave one out", place_text(place));
      } else {
        out.found.markers.push_back(*fit);
        out.of_picks.push_back(
            fmt::format("{:.1f} mm from {}", (fit->centre_in_patient_mm - place).norm(), place_text(place)));
      }
    }
    if (what.empty()) continue;
    out.verdict = "fail";
    out.reasons.push_back(what);
  }
  out.reasons.insert(out.reasons.begin(),
                     fmt::format("{} of {} places have a marker", out.found.markers.size(), places.size()));
  return out;
}

nlohmann::json place_json(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

nlohmann::json marker_json(const MarkerFit& m) {
  nlohmann::json json{{"kind", name_of(m.kind)},      {"centre_mm", place_json(m.centre_in_patient_mm)},
                      {"sigma_mm", m.sigma_mm},       {"within_95_mm", kSigmasOf95 * m.sigma_mm},
                      {"diameter_mm", m.diameter_mm}, {"hu", m.hu},
                      {"contrast_hu", m.contrast_hu}};
  if (m.kind != MarkerKind::post) json["explained"] = m.explained;
  if (m.kind == MarkerKind::ring || m.kind == MarkerKind::cylinder) json["axis"] = place_json(m.axis);
  return json;
}

Result<void> write_findings(const VolumeMarkersOptions& options, const Volume& ct, const Findings& findings) {
  const FoundMarkers& found = findings.found;
  nlohmann::json json;
  json["markers"] = json["doubtful"] = nlohmann::json::array();
  std::string points = "# marker centres, patient LPS, mm\n";
  double widest_mm = 0;
  for (const MarkerFit& m : found.markers) {
    const Vector3d& c = m.centre_in_patient_mm;
    points += fmt::format("{:.4f} {:.4f} {:.4f}\n", c.x(), c.y(), c.z());
    json["markers"].push_back(marker_json(m));
    widest_mm = std::max(widest_mm, m.diameter_mm);
  }
  for (const DoubtfulMarker& d : found.doubtful)
    json["doubtful"].push_back({{"centre_mm", place_json(d.centre_in_patient_mm)}, {"reason", d.reason}});
  if (options.near.empty()) json["passed_over"] = found.passed_over;
  json["verdict"] = findings.verdict;
  json["reasons"] = findings.reasons;
  std::string png;
  if (!options.picture.empty()) {
    const Picture picture =
        picture_of(ct, found, std::max({widest_mm, options.diameter_mm, options.height_mm, kLeastShown_mm}));
    png = png_of(picture.view());
  }
  return write_files({{options.out, points}, {options.picture, std::move(png)}, {options.json, text_of(json)}});
}

Result<ExitCode> volume_markers(const VolumeMarkersOptions& options) {
  if (options.out.empty()) return Error{Errc::bad_value, "--out: is empty; name the file to write"};
  std::optional<MarkerShape> shape;
  if (options.kind) {
    shape = MarkerShape{*options.kind, options.diameter_mm, options.hole_mm, options.height_mm};
    if (auto sound = check(*shape); !sound) return sound.error().with_context("--shape");
  } else if (options.near.empty()) {
    return Error{Errc::bad_value,
                 "--shape: is missing; give ball, ring, cylinder or post, or point at markers by --near"};
  }
  std::vector<Vector3d> places;
  for (const std::string& text : options.near) {
    const auto place = parse_place(text);
    if (!place) return place.error();
    places.push_back(*place);
  }
  const auto imported = import_with_notes(options.source);
  if (!imported) return imported.error();
  print_notes(imported->notes);
  const Volume& ct = imported->volume;
  Findings findings;
  if (places.empty()) {
    findings = search_whole(ct, options, *shape);
  } else {
    auto near = search_near(ct, places, shape);
    if (!near) return near.error();
    findings = *std::move(near);
  }
  if (auto written = write_findings(options, ct, findings); !written) return written.error();
  for (std::size_t i = 0; i < findings.found.markers.size(); ++i) {
    const MarkerFit& m = findings.found.markers[i];
    const Vector3d& c = m.centre_in_patient_mm;
    fmt::print("marker {:2}  ({:8.2f}, {:8.2f}, {:8.2f}) mm +- {:.2f}  {} {:.1f} mm across, {:.0f} HU{}{}\n", i + 1,
               c.x(), c.y(), c.z(), kSigmasOf95 * m.sigma_mm, name_of(m.kind), m.diameter_mm, m.hu,
               options.near.empty() ? "" : ", ", options.near.empty() ? "" : findings.of_picks[i]);
  }
  for (const std::string& reason : findings.reasons) fmt::print("{}\n", reason);
  fmt::print("verdict: {}\n", findings.verdict);
  return findings.verdict == "fail" ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_volume_markers(CLI::App& volume, CommandStatus& status) {
  const auto options = std::make_shared<VolumeMarkersOptions>();
  CLI::App& markers = *volume.add_subcommand("markers", "the centres of fiducial markers in a CT");
  markers.add_option("path", options->source.path, "the CT")->required();
  add_ct_options(markers, options->source);
  markers
      .add_option("--shape", options->kind, "ball, ring, cylinder (hollow) or post (a cavity in a wall, on a stalk)")
      ->transform(CLI::CheckedTransformer(kKinds, CLI::ignore_case));
  markers.add_option("--diameter", options->diameter_mm, "from outside to outside, mm; of posts any if it is left out");
  markers.add_option("--hole", options->hole_mm, "of a ring or cylinder: the hole's diameter, mm");
  markers.add_option("--height", options->height_mm, "of a cylinder, mm");
  markers
      .add_option("--threshold", options->threshold_hu, "HU that the markers exceed (default: 300, 700, 1500 in turn)")
      ->check(CLI::Range(-1000, 30000));
  markers
      .add_option("--near", options->near,
                  "X,Y,Z: fit the marker nearest to this place (patient LPS, mm; at most 10 mm off), of any kind if "
                  "there is no --shape; once for each marker")
      ->allow_extra_args(false);
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
