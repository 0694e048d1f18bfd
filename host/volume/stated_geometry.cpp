#include "host/volume/stated_geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <string_view>

#include "calibration/base/lower_case.hpp"

namespace birdseye::host {

namespace {

using Fields = std::map<std::string, std::string>;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// The lines "name<sign>value" at the begin of a file, names in small letters, up to a blank line or the field `last`.
Fields header_fields(std::istream& file, char sign, const std::string& last) {
  constexpr int kLongestHeader = 1 << 20;
  Fields fields;
  std::string line;
  for (int bytes = 0; bytes < kLongestHeader; bytes += static_cast<int>(line.size()) + 1) {
    line.clear();
    for (char c = 0; line.size() < kLongestHeader && file.get(c) && c != '\n';) line += c;
    if (trimmed(line).empty()) break;
    const auto at = line.find(sign);
    if (at == std::string::npos) continue;
    const std::string name = lower_case(std::string(trimmed(std::string_view(line).substr(0, at))));
    fields[name] = trimmed(std::string_view(line).substr(at + 1));
    if (name == last) break;
  }
  return fields;
}

std::string unstated_by_nrrd(const Fields& fields) {
  static constexpr std::array<std::string_view, 6> kSpaces = {
      "right-anterior-superior", "ras", "left-anterior-superior", "las", "left-posterior-superior", "lps"};
  const auto space = fields.find("space");
  if (space == fields.end())
    return "does not say which way its axes point (it has no \"space\", as left-posterior-superior); export it from "
           "a program that says so, as 3D Slicer";
  if (std::find(kSpaces.begin(), kSpaces.end(), lower_case(space->second)) == kSpaces.end())
    return fmt::format(
        "is in the space \"{}\", which says nothing of the patient; export it in left-posterior-superior",
        space->second.substr(0, 80));
  if (!fields.contains("space directions"))
    return "does not say how far apart its voxels are (it has no \"space directions\"); export it again";
  return {};
}

std::string unstated_by_meta_image(const Fields& fields) {
  const auto dimensions = fields.find("ndims");
  if (dimensions == fields.end() || dimensions->second.size() != 1 || dimensions->second < "1" ||
      dimensions->second > "9")
    return "does not say how many dimensions it has (NDims); export it again";
  if (!fields.contains("elementspacing") && !fields.contains("elementsize"))
    return "does not say how far apart its voxels are (it has no ElementSpacing); add the line, or export it again";
  return {};
}

}  // namespace

std::string unstated_geometry(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string first(4, '\0');
  file.read(first.data(), static_cast<std::streamsize>(first.size()));
  if (first == "NRRD") return unstated_by_nrrd(header_fields(file, ':', ""));
  const std::string ending = lower_case(path.extension().string());
  if (ending != ".mha" && ending != ".mhd") return {};
  file.clear();
  file.seekg(0);
  return unstated_by_meta_image(header_fields(file, '=', "elementdatafile"));
}

}  // namespace birdseye::host
