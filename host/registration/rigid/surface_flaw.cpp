#include "host/registration/rigid/surface_flaw.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string_view>
#include <vector>

#include "calibration/base/lower_case.hpp"
#include "drivers/system/next_line.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestLine = std::size_t{1} << 20U;
constexpr const char* kCut =
    "is cut short: it holds less than it promises, or its last line has no end; export it again";
constexpr const char* kHuge =
    "has a coordinate of more than 18 digits, which its decoder takes for another; mend it, or export it again";
constexpr const char* kNewer =
    "is a VTK file of version 5, which its decoder does not read; save it as version 4.2, or as PLY";

/// Whether a number of the line has more digits before its point than fit 64 bits.
bool has_huge_number(std::string_view line) {
  constexpr int kMostDigits = 18;
  int digits = 0;
  bool in_front = true;
  for (const char c : line) {
    if (c == ' ' || c == '\t') {
      digits = 0;
      in_front = true;
    } else if (c < '0' || c > '9') {
      in_front = in_front && (c == '-' || c == '+');
    } else if (in_front && ++digits > kMostDigits) {
      return true;
    }
  }
  return false;
}

std::string first_word(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r\n";
  line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
  return std::string(line.substr(0, line.find_first_of(kBlanks)));
}

/// Passes over so many values of so many bytes each. False where there are fewer.
bool skip(std::istream& in, std::uint64_t count, std::uint64_t bytes) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 40U;
  if (bytes == 0) return true;
  if (count > kMost / bytes) return false;
  const auto all = static_cast<std::streamsize>(count * bytes);
  return in.ignore(all).gcount() == all;
}

/// Whether so many numbers stand there, and something behind the last, which else may be cut too.
bool skip_numbers(std::istream& in, std::uint64_t count) {
  double number = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    if (!(in >> number) || in.eof()) return false;
  }
  return true;
}

std::string flaw_of_vtk(std::istream& in) {
  std::string line;
  for (int i = 0; i < 3; ++i) {  // version, title, then ASCII or BINARY
    if (!next_line(in, line, kLongestLine)) return {};
    if (i == 0 && line.find("Version 5") != std::string::npos) return kNewer;
  }
  const bool binary = first_word(line) == "BINARY";
  while (next_line(in, line, kLongestLine)) {
    std::istringstream words(line);
    std::string what, more;
    std::uint64_t count = 0;
    words >> what >> count >> more;
    std::uint64_t bytes = 4;
    if (what == "POINTS") {
      if (count > UINT64_MAX / 3) return kCut;
      count *= 3;
      if (more == "double") bytes = 8;
    } else if (what == "POLYGONS" || what == "LINES" || what == "VERTICES" || what == "TRIANGLE_STRIPS") {
      count = 0;
      std::istringstream(more) >> count;
    } else {
      continue;
    }
    if (!(binary ? skip(in, count, bytes) : skip_numbers(in, count))) return kCut;
  }
  return {};
}

/// A property of PLY: a value, or a list with its length before it.
struct Property {
  std::uint64_t length_bytes = 0;  ///< 0: no list
  std::uint64_t bytes = 0;
};
struct Element {
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

/// 0: there is no such type.
std::uint64_t bytes_of_type(const std::string& type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "float") return 4;
  if (type == "int32" || type == "uint32" || type == "float32") return 4;
  return type == "double" || type == "float64" ? 8 : 0;
}

bool skip_binary(std::istream& in, const Element& element, bool big_endian) {
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      std::uint64_t length = property.length_bytes == 0 ? 1 : 0;
      for (std::uint64_t byte = 0; byte < property.length_bytes; ++byte) {
        const int got = in.get();
        if (got < 0) return false;
        const auto value = static_cast<std::uint64_t>(got);
        length = big_endian ? length << 8U | value : length | value << (8 * byte);
      }
      if (!skip(in, length, property.bytes)) return false;
    }
  }
  return true;
}

std::string flaw_of_ply(std::istream& in) {
  std::vector<Element> elements;
  std::string line, format;
  while (next_line(in, line, kLongestLine)) {
    std::istringstream words(line);
    std::string what, type, name, of_each;
    words >> what >> type;
    if (what == "end_header") break;
    if (what == "format") format = type;
    if (what == "element") words >> elements.emplace_back().count;
    if (what != "property") continue;
    if (elements.empty()) return {};
    Property property{0, bytes_of_type(type)};
    if (type == "list") {
      words >> name >> of_each;
      property = {bytes_of_type(name), bytes_of_type(of_each)};
      if (property.length_bytes == 0) return {};
    }
    if (property.bytes == 0) return {};
    elements.back().properties.push_back(property);
  }
  for (const Element& element : elements) {
    if (format != "ascii") {
      if (!element.properties.empty() && !skip_binary(in, element, format == "binary_big_endian")) return kCut;
      continue;
    }
    for (std::uint64_t i = 0; i < element.count;) {
      if (!next_line(in, line, kLongestLine)) return kCut;
      if (first_word(line).empty()) continue;
      if (in.eof()) return kCut;
      if (has_huge_number(line)) return kHuge;
      ++i;
    }
  }
  return {};
}

/// Of a text whose places stand in lines that begin with this word. last: gets its last line that is not blank.
std::string flaw_of_lines(std::istream& in, std::string_view word, std::string& last, bool& last_has_end) {
  std::string line;
  while (next_line(in, line, kLongestLine)) {
    const std::string first = first_word(line);
    if (first.empty()) continue;
    if (first == word && has_huge_number(line)) return kHuge;
    last = line;
    last_has_end = !in.eof() || line.back() == '\r';
  }
  return {};
}

std::string flaw_of_obj(std::istream& in) {
  std::string last;
  bool last_has_end = true;
  std::string flaw = flaw_of_lines(in, "v", last, last_has_end);
  return flaw.empty() && !last_has_end ? kCut : flaw;
}

std::string flaw_of_stl(std::istream& in, std::uint64_t file_bytes) {
  constexpr std::uint64_t kHeadBytes = 80, kTriangleBytes = 50;
  std::string head(kHeadBytes, '\0');
  std::uint64_t triangles = 0;
  in.read(head.data(), kHeadBytes);
  for (unsigned byte = 0; byte < 4; ++byte) triangles |= static_cast<std::uint64_t>(in.get() & 0xFF) << (8 * byte);
  if (in && file_bytes == kHeadBytes + 4 + kTriangleBytes * triangles) return {};
  if (first_word(head) != "solid") return in && file_bytes < kHeadBytes + 4 + kTriangleBytes * triangles ? kCut : "";
  in.clear();
  in.seekg(0);
  std::string last;
  bool ignored = true;
  std::string flaw = flaw_of_lines(in, "vertex", last, ignored);
  return flaw.empty() && lower_case(first_word(last)) != "endsolid" ? kCut : flaw;
}

}  // namespace

std::string flaw_of_surface(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string ending = lower_case(path.extension().string());
  if (ending == ".vtk") return flaw_of_vtk(in);
  std::string mark(3, '\0');
  in.read(mark.data(), 3);
  in.clear();
  in.seekg(0);
  if (mark == "ply") return flaw_of_ply(in);
  if (ending == ".obj") return flaw_of_obj(in);
  if (ending != ".stl") return {};
  std::error_code ignored;
  return flaw_of_stl(in, fs::file_size(path, ignored));
}

}  // namespace birdseye::host
