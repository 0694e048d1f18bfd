#include "host/volume/unread_form.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "calibration/base/lower_case.hpp"
#include "host/confine/allowance.hpp"
#include "host/volume/header_fields.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

std::string shown(const std::string& text) {
  return text.substr(0, 80);
}

template <std::size_t N>
bool is_one_of(const std::string& text, const std::array<std::string_view, N>& known) {
  return std::find(known.begin(), known.end(), text) != known.end();
}

/// The lines of a file from behind the one that begins with one of these names on, up to a blank one: names of files of
/// voxels.
std::vector<std::string> listed_files(const fs::path& path, std::initializer_list<std::string_view> last) {
  constexpr std::size_t kMostLines = 100'000;
  std::ifstream file(path, std::ios::binary);
  std::vector<std::string> names;
  bool behind = false;
  std::string line;
  for (std::size_t n = 0; n < kMostLines && std::getline(file, line); ++n) {
    const std::string_view text = without_blanks(line);
    if (behind && text.empty()) break;
    if (behind) names.emplace_back(text);
    behind =
        behind || std::ranges::any_of(last, [small = lower_case(text)](auto name) { return small.starts_with(name); });
  }
  return names;
}

/// Which of the files of voxels beside a header is not there, or lies in another folder, whose files the decoder may
/// not read; empty where all are beside it. pattern: the one name stands for many.
std::string missing_file(const fs::path& header, const std::vector<std::string>& names, bool pattern) {
  std::error_code error;
  for (const std::string& name : names) {
    if (fs::path(name).lexically_normal().has_parent_path()) {
      return fmt::format(
          "is a header whose voxels are in another folder (\"{}\"); put them beside it and give their names alone, or "
          "save it as one file",
          shown(name));
    }
    if (pattern || fs::is_regular_file(header.parent_path() / name, error)) continue;
    return fmt::format(
        "is a header whose voxels are in other files, of which \"{}\" is not there; copy them all, or save "
        "it as one file",
        shown(name));
  }
  return {};
}

/// Why a file may not keep its voxels in others: its name must say that it does, since its decoder may read those.
std::string not_named_header(const fs::path& path, const char* ending) {
  if (names_other_files(path)) return {};
  return fmt::format("keeps its voxels in other files, as only a header does: name it {}, or save it as one file",
                     ending);
}

/// Whether one of a NRRD's axes is that of the several values of a voxel, as of a displacement field's vectors.
bool has_several_values(const std::string& kinds) {
  std::istringstream words(kinds);
  for (std::string kind; words >> kind;) {
    if (kind != "domain" && kind != "space" && kind != "time" && kind != "???" && kind != "none") return true;
  }
  return false;
}

/// Which number of a NRRD's geometry is none, as "12abc", or beyond any that a volume has. Its reader takes what it can
/// of such: 12, or 1 without a word.
std::string odd_number(const HeaderFields& fields) {
  constexpr double kMost = 1e6;
  for (const char* name :
       {"sizes", "spacings", "thicknesses", "axis mins", "axis maxs", "space directions", "space origin"}) {
    std::string text = field_of(fields, name);
    std::ranges::replace_if(
        text, [](char c) { return std::string_view("(),").find(c) != std::string_view::npos; }, ' ');
    std::istringstream words(text);
    for (std::string word; words >> word;) {
      double number = 0;
      const char* const from = word.data() + (word.size() > 1 && word[0] == '+' ? 1 : 0);
      const auto [end, error] = std::from_chars(from, word.data() + word.size(), number);
      const bool whole = error == std::errc() && end == word.data() + word.size();
      if (lower_case(word) == "none" || lower_case(word) == "nan") continue;
      if (!whole || !(std::abs(number) <= kMost)) {
        return fmt::format(
            "says \"{}\" in its field \"{}\", which is no number that a volume can have; export it again", shown(word),
            name);
      }
    }
  }
  return {};
}

/// Whether a field is said, and with another number than this one.
bool is_other_than(const HeaderFields& fields, const char* name, double number) {
  const std::string said = field_of(fields, name);
  double value = 0;
  const char* const end = said.data() + said.size();
  const auto [rest, error] = std::from_chars(said.data() + (said.starts_with('+') ? 1 : 0), end, value);
  return !said.empty() && (error != std::errc() || rest != end || value != number);
}

std::string unread_nrrd(const fs::path& path, const HeaderFields& fields) {
  static constexpr std::array<std::string_view, 7> kEncodings = {"raw", "ascii", "txt", "text", "hex", "gzip", "gz"};
  static constexpr std::array<std::string_view, 4> kOneByte = {"uchar", "unsigned char", "uint8", "uint8_t"};
  const std::string encoding = lower_case(field_of(fields, "encoding")), type = lower_case(field_of(fields, "type"));
  for (const char* name : {"type", "dimension", "sizes", "encoding"}) {
    if (field_of(fields, name).empty())
      return fmt::format("lacks the field \"{}\" in its header; export it again", name);
  }
  if (std::string odd = odd_number(fields); !odd.empty()) return odd;
  const std::string dimension = field_of(fields, "dimension"), kinds = lower_case(field_of(fields, "kinds"));
  if (dimension < "3") return "is a picture, not a volume; give the whole stack";
  if (dimension > "4" || (dimension == "4" && !has_several_values(kinds)))
    return "has more than three dimensions; give one volume of it";
  if (!is_one_of(encoding, kEncodings)) {
    return fmt::format("has its voxels in the encoding \"{}\", which is not read; save it as gzip or raw",
                       shown(encoding));
  }
  if (type == "block" || type.find("long double") != std::string::npos)
    return fmt::format("has voxels of the type \"{}\", which is not read; save it as 16-bit integers", shown(type));
  for (const char* name : {"old min", "old max"}) {
    const std::string value = field_of(fields, name);
    if (type == "float" || type == "double" || value.empty() || lower_case(value) == "nan") continue;
    return fmt::format("has voxels that stand for other values (\"{}\" {}), which are not read; save it with these",
                       name, shown(value));
  }
  if (!field_of(fields, "spacings").empty() && !field_of(fields, "space directions").empty())
    return "has both \"spacings\" and \"space directions\", of which NRRD allows one; take the line of the spacings "
           "away";
  if (!field_of(fields, "spacings").empty() && !field_of(fields, "space").empty()) {
    return "has \"spacings\" beside its \"space\", where NRRD wants \"space directions\"; export it again by a program "
           "that writes these, as 3D Slicer";
  }
  if (encoding == "raw" && field_of(fields, "endian").empty() && !is_one_of(type, kOneByte))
    return "does not say in which order the bytes of its voxels come (it has no \"endian\"); export it again";
  const std::string data = field_of(fields, "data file");
  if (data.empty()) return {};
  if (std::string unnamed = not_named_header(path, ".nhdr"); !unnamed.empty()) return unnamed;
  if (lower_case(data.substr(0, 4)) == "list")
    return missing_file(path, listed_files(path, {"data file:", "datafile:"}), false);
  return missing_file(path, {data}, data.find('%') != std::string::npos);
}

/// data_bytes: of what follows the header.
std::string unread_meta_image(const fs::path& path, const MetaImageHeader& header, std::uintmax_t data_bytes) {
  if (!header.fault.empty()) return header.fault;
  const HeaderFields& fields = header.fields;
  if (field_of(fields, "NDims").empty()) return {};  // no MetaImage
  for (const char* name : {"DimSize", "ElementType", "ElementDataFile"}) {
    if (field_of(fields, name).empty()) return fmt::format("lacks the field {} in its header; export it again", name);
  }
  static constexpr std::array<std::string_view, 12> kTypes = {
      "MET_CHAR", "MET_UCHAR", "MET_SHORT",     "MET_USHORT",     "MET_INT",   "MET_UINT",
      "MET_LONG", "MET_ULONG", "MET_LONG_LONG", "MET_ULONG_LONG", "MET_FLOAT", "MET_DOUBLE"};
  const std::string type = field_of(fields, "ElementType");
  if (!is_one_of(type.substr(0, type.find("_ARRAY")), kTypes))
    return fmt::format("has voxels of the type {}, which is not read; save it as MET_SHORT", shown(type));
  for (const auto& [name, plain] :
       {std::pair{"ElementToIntensityFunctionSlope", 1.0}, {"ElementToIntensityFunctionOffset", 0.0}}) {
    if (!is_other_than(fields, name, plain)) continue;
    return fmt::format("has voxels that stand for other values ({} {}), which are not read; save it with these", name,
                       shown(field_of(fields, name)));
  }
  const std::string data = field_of(fields, "ElementDataFile");
  if (lower_case(data) == "local") {
    // With -1 the voxels are the end of the file.
    if (is_other_than(fields, "HeaderSize", 0) && is_other_than(fields, "HeaderSize", -1)) {
      return fmt::format(
          "says that its voxels begin at byte {} (HeaderSize), where its header is; take that line away, or export it "
          "again",
          shown(field_of(fields, "HeaderSize")));
    }
    if (!says_true(fields, "CompressedData")) return {};
    const std::string said = field_of(fields, "CompressedDataSize");
    if (said.empty() || said == "0")
      return "does not say how long its compressed voxels are (CompressedDataSize); save it again, uncompressed";
    if (said == std::to_string(data_bytes)) return {};
    return fmt::format(
        "says that its compressed voxels take {} bytes (CompressedDataSize), and {} follow: it is cut short, or was "
        "edited; "
        "export it again",
        shown(said), data_bytes);
  }
  if (std::string unnamed = not_named_header(path, ".mhd"); !unnamed.empty()) return unnamed;
  if (lower_case(data.substr(0, 4)) == "list")
    return missing_file(path, listed_files(path, {"elementdatafile"}), false);
  return missing_file(path, {data}, data.find('%') != std::string::npos);
}

}  // namespace

std::string unread_form(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string first(4, '\0');
  file.read(first.data(), static_cast<std::streamsize>(first.size()));
  // NIfTI-2 begins with the size of its header, in either order of bytes.
  if (first == std::string("\x1c\x02\0\0", 4) || first == std::string("\0\0\x02\x1c", 4))
    return "is NIfTI of another version than 1; save it as NIfTI-1";
  if (first == "NRRD") return unread_nrrd(path, nrrd_fields(file));
  const std::string name = lower_case(path.filename().string()), ending = lower_case(path.extension().string());
  for (const std::string_view of_voxels : {".img", ".img.gz"}) {
    if (name.ends_with(of_voxels)) return "holds the voxels of a pair of files alone; give the one that ends in .hdr";
  }
  if (ending != ".mha" && ending != ".mhd") return {};
  file.clear();
  file.seekg(0);
  const MetaImageHeader header = meta_image_header(file);
  const std::streamoff header_bytes = file ? static_cast<std::streamoff>(file.tellg()) : -1;
  std::error_code error;
  const auto all_bytes = fs::file_size(path, error);
  const bool known = !error && header_bytes >= 0 && static_cast<std::uintmax_t>(header_bytes) <= all_bytes;
  return unread_meta_image(path, header, known ? all_bytes - static_cast<std::uintmax_t>(header_bytes) : 0);
}

}  // namespace birdseye::host
