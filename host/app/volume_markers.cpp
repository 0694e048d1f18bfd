#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "calibration/base/verdict.hpp"
#include "drivers/system/program.hpp"
#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/case/marker_picture.hpp"
#include "host/files/write_files.hpp"
#include "host/report/html_page.hpp"
#include "host/volume/import.hpp"
#include "host/volume/marker_finder.hpp"
#include "host/volume/marker_near.hpp"
#include "host/volume/post_finder.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

struct VolumeMarkersOptions {
  VolumeSource source;
  std::filesystem::path out, picture, json, report;
  std::optional<MarkerKind> kind;
  double diameter_mm = 0, hole_mm = 0, height_mm = 0;
  std::vector<std::string> near;
  std::optional<int> threshold_hu;
};

constexpr double kLeastShown_mm = 8;  // of a marker, in the picture, which shows three times as much
const std::map<std::string, MarkerKind> kKinds{{name_of(MarkerKind::ball), MarkerKind::ball},
                                               {name_of(MarkerKind::ring), MarkerKind::ring},
                                               {name_of(MarkerKind::cylinder), MarkerKind::cylinder},
                                               {name_of(MarkerKind::post), MarkerKind::post}};

struct Findings {
  FoundMarkers found;
  Verdict verdict;
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
  out.verdict.reasons.push_back(fmt::format("{} marker{} found", n, n == 1 ? "" : "s"));
  for (const DoubtfulMarker& d : out.found.doubtful)
    out.verdict.reasons.push_back(
        fmt::format("what looks like a marker at {} {}", place_text(d.centre_in_patient_mm), d.reason));
  if (n < 3) {
    out.verdict.reasons.push_back(
        fmt::format("a registration needs three: are shape and size right? {} thing{} of about the size passed over; "
                    "point at a marker that was missed by --near",
                    out.found.passed_over, out.found.passed_over == 1 ? "" : "s"));
    if (const auto other = other_size(ct, search); other && other->count > static_cast<int>(n)) {
      out.verdict.reasons.push_back(
          fmt::format("{} {} of {:.4g} mm {} seen, and {} of {:.1f} mm: is --diameter {:.2g} "
                      "meant?",
                      n == 0 ? "no" : std::to_string(n), name_of(shape.kind), shape.diameter_mm, n > 1 ? "are" : "is",
                      other->count, other->diameter_mm, other->diameter_mm));
    }
    const std::size_t posts = shape.kind == MarkerKind::post ? 0 : find_hollow_posts(ct, {}).markers.size();
    if (posts > 0)
      out.verdict.reasons.push_back(fmt::format("hollow posts are seen ({}): find them by --shape post", posts));
    out.verdict.grade = Grade::fail;
    return out;
  }
  if (n < 5) out.verdict.reasons.emplace_back("with five or more a wrong touch can be named");
  out.verdict.grade = out.found.doubtful.empty() ? Grade::pass : Grade::marginal;
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
    out.verdict.grade = Grade::fail;
    out.verdict.reasons.push_back(what);
  }
  out.verdict.reasons.insert(out.verdict.reasons.begin(),
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

HtmlPage markers_page(const Findings& findings, const Picture& picture) {
  HtmlPage page("Markers in the CT");
  page.set_verdict(findings.verdict);
  page.picture(
      picture,
      "Left, all of the CT from the front; right, each marker in an axial, a coronal and a sagittal slice, the "
      "cross hair on the centre that was found. A cross hair that is off its marker is a wrong centre.");
  std::vector<std::vector<std::string>> rows{
      {"marker", "kind", "centre, patient LPS, mm", "95 % within, mm", "across, mm", "HU"}};
  for (std::size_t i = 0; i < findings.found.markers.size(); ++i) {
    const MarkerFit& m = findings.found.markers[i];
    const Vector3d& c = m.centre_in_patient_mm;
    rows.push_back({std::to_string(i + 1), name_of(m.kind), fmt::format("{:.2f}, {:.2f}, {:.2f}", c.x(), c.y(), c.z()),
                    fmt::format("{:.2f}", kSigmasOf95 * m.sigma_mm), fmt::format("{:.1f}", m.diameter_mm),
                    fmt::format("{:.0f}", m.hu)});
  }
  page.table(rows);
  return page;
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
  json["verdict"] = name_of(findings.verdict.grade);
  json["reasons"] = findings.verdict.reasons;
  std::vector<FileText> files{{options.out, points}, {options.json, text_of(json)}};
  if (!options.picture.empty() || !options.report.empty()) {
    const double shown_mm = 3 * std::max({widest_mm, options.diameter_mm, options.height_mm, kLeastShown_mm});
    const Picture picture = draw_markers(ct, found, shown_mm);
    files.push_back({options.picture, png_of(picture.view())});
    files.push_back({options.report, markers_page(findings, picture).html()});
  }
  return write_files(files);
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
  for (const std::string& reason : findings.verdict.reasons) print_line(reason);
  fmt::print("verdict: {}\n", name_of(findings.verdict.grade));
  return findings.verdict.grade == Grade::fail ? ExitCode::verdict_fail : ExitCode::success;
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
  markers.add_option("--picture", options->picture, "a PNG of what was found")->check(png_name);
  markers.add_option("--report", options->report, "a page with the figures and pictures (HTML)");
  markers.add_option("--json", options->json, "write the figures to this file");
  markers.callback([options, &status] {
    const auto done = volume_markers(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
