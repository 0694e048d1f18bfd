#include "host/calibrate/picture_views.hpp"

#include <fmt/format.h>
#include <strings.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "calibration/base/picture_size.hpp"
#include "calibration/detect/detect.hpp"
#include "calibration/picture/field_edge.hpp"
#include "host/files/name_order.hpp"
#include "host/files/name_pattern.hpp"
#include "host/files/picture.hpp"
#include "host/files/point_files.hpp"
#include "host/files/read_mat.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

bool is_picture(const fs::path& path) {
  const std::string ending = path.extension().string();
  return std::ranges::any_of(std::array{".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".ppm", ".pgm"},
                             [&](const char* known) { return ::strcasecmp(ending.c_str(), known) == 0; });
}

/// Frames in one file: a PLUS sequence or a film.
bool is_recording(const fs::path& path) {
  const std::string ending = path.extension().string();
  return std::ranges::any_of(std::array{".mha", ".mhd", ".nrrd", ".mp4", ".avi", ".mkv", ".mov"},
                             [&](const char* known) { return ::strcasecmp(ending.c_str(), known) == 0; });
}

Result<std::vector<fs::path>> pictures_of(const std::vector<fs::path>& images_or_folders) {
  std::vector<fs::path> pictures;
  for (const fs::path& path : images_or_folders) {
    std::error_code failure;
    if (!fs::exists(path, failure) && is_pattern(path.filename().string())) {
      const auto found =
          files_matching(path.has_parent_path() ? path.parent_path() : fs::path("."), path.filename().string());
      if (!found) return found.error();
      if (found->empty()) return Error{Errc::not_found, path.string() + ": no file matches"};
      pictures.insert(pictures.end(), found->begin(), found->end());
      continue;
    }
    if (!fs::is_directory(path, failure)) {
      if (!fs::exists(path, failure)) return Error{Errc::not_found, path.string() + ": no such file or folder"};
      if (is_recording(path)) {
        return Error{
            Errc::unsupported,
            fmt::format("{}: is a recording, not a picture; give its frames as PNG files: `ffmpeg -i video.mp4 "
                        "-vf fps=1 frame%04d.png` of a film, 3D Slicer or PLUS' EditSequenceFile of a sequence",
                        path.string())};
      }
      pictures.push_back(path);
      continue;
    }
    for (fs::directory_iterator entry(path, failure), end; !failure && entry != end; entry.increment(failure)) {
      if (is_picture(entry->path())) pictures.push_back(entry->path());
    }
    if (failure) return Error{Errc::unreadable, path.string() + ": " + failure.message()};
  }
  if (pictures.empty())
    return Error{Errc::not_found, fmt::format("{}: no picture in it; give PNG, JPEG, BMP, TIFF, PPM or PGM files, or a "
                                              "folder of them",
                                              images_or_folders.empty() ? "" : images_or_folders.front().string())};
  std::sort(pictures.begin(), pictures.end(),
            [](const fs::path& a, const fs::path& b) { return before_by_number(a.string(), b.string()); });
  return pictures;
}

struct Looked {
  std::string unread;  // why; empty: it was read
  int width_px = 0, height_px = 0;
  calibration::Detection detection;
  std::optional<RoundField> round_field;
};

/// The picture as square pixels would show it: the axis along which pixels are longer gets more of them.
cv::Mat with_square_pixels(const cv::Mat& grey, double pixel_aspect) {
  if (pixel_aspect == 1) return grey;
  const double wider = std::max(1.0, pixel_aspect), taller = std::max(1.0, 1 / pixel_aspect);
  const cv::Size size(static_cast<int>(std::lround(wider * grey.cols)),
                      static_cast<int>(std::lround(taller * grey.rows)));
  cv::Mat out;
  cv::resize(grey, out, size, 0, 0, cv::INTER_CUBIC);
  return out;
}

/// Where points of the stretched picture are in the one it was made of: pixel centres are whole numbers in both.
void bring_back(const cv::Mat& stretched, const cv::Mat& grey, calibration::PatternView& view) {
  const Eigen::Array2d per_px(static_cast<double>(grey.cols) / stretched.cols,
                              static_cast<double>(grey.rows) / stretched.rows);
  for (Eigen::Vector2d& p : view.points_px) p = (p.array() + 0.5) * per_px - 0.5;
}

Looked look(const calibration::Pattern& pattern, const fs::path& path, double pixel_aspect) {
  Looked looked;
  const auto read = read_grey_mat(path);
  if (!read) {
    looked.unread = read.error().what;
    return looked;
  }
  const cv::Mat& grey = *read;
  looked.width_px = grey.cols;
  looked.height_px = grey.rows;
  if (grey.isContinuous())
    looked.round_field = calibration::find_round_field({{grey.data, grey.total()}, grey.cols, grey.rows});
  const cv::Mat square = with_square_pixels(grey, pixel_aspect);
  looked.detection =
      detect(pattern, {{square.data, square.total()}, square.cols, square.rows}, path.filename().string());
  if (looked.detection.view) bring_back(square, grey, *looked.detection.view);
  return looked;
}

std::vector<Looked> look_at_all(const calibration::Pattern& pattern, const std::vector<fs::path>& pictures,
                                double pixel_aspect) {
  std::vector<Looked> looked(pictures.size());
  tbb::parallel_for(std::size_t{0}, looked.size(),
                    [&](std::size_t i) { looked[i] = look(pattern, pictures[i], pixel_aspect); });
  return looked;
}

/// One picture may show no end of a row, which alone tells a board's layout.
bool has_other_layout(const std::vector<Looked>& looked) {
  calibration::LayoutEvidence all;
  for (const Looked& one : looked) {
    all.joined += one.detection.layout.joined;
    all.joined_in_other += one.detection.layout.joined_in_other;
  }
  return all.is_other();
}

/// What is to be said of an inset that no picture shows, though many show where it should be; empty where that is not
/// so.
std::string inset_note(const calibration::Pattern& pattern, const std::vector<Looked>& looked) {
  calibration::InsetEvidence all;
  for (const Looked& one : looked) {
    all.looked_for += one.detection.inset.looked_for;
    all.found += one.detection.inset.found;
  }
  if (!all.is_wrong()) return {};
  return fmt::format(
      "no corner of the inset is found in any picture, where {}x{} inner corners with squares of {:g} mm are said to "
      "lie "
      "in the board's middle: check :inset in --board; the rest of the board is used without it",
      pattern.inset_columns, pattern.inset_rows, pattern.inset_mm);
}

Error none_readable(const std::vector<PictureViews::Rejected>& rejected) {
  constexpr std::size_t kNamed = 5;
  std::string what;
  for (std::size_t i = 0; i < std::min(kNamed, rejected.size()); ++i)
    what += fmt::format("{}{} {}", i == 0 ? "" : "; ", rejected[i].name, rejected[i].reason);
  if (rejected.size() > kNamed) what += fmt::format("; nor can {} more", rejected.size() - kNamed);
  return {Errc::bad_format, fmt::format("no picture can be read, so copy them again: {}", what)};
}

/// Of a picture that lies beside the points.
Result<Eigen::Vector2i> size_beside(const fs::path& folder) {
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    if (!is_picture(at->path())) continue;
    if (const auto picture = read_picture(at->path())) return Eigen::Vector2i(picture->width_px, picture->height_px);
  }
  return Error{Errc::bad_value, folder.string() + ": no picture there tells its size: give --size WIDTHxHEIGHT"};
}

Result<Eigen::Vector2i> size_of(const std::string& text) {
  const auto size = parse_picture_size(text);
  if (!size) return Error{Errc::bad_value, fmt::format("--size {}: give it as 1920x1080", text)};
  return Eigen::Vector2i(size->width_px, size->height_px);
}

}  // namespace

Result<PictureViews> read_picture_views(const calibration::Pattern& pattern,
                                        const std::vector<fs::path>& images_or_folders, double pixel_aspect) {
  const auto pictures = pictures_of(images_or_folders);
  if (!pictures) return pictures.error();
  std::vector<Looked> looked = look_at_all(pattern, *pictures, pixel_aspect);
  PictureViews views;
  views.files = *pictures;
  if (has_other_layout(looked)) {
    calibration::Pattern other = pattern;
    other.legacy = !pattern.legacy;
    looked = look_at_all(other, *pictures, pixel_aspect);
    views.note = fmt::format("the board's tags lie as in the {} layout: it was read as {}, {} :legacy",
                             other.legacy ? "old" : "new", pattern.spec, other.legacy ? "with" : "without");
  }
  if (const std::string note = inset_note(pattern, looked); !note.empty())
    views.note += fmt::format("{}{}", views.note.empty() ? "" : "; ", note);
  std::string first;
  std::vector<RoundField> fields;
  for (std::size_t i = 0; i < looked.size(); ++i) {
    const std::string name = (*pictures)[i].filename().string();
    Looked& one = looked[i];
    if (!one.unread.empty()) {
      views.rejected.push_back({name, fmt::format("cannot be read as a picture: {}", one.unread)});
      continue;
    }
    if (first.empty()) {
      first = name;
      views.width_px = one.width_px;
      views.height_px = one.height_px;
    } else if (one.width_px != views.width_px || one.height_px != views.height_px) {
      return Error{Errc::bad_value,
                   fmt::format("{} is {}x{} px and {} is {}x{} px: give pictures of one camera mode", first,
                               views.width_px, views.height_px, name, one.width_px, one.height_px)};
    }
    if (one.round_field) fields.push_back(*one.round_field);
    if (one.detection.view) {
      views.used.push_back(std::move(*one.detection.view));
    } else {
      views.rejected.push_back({name, one.detection.rejected});
    }
  }
  if (first.empty()) return none_readable(views.rejected);
  views.round_field = calibration::agreed_round_field(fields, looked.size());
  return views;
}

Result<PictureViews> read_found_views(const fs::path& folder, const std::string& size) {
  auto views = read_point_views(folder);
  if (!views) return views.error();
  const auto px = size.empty() ? size_beside(folder) : size_of(size);
  if (!px) return px.error();
  return PictureViews{*std::move(views), {}, px->x(), px->y(), {}, {}, {}};
}

std::string picture_of_view(const std::vector<fs::path>& files, const std::string& view) {
  constexpr double kWide_px = 760;
  const auto of_view = [&](const fs::path& file) { return file.filename() == view; };
  if (std::ranges::count_if(files, of_view) != 1) return {};
  const auto picture = read_picture(*std::ranges::find_if(files, of_view));
  if (!picture) return {};
  return data_url(tile({&*picture, 1}, 1, std::min(1.0, kWide_px / picture->width_px)));
}

Result<double> parse_pixel_aspect(const std::string& text) {
  constexpr double kMost = 8;
  double width = 0, height = 1;
  char rest = 0;
  const bool ratio = std::sscanf(text.c_str(), "%lf:%lf%c", &width, &height, &rest) == 2;
  const bool number = !ratio && std::sscanf(text.c_str(), "%lf%c", &width, &rest) == 1;
  if (!ratio) height = 1;
  const double aspect = width / height;
  if ((ratio || number) && aspect >= 1 / kMost && aspect <= kMost) return aspect;
  return Error{Errc::bad_value,
               fmt::format("--pixel-aspect {}: give a pixel's width over its height, as 0.5 or 1:2", text)};
}

}  // namespace birdseye::host
