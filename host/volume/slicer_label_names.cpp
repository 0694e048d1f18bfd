#include "host/volume/slicer_label_names.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "host/dicom/refused.hpp"
#include "host/volume/header_fields.hpp"

namespace birdseye::host {

namespace {

std::optional<int> number_in(std::string_view text) {
  int number = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size()) return std::nullopt;
  return number;
}

/// What the file says of a segment, by names in small letters: "name", "labelvalue", "layer".
using Segment = std::map<std::string, std::string>;

/// The pairs "Segment<number>_<name>:=<value>", by number.
std::map<int, Segment> segments_in(const HeaderFields& fields) {
  constexpr std::string_view kSegment = "segment";
  std::map<int, Segment> segments;
  for (const auto& [name, value] : fields) {
    const auto line = name.find('_');
    if (!name.starts_with(kSegment) || line == std::string::npos || !value.starts_with('=')) continue;
    const auto number = number_in(std::string_view(name).substr(kSegment.size(), line - kSegment.size()));
    if (number) segments[*number][name.substr(line + 1)] = without_blanks(std::string_view(value).substr(1));
  }
  return segments;
}

}  // namespace

Result<std::vector<NamedLabel>> slicer_label_names(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string first(4, '\0');
  file.read(first.data(), static_cast<std::streamsize>(first.size()));
  std::vector<NamedLabel> names;
  if (first != "NRRD") return names;
  const auto segments = segments_in(nrrd_fields(file));
  names.reserve(segments.size());
  for (const auto& [which, segment] : segments) {
    const auto said = [&segment = segment](const char* what) {
      const auto found = segment.find(what);
      return found == segment.end() ? std::string() : found->second;
    };
    if (const std::string layer = said("layer"); !layer.empty() && layer != "0") {
      return refused(Errc::unsupported, path,
                     "has segments that overlap, in several layers; export it from 3D Slicer as a DICOM segmentation, "
                     "or the segments that do not overlap as one file");
    }
    const auto value = number_in(said("labelvalue"));
    const std::string name = said("name");
    if (!value || name.empty()) {
      return refused(Errc::bad_format, path,
                     fmt::format("segment {} has no {}; save it again by 3D Slicer 4.11 or later", which,
                                 value ? "name (SegmentN_Name)" : "value of its voxels (SegmentN_LabelValue)"));
    }
    const auto same =
        std::find_if(names.begin(), names.end(), [&value](const NamedLabel& other) { return other.number == *value; });
    if (same == names.end()) {
      names.push_back({*value, name, {*value}});
    } else if (same->name != name) {
      return refused(
          Errc::bad_format, path,
          fmt::format("calls label {} both '{}' and '{}'; save it again by 3D Slicer", *value, same->name, name));
    }
  }
  return names;
}

}  // namespace birdseye::host
