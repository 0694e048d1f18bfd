#include "host/operation/patient.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/files/field_files.hpp"
#include "host/files/files_sha256.hpp"
#include "host/files/named_points.hpp"
#include "host/overlay/ct_sha256.hpp"
#include "host/simulated/simulated_patient.hpp"
#include "host/texts/texts.hpp"
#include "host/volume/import.hpp"
#include "host/volume/labels.hpp"
#include "host/volume/marker_finder.hpp"
#include "host/volume/post_finder.hpp"

namespace birdseye::host {

namespace {

/// The values of labels, or why not, naming the file. plan: gets the notes.
Result<std::vector<int>> values_in(const LabelVolume& labels, const PatientFiles& files,
                                   const std::vector<LabelChoice>& wanted, PatientPlan& plan) {
  return values_of_labels(labels.names, wanted, &plan.notes).with_context(files.labels.string());
}

Result<void> read_labels(const PatientFiles& files, PatientPlan& plan, const std::stop_token& stop) {
  const auto labels =
      import_named_labels(files.labels, plan.ct, all_of({files.shown, files.targets, files.organ}), stop);
  if (!labels) return labels.error();
  plan.notes.insert(plan.notes.end(), labels->notes.begin(), labels->notes.end());
  const Volume& volume = labels->volume;
  if (!files.shown.empty()) {
    const auto shown = values_in(*labels, files, files.shown, plan);
    if (!shown) return shown.error();
    auto kept = keep_labels(plan.ct, volume, *shown);
    if (!kept) return kept.error();
    plan.shown = *std::move(kept);
  }
  for (const LabelChoice& target : files.targets) {
    const auto values = values_in(*labels, files, {target}, plan);
    if (!values) return values.error();
    const auto centre = label_centroid_mm(volume, *values);
    if (!centre) return centre.error();
    plan.landmarks.push_back({words("label_name", target.text), *centre});
  }
  if (!files.margins_mm.empty()) {
    const auto targets = values_in(*labels, files, files.targets, plan);
    if (!targets) return targets.error();
    auto margins = margins_about(volume, *targets, files.margins_mm);
    if (!margins) return margins.error().with_context(files.labels.string());
    plan.margins = *std::move(margins);
  }
  auto organ = values_in(*labels, files, files.organ, plan);
  if (!organ) return organ.error();
  const auto of_organ = [&organ](std::int16_t label) {
    return std::find(organ->begin(), organ->end(), label) != organ->end();
  };
  if (std::none_of(volume.hu.begin(), volume.hu.end(), of_organ)) {
    return Error{Errc::not_found,
                 fmt::format("{}: --organ {}: the file holds none of these labels; give those of the organ",
                             files.labels.string(), joined(files.organ, ","))};
  }
  plan.labels = volume;
  plan.organ = *std::move(organ);
  return {};
}

}  // namespace

PatientFiles simulated_patient(const std::filesystem::path& folder) {
  PatientFiles files;
  files.ct = folder / "phantom" / "ct";
  files.labels = folder / "phantom" / "segmentation.nii.gz";
  files.shown.assign(SimulatedLabels::kShown.begin(), SimulatedLabels::kShown.end());
  files.targets = {SimulatedLabels::kTumour};
  files.organ.assign(SimulatedLabels::kOrgan.begin(), SimulatedLabels::kOrgan.end());
  return files;
}

Eigen::Vector3d middle_of_ct(const Volume& ct) {
  return ct.patient_from_voxel * Eigen::Vector3d(0.5 * Eigen::Vector3d(ct.size[0] - 1, ct.size[1] - 1, ct.size[2] - 1));
}

Eigen::Vector3d target_in_patient_mm(const PatientPlan& plan) {
  return plan.landmarks.empty() ? middle_of_ct(plan.ct) : plan.landmarks.front().place_mm;
}

Result<void> check_labels_named(const PatientFiles& files) {
  if (files.labels.empty() && !(files.shown.empty() && files.targets.empty() && files.organ.empty()))
    return Error{Errc::bad_value, "labels are named and no file of labels is given: give --labels"};
  if (!files.labels.empty() && files.organ.empty()) {
    return Error{Errc::bad_value, fmt::format("--labels {}: which of them are the organ that the video shows? Give "
                                              "--organ, as --organ 1,2,3",
                                              files.labels.string())};
  }
  if (!files.margins_mm.empty() && files.targets.empty())
    return Error{Errc::bad_value, "--margins: about what? Give --labels and --targets, the labels of the tumour"};
  return {};
}

Result<PatientPlan> read_patient(const PatientFiles& files, const std::stop_token& stop) {
  if (auto named = check_labels_named(files); !named) return named.error();
  PatientPlan plan;
  auto ct = import_body(files.ct, stop);
  if (!ct) return ct.error();
  plan.ct = std::move(ct->volume);
  plan.identity = std::move(ct->patient);
  plan.notes = std::move(ct->notes);
  plan.ct_sha256 = ct_sha256(plan.ct);
  plan.ct_stated = files.ct.stated;
  if (!files.labels.empty()) {
    if (auto read = read_labels(files, plan, stop); !read) return read.error();
    auto sum = files_sha256(files.labels);
    if (!sum) return sum.error();
    plan.labels_sha256 = *std::move(sum);
  }
  if (plan.shown.hu.empty()) plan.shown = plan.ct;
  if (!files.fiducials.empty()) {
    auto points = read_points(files.fiducials, PointsOf::patient);
    if (!points) return points.error();
    plan.fiducials_in_patient_mm = *std::move(points);
  }
  if (!files.landmarks.empty()) {
    const auto places = read_places(files.landmarks);
    if (!places) return places.error();
    for (const auto& [name, place] : *places) plan.landmarks.push_back({name, place});
  }
  return plan;
}

std::vector<Eigen::Vector3d> find_fiducials(const Volume& ct, const std::stop_token& stop) {
  constexpr std::size_t kFewest = 3;  // that a patient can be registered by
  std::vector<MarkerFit> markers = find_markers(ct, {}, stop).markers;
  if (markers.size() < kFewest && !stop.stop_requested()) {
    std::vector<MarkerFit> posts = find_hollow_posts(ct, post_search({MarkerKind::post, 0, 0, 0}), stop).markers;
    if (posts.size() > markers.size()) markers = std::move(posts);
  }
  std::vector<Eigen::Vector3d> places_mm;
  places_mm.reserve(markers.size());
  for (const MarkerFit& marker : markers) places_mm.push_back(marker.centre_in_patient_mm);
  return places_mm;
}

}  // namespace birdseye::host
