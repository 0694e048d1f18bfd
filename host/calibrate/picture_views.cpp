#include "host/calibrate/picture_views.hpp"

#include <fmt/format.h>
#include <strings.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>

#include "calibration/detect/detect.hpp"
#include "host/files/name_order.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

bool is_picture(const fs::path& path) {
  const std::string ending = path.extension().string();
  return std::ranges::any_of(std::array{".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"},
                             [&](const char* known) { return ::strcasecmp(ending.c_str(), known) == 0; });
}

Result<std::vector<fs::path>> pictures_of(const std::vector<fs::path>& images_or_folders) {
  std::vector<fs::path> pictures;
  for (const fs::path& path : images_or_folders) {
    std::error_code failure;
    if (!fs::is_directory(path, failure)) {
      if (!fs::exists(path, failure)) return Error{Errc::not_found, path.string() + ": no such file or folder"};
      pictures.push_back(path);
      continue;
    }
    for (fs::directory_iterator entry(path, failure), end; !failure && entry != end; entry.increment(failure)) {
      if (is_picture(entry->path())) pictures.push_back(entry->path());
    }
    if (failure) return Error{Errc::unreadable, path.string() + ": " + failure.message()};
  }
  if (pictures.empty()) return Error{Errc::not_found, "no pictures: give PNG or JPEG files, or a folder of them"};
  std::sort(pictures.begin(), pictures.end(),
            [](const fs::path& a, const fs::path& b) { return before_by_number(a.string(), b.string()); });
  return pictures;
}

struct Looked {
  int width_px = 0, height_px = 0;  // 0: not read
  calibration::Detection detection;
};

Looked look(const calibration::Pattern& pattern, const fs::path& path) {
  Looked looked;
  const cv::Mat grey = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
  if (grey.empty()) return looked;
  looked.width_px = grey.cols;
  looked.height_px = grey.rows;
  looked.detection = detect(pattern, {{grey.data, grey.total()}, grey.cols, grey.rows}, path.filename().string());
  return looked;
}

std::vector<Looked> look_at_all(const calibration::Pattern& pattern, const std::vector<fs::path>& pictures) {
  std::vector<Looked> looked(pictures.size());
  tbb::parallel_for(std::size_t{0}, looked.size(), [&](std::size_t i) { looked[i] = look(pattern, pictures[i]); });
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

}  // namespace

Result<PictureViews> read_picture_views(const calibration::Pattern& pattern,
                                        const std::vector<fs::path>& images_or_folders) {
  const auto pictures = pictures_of(images_or_folders);
  if (!pictures) return pictures.error();
  std::vector<Looked> looked = look_at_all(pattern, *pictures);
  PictureViews views;
  if (has_other_layout(looked)) {
    calibration::Pattern other = pattern;
    other.legacy = !pattern.legacy;
    looked = look_at_all(other, *pictures);
    views.note = fmt::format("the board's tags lie as in the {} layout: it was read as {}, {} :legacy",
                             other.legacy ? "old" : "new", pattern.spec, other.legacy ? "with" : "without");
  }
  std::string first;
  for (std::size_t i = 0; i < looked.size(); ++i) {
    const std::string name = (*pictures)[i].filename().string();
    Looked& one = looked[i];
    if (one.width_px == 0) {
      views.rejected.push_back({name, "cannot be read as a picture"});
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
    if (one.detection.view) {
      views.used.push_back(std::move(*one.detection.view));
    } else {
      views.rejected.push_back({name, one.detection.rejected});
    }
  }
  return views;
}

}  // namespace birdseye::host
