#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/confine/allowance.hpp"
#include "host/dicom/series_choice.hpp"
#include "host/volume/decode.hpp"
#include "host/volume/decode_slices.hpp"
#include "host/volume/untilt.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// What its slices say of themselves that does not fit, or does not tell Hounsfield units.
void note_doubts(const Series& series, std::vector<std::string>& notes) {
  const auto& slices = series.stack.slices;
  const DicomSlice& first = slices.front();
  if (!first.scaled) {
    notes.emplace_back(
        "its files do not say how its values are Hounsfield units (they lack Rescale Intercept or Slope, (0028,1052)): "
        "these are read as they are stored; compare air (-1000 HU) and water (0 HU) before you trust them");
  }
  // US is "unspecified", which GDCM and what stands on it writes into all that it writes.
  const auto other_unit = std::find_if(slices.begin(), slices.end(), [](const DicomSlice& slice) {
    return !slice.unit.empty() && slice.unit != "HU" && slice.unit != "US";
  });
  if (other_unit != slices.end()) {
    notes.push_back(fmt::format("its files say that its values are no Hounsfield units: Rescale Type (0028,1054) is {}",
                                other_unit->unit.substr(0, 16)));
  }
  if (slices.size() < 2 || first.between_mm == 0) return;
  const double step_mm = series.stack.step_mm, apart_mm = (slices[1].position_mm - first.position_mm).norm();
  const auto is_said = [&](double mm) { return std::abs(first.between_mm - mm) <= 0.02 * mm + 0.01; };
  if (is_said(step_mm) || is_said(apart_mm)) return;
  notes.push_back(fmt::format(
      "its files say two distances of its slices: {:.4g} mm by Spacing Between Slices (0018,0088), {:.4g} mm by "
      "their positions, which count",
      first.between_mm, step_mm));
}

/// What the reader of a volume should know that is not in it.
std::vector<std::string> notes_of(const DicomScan& scan, std::size_t chosen) {
  std::vector<std::string> notes;
  if (scan.series.size() > 1) notes.push_back(fmt::format("read series {}", series_name(scan.series[chosen].info)));
  for (std::size_t i = 0; i < scan.series.size(); ++i) {
    const SeriesInfo& info = scan.series[i].info;
    if (i != chosen && (info.passed_over || info.size[2] == 1))
      notes.push_back(fmt::format("passed over series {}: {}", series_name(info), info.problem));
  }
  if (const auto& copies = scan.series[chosen].copies; !copies.empty()) {
    notes.push_back(fmt::format("passed over {} cop{} of slices: {}{}", copies.size(), copies.size() == 1 ? "y" : "ies",
                                copies.front().filename().string(), copies.size() == 1 ? "" : " and others"));
  }
  note_doubts(scan.series[chosen], notes);
  for (const Error& unreadable : scan.tree.unreadable) notes.push_back(fmt::format("passed over {}", unreadable.what));
  return notes;
}

/// Whether a chosen series is a volume.
Result<void> check_volume(const fs::path& path, const DicomScan& scan, const Series& series, bool untilt) {
  if (!series.bad.empty()) return refused(Errc::bad_format, series.bad, series.fault);
  if (series.stack.slices.empty()) {
    return refused(Errc::unsupported, path,
                   fmt::format("series {}: {}", series_name(series.info), series.info.problem));
  }
  if (const std::string why = why_no_volume(series.stack, untilt); !why.empty())
    return refused(Errc::unsupported, path, why);
  const DicomSlice& first = series.stack.slices.front();
  for (const DicomSlice& slice : series.stack.slices) {
    if (slice.scaled == first.scaled) continue;
    return refused(Errc::bad_format, scan.tree.files[(slice.scaled ? first : slice).file].path,
                   "lacks Rescale Intercept or Slope (0028,1052), which other slices of its series have; export the "
                   "series again");
  }
  constexpr std::size_t kMostVoxels = std::size_t{1} << 32U;
  if (static_cast<std::size_t>(first.columns) * static_cast<std::size_t>(first.rows) * series.stack.slices.size() >
      kMostVoxels) {
    return refused(Errc::unsupported, path, "says it has over four thousand million voxels; give a smaller series");
  }
  return {};
}

Result<DicomScan> scan_file(const VolumeSource& source, const Announce& announce) {
  announce(source.path);
  auto file = read_dicom_file(source.path);
  if (!file) return file.error();
  if (file->kind == DicomFile::Kind::directory) {
    // By its name: what a file holds must not say what else its decoder may read.
    if (!stands_for_folder(source.path)) {
      return refused(Errc::unsupported, source.path,
                     "is the directory of a medium, and not named DICOMDIR; give the folder that holds the series");
    }
    VolumeSource folder = source;
    folder.path = source.path.has_parent_path() ? source.path.parent_path() : fs::path(".");
    return scan_dicom(folder, announce);
  }
  DicomScan scan;
  scan.tree.files.push_back(*std::move(file));
  scan.series = sort_into_series(scan.tree.files, source.untilt);
  return scan;
}

}  // namespace

Result<DicomScan> scan_dicom(const VolumeSource& source, const Announce& announce) {
  std::error_code error;
  if (!fs::is_directory(source.path, error)) return scan_file(source, announce);
  auto tree = read_dicom_tree(source.path, announce);
  if (!tree) return tree.error();
  if (tree->files.empty() && !tree->unreadable.empty()) return tree->unreadable.front();
  if (tree->files.empty()) {
    return refused(Errc::not_found, source.path,
                   "is empty or holds no DICOM file; give the folder that holds the series");
  }
  DicomScan scan;
  scan.tree = *std::move(tree);
  scan.series = sort_into_series(scan.tree.files, source.untilt);
  // A slice that is left out unseen may hold the tumour, so that no file beside slices is passed over.
  for (std::size_t i = 0; i < scan.tree.unreadable.size(); ++i)
    blame_neighbours(scan.series, scan.tree.files, scan.tree.unreadable_paths[i],
                     "is empty, damaged or no DICOM; copy the series again, or remove the file");
  return scan;
}

Result<ImageFile> decode_dicom(const VolumeSource& source, const Announce& announce, std::span<ProcessCopy> copies) {
  const auto scan = scan_dicom(source, announce);
  if (!scan) return scan.error();
  std::vector<SeriesInfo> infos;
  for (const Series& series : scan->series) infos.push_back(series.info);
  const auto chosen = choose_series(infos, source.series);
  if (!chosen) return chosen.error().with_context(source.path.string());
  const Series& series = scan->series[*chosen];
  announce(source.path);  // from here on it is no single file that takes its time
  if (auto sound = check_volume(source.path, *scan, series, source.untilt); !sound) return sound.error();
  const auto& slices = series.stack.slices;
  const bool compressed = scan->tree.files[slices.front().file].compressed;
  const PatientIdentity& patient = scan->tree.files[slices.front().file].patient;
  for (const DicomSlice& slice : slices) {
    const PatientIdentity& other = scan->tree.files[slice.file].patient;
    if (other.name != patient.name || other.id != patient.id) {
      return refused(Errc::bad_value, source.path,
                     fmt::format("holds slices of two patients, {} (ID {}) and {} (ID {}); give those of one",
                                 patient.name, patient.id, other.name, other.id));
    }
  }
  auto hu = decode_slices(scan->tree.files, slices, compressed ? copies : std::span<ProcessCopy>(), announce);
  if (!hu) return hu.error();
  announce(source.path);
  ImageFile image;
  image.size = series.info.size;
  image.spacing_mm = series.info.spacing_mm;
  image.origin_mm = slices.front().position_mm;
  image.axes = series.info.axes;
  image.hu = *std::move(hu);
  image.patient = patient;
  image.frame_of_reference_uid = scan->tree.files[slices.front().file].frame_of_reference_uid;
  image.series_uid = scan->tree.files[slices.front().file].series_uid;
  image.notes = notes_of(*scan, *chosen);
  if (source.untilt && series.stack.tilt_deg > 0) {
    const UntiltCost cost = untilt(series.stack, image);
    image.notes.push_back(fmt::format(
        "untilted by {:.1f} degrees: each slice was shifted in its plane by linear interpolation, which blurs "
        "it along the shift by {:.2f} mm (standard deviation; {:.2f} mm in the worst slice), and what lies "
        "outside of the slices is -1024 HU",
        series.stack.tilt_deg, cost.blur_mm, cost.worst_blur_mm));
    if (cost.worst_across_mm > 0) {
      image.notes.push_back(fmt::format(
          "slices at uneven distances were interpolated to {:.2f} mm, which blurs them along their normal by "
          "{:.2f} mm (standard deviation; {:.2f} mm in the worst)",
          image.spacing_mm.z(), cost.across_mm, cost.worst_across_mm));
    }
  }
  return image;
}

}  // namespace birdseye::host
