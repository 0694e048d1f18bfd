#include "host/dicom/series.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include "host/dicom/phase_words.hpp"
#include "host/dicom/slice_volumes.hpp"

namespace birdseye::host {

namespace {

using Files = std::vector<const DicomFile*>;

std::string slice_name(const DicomFile& file, const DicomSlice& slice) {
  const std::string name = file.path.filename().string();
  return file.slices.size() > 1 ? fmt::format("frame {} of {}", slice.frame + 1, name) : name;
}

SeriesInfo info_of(const Files& files) {
  const DicomFile& first = *files.front();
  SeriesInfo info;
  info.uid = first.series_uid;
  info.modality = first.modality;
  info.description = first.description;
  info.date = first.date;
  info.time = first.time;
  info.agent = first.agent;
  info.syntax = first.syntax;
  return info;
}

/// A series of files that are no slices, or one of which has a fault.
Series without_volume(const Files& files) {
  Series series;
  series.info = info_of(files);
  const DicomFile& first = *files.front();
  if (first.kind == DicomFile::Kind::labels) {
    series.info.problem = "a segmentation, no CT; give it as --labels";
  } else if (first.kind == DicomFile::Kind::no_image) {
    series.info.problem = fmt::format("no image ({})", first.what);
  }
  // Pictures of a screen, as dose reports, are of modality CT too.
  series.info.passed_over =
      first.kind != DicomFile::Kind::slices || first.modality != "CT" || first.localizer || !first.of_ct_class;
  std::int64_t frames = 0;
  for (const DicomFile* file : files) frames += file->frames;
  constexpr std::int64_t kMost = std::numeric_limits<int>::max();
  series.info.size = {first.columns, first.rows, static_cast<int>(std::min(frames, kMost))};
  const auto bad = std::find_if(files.begin(), files.end(), [](const DicomFile* file) { return !file->fault.empty(); });
  if (bad != files.end()) {
    series.bad = (*bad)->path;
    series.fault = (*bad)->fault;
    series.info.problem = fmt::format("{} {}", (*bad)->path.filename().string(), (*bad)->fault);
  }
  return series;
}

void describe(const DicomSlice& slice, SeriesInfo& info) {
  if (!slice.key(SliceKey::description).empty()) info.description = slice.key(SliceKey::description);
  for (const std::string& text :
       {slice.key(SliceKey::contrast_phase), info.description, slice.key(SliceKey::comments)}) {
    if (info.phase.empty()) info.phase = phase_named_in(text);
  }
}

/// What is wrong with slices of several frames of reference; empty where they are of one, or do not say.
std::string several_frames(const std::vector<DicomSlice>& slices, const std::vector<DicomFile>& all) {
  std::set<std::string> frames;
  for (const DicomSlice& slice : slices) {
    if (const std::string& uid = all[slice.file].frame_of_reference_uid; !uid.empty()) frames.insert(uid);
  }
  if (frames.size() < 2) return {};
  return fmt::format(
      "its slices are of {} frames of reference (0020,0052), as {} and {}, and how these lie to each other no file "
      "says: "
      "the patient may have moved between them; give a folder with the slices of one, or, where an "
      "anonymiser wrote them, export it again",
      frames.size(), *frames.begin(), *std::next(frames.begin()));
}

Series of_volume(const Files& files, const std::vector<DicomFile>& all, SliceVolume volume, bool untilt) {
  Series series;
  const DicomSlice first = volume.slices.front();
  series.info = info_of(files);
  series.info.part = std::move(volume.part);
  describe(first, series.info);
  series.stack = stack_slices(std::move(volume.slices),
                              [&all](const DicomSlice& slice) { return slice_name(all[slice.file], slice); });
  if (std::string several = several_frames(series.stack.slices, all); !several.empty()) {
    series.stack.problem = std::move(several);
    series.stack.usual_step_mm = 0;  // which no resampling mends
  }
  const auto count = static_cast<int>(series.stack.slices.size());
  series.info.size = {first.columns, first.rows, count};
  series.info.spacing_mm = {first.spacing_mm.x(), first.spacing_mm.y(), series.stack.step_mm};
  series.info.axes << first.row, first.column, first.row.cross(first.column).normalized();
  const bool localizer = all[first.file].localizer;
  const auto& slices = series.stack.slices;
  const Eigen::Vector3d whole = slices.back().position_mm - slices.front().position_mm;
  const bool at_one_place = count > 2 && std::abs(whole.dot(series.info.axes.col(2))) < 0.01;
  series.info.problem = why_no_volume(series.stack, untilt);
  if (count == 1) series.info.problem = "one slice";
  if (at_one_place) series.info.problem = "all its slices lie at one place, as when a bolus is watched";
  if (localizer) series.info.problem = "a localizer";
  series.info.passed_over = localizer || at_one_place;
  return series;
}

/// Whether two files are the same, byte for byte.
bool are_alike(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code error;
  if (std::filesystem::file_size(a, error) != std::filesystem::file_size(b, error) || error) return false;
  std::ifstream of_a(a, std::ios::binary), of_b(b, std::ios::binary);
  return of_a && of_b && std::equal(std::istreambuf_iterator<char>(of_a), {}, std::istreambuf_iterator<char>(of_b), {});
}

/// Without the files that lie in another folder too, as where an export was copied into itself, and without those that
/// are the same as another of their folder. Two of one folder that differ stay, and are named as lying at the same
/// place.
Files without_copies(const Files& files, std::vector<std::filesystem::path>& copies) {
  std::map<std::string, Files> known;
  Files once;
  for (const DicomFile* file : files) {
    Files& alike = known[file->instance_uid];
    const bool copy = !file->instance_uid.empty() && std::any_of(alike.begin(), alike.end(), [&](const DicomFile* one) {
      return one->path.parent_path() != file->path.parent_path() || are_alike(one->path, file->path);
    });
    if (copy) {
      copies.push_back(file->path);
      continue;
    }
    alike.push_back(file);
    once.push_back(file);
  }
  return once;
}

/// Of the slices that files of one series hold. A localizer that lies in a series is no slice of its volume.
void add_volumes(const Files& files, const std::vector<DicomFile>& all, bool untilt, std::vector<Series>& out) {
  std::vector<DicomSlice> slices, localizers;
  for (const DicomFile* file : files) {
    auto& to = file->localizer ? localizers : slices;
    for (DicomSlice slice : file->slices) {
      slice.file = static_cast<std::size_t>(file - all.data());
      to.push_back(std::move(slice));
    }
  }
  std::vector<Series> volumes;
  for (const auto& some : {slices, localizers}) {
    if (some.empty()) continue;
    for (SliceVolume& volume : part_into_volumes(some))
      volumes.push_back(of_volume(files, all, std::move(volume), untilt));
  }
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    if (volumes.size() > 1) volumes[i].info.id = fmt::format(".{}", i + 1);
    out.push_back(std::move(volumes[i]));
  }
}

std::string number_of(const DicomFile& file) {
  return file.series_number ? fmt::format("{}", *file.series_number) : "none";
}

/// A number for people: that of the series; with a letter where several series have it, as those of several studies do.
std::string id_of(const std::string& base, int before, int count) {
  if (count == 1) return base;
  return before < 26 ? fmt::format("{}{}", base, static_cast<char>('a' + before))
                     : fmt::format("{}-{}", base, before + 1);
}

}  // namespace

std::vector<Series> sort_into_series(const std::vector<DicomFile>& files, bool untilt) {
  std::map<std::pair<int, std::string>, Files> sorted;
  for (const DicomFile& file : files) {
    if (file.kind == DicomFile::Kind::directory) continue;
    // Without identifiers, as some anonymisers leave files, those of a folder belong together.
    const std::string uid = file.series_uid.empty() ? file.path.parent_path().string() : file.series_uid;
    sorted[{file.series_number.value_or(std::numeric_limits<int>::max()), uid}].push_back(&file);
  }
  std::vector<Series> out;
  std::map<std::string, int> used, count;
  for (const auto& [key, of_series] : sorted) ++count[number_of(*of_series.front())];
  for (const auto& [key, of_series] : sorted) {
    const std::string number = number_of(*of_series.front());
    const std::string id = id_of(number, used[number]++, count[number]);
    const bool whole = std::all_of(of_series.begin(), of_series.end(),
                                   [](const DicomFile* file) { return !file->slices.empty() && file->fault.empty(); });
    const std::size_t had = out.size();
    if (whole) {
      std::vector<std::filesystem::path> copies;
      add_volumes(without_copies(of_series, copies), files, untilt, out);
      for (std::size_t i = had; i < out.size(); ++i) out[i].copies = copies;
    } else {
      out.push_back(without_volume(of_series));
    }
    for (std::size_t i = had; i < out.size(); ++i) out[i].info.id.insert(0, id);
  }
  return out;
}

void blame_neighbours(std::vector<Series>& series, const std::vector<DicomFile>& files,
                      const std::filesystem::path& unreadable, const std::string& why) {
  for (Series& one : series) {
    const bool beside = std::any_of(one.stack.slices.begin(), one.stack.slices.end(), [&](const DicomSlice& slice) {
      return files[slice.file].path.parent_path() == unreadable.parent_path();
    });
    if (!beside || one.info.passed_over || !one.bad.empty()) continue;
    one.bad = unreadable;
    one.fault = why;
    one.info.problem = fmt::format("{} {}", unreadable.filename().string(), why);
  }
}

}  // namespace birdseye::host
