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
#include <optional>
#include <set>

#include "host/dicom/dicom_pixels.hpp"
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

/// Makes a file that is not as it should be a fault of the series.
void blame(Series& series, const std::filesystem::path& bad, const std::string& fault) {
  series.bad = bad;
  series.fault = fault;
  series.info.problem = fmt::format("{} {}", bad.filename().string(), fault);
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
  if (bad != files.end()) blame(series, (*bad)->path, (*bad)->fault);
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
  std::vector<char> block_a(std::size_t{1} << 16U), block_b(block_a.size());
  while (of_a && of_b) {
    of_a.read(block_a.data(), static_cast<std::streamsize>(block_a.size()));
    of_b.read(block_b.data(), static_cast<std::streamsize>(block_b.size()));
    if (of_a.gcount() != of_b.gcount() ||
        !std::equal(block_a.begin(), block_a.begin() + of_a.gcount(), block_b.begin()))
      return false;
  }
  return of_a.eof() && of_b.eof();
}

/// Whether two slices lie at the same place, as large. A program that copies files may write fewer digits.
bool lie_alike(const DicomSlice& a, const DicomSlice& b) {
  constexpr double kNear_mm = 1e-2, kNear = 1e-4;  ///< of places; of directions, and of a pixel's size in mm
  return a.columns == b.columns && a.rows == b.rows && (a.position_mm - b.position_mm).norm() < kNear_mm &&
         (a.row - b.row).norm() < kNear && (a.column - b.column).norm() < kNear &&
         (a.spacing_mm - b.spacing_mm).norm() < kNear;
}

/// The Hounsfield units of all frames of a file; none where one cannot be decoded.
std::optional<std::vector<std::int16_t>> hu_of(const DicomFile& file) {
  DicomPixels pixels;
  std::vector<std::int16_t> hu;
  for (const DicomSlice& slice : file.slices) {
    if (!pixels.append_hu(file.path, slice, hu)) return std::nullopt;
  }
  return hu;
}

/// Whether two files hold the same slices, however each stores them: a program that copies files may change their
/// headers, or compress them.
bool hold_the_same(const DicomFile& a, const DicomFile& b) {
  if (!std::equal(a.slices.begin(), a.slices.end(), b.slices.begin(), b.slices.end(), lie_alike)) return false;
  if (are_alike(a.path, b.path)) return true;
  const auto hu = hu_of(a);
  return hu && hu == hu_of(b);
}

/// The files of a series, each slice once.
struct FilesOnce {
  Files files;
  std::vector<std::filesystem::path> copies;  ///< that were left out
  std::filesystem::path odd;                  ///< one of two files of which nobody knows which is right; empty: none
  std::string fault;                          ///< of odd
};

/// Without the files that hold the same as another one of their SOP Instance UID, as where an export was copied into
/// itself. Two of one folder that differ stay, and are named as lying at the same place; of two folders, they are a
/// fault, for neither folder tells which of the two belongs to the series.
FilesOnce without_copies(const Files& files) {
  std::map<std::string, Files> known;
  FilesOnce out;
  for (const DicomFile* file : files) {
    Files& alike = known[file->instance_uid];
    const bool named = !file->instance_uid.empty();
    if (named &&
        std::any_of(alike.begin(), alike.end(), [&](const DicomFile* one) { return hold_the_same(*one, *file); })) {
      out.copies.push_back(file->path);
      continue;
    }
    const auto elsewhere = std::find_if(alike.begin(), alike.end(), [&](const DicomFile* one) {
      return one->path.parent_path() != file->path.parent_path();
    });
    if (named && elsewhere != alike.end() && out.odd.empty()) {
      out.odd = file->path;
      out.fault = fmt::format(
          "has the SOP Instance UID (0008,0018) of {}, and other pixels or another place; remove the one that does not "
          "belong to the series",
          (*elsewhere)->path.string());
    }
    alike.push_back(file);
    out.files.push_back(file);
  }
  return out;
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
      const FilesOnce once = without_copies(of_series);
      add_volumes(once.files, files, untilt, out);
      for (std::size_t i = had; i < out.size(); ++i) {
        out[i].copies = once.copies;
        if (!once.odd.empty()) blame(out[i], once.odd, once.fault);
      }
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
    blame(one, unreadable, why);
  }
}

}  // namespace birdseye::host
