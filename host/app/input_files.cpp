#include "host/app/input_files.hpp"

#include <algorithm>
#include <exception>
#include <fstream>
#include <sstream>
#include <string_view>
#include <system_error>
#include <toml.hpp>
#include <utility>

#include "calibration/base/lower_case.hpp"
#include "calibration/base/nesting.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/confine/allowance.hpp"
#include "host/files/name_pattern.hpp"
#include "host/volume/header_fields.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

void add_matching(const fs::path& pattern, std::vector<fs::path>& out) {
  const auto found = files_matching(folder_of(pattern), pattern.filename().string());
  if (found) out.insert(out.end(), found->begin(), found->end());
}

void add_beside(const fs::path& header, std::string_view name, std::vector<fs::path>& out) {
  constexpr std::size_t kLongestName = 255;
  if (name.empty() || name.size() > kLongestName) return;
  std::error_code ignored;
  if (fs::path beside = folder_of(header) / name; fs::is_regular_file(beside, ignored))
    out.push_back(std::move(beside));
}

/// A name in which each number, as %03d, is any text.
std::string with_stars(const std::string& name) {
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (name[i] != '%') {
      out += name[i];
      continue;
    }
    i = std::min(name.find_first_not_of("0123456789", i + 1), name.size());  // where the number's letter is
    out += '*';
  }
  return out;
}

/// Any file beside a header that one of its lines names, alone or as a field's value, and the other file of a NIfTI
/// pair. A name with a number in it stands for many: "data file: ct%03d.raw 1 100 1".
void add_voxel_files(const fs::path& header, std::vector<fs::path>& out) {
  if (!names_other_files(header)) return;
  const std::string name = header.filename().string();
  const std::string stem = name.substr(0, lower_case(name).rfind(".hdr"));
  for (const char* const ending : {".img", ".img.gz", ".IMG", ".IMG.GZ"}) add_beside(header, stem + ending, out);
  constexpr std::size_t kMostHeaderBytes = std::size_t{1} << 20U;
  std::ifstream file(header, std::ios::binary);
  std::string text(kMostHeaderBytes, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    add_beside(header, without_blanks(line), out);
    const auto sign = line.find_first_of(":=");
    if (sign == std::string::npos) continue;
    const std::string value(without_blanks(std::string_view(line).substr(sign + 1)));
    add_beside(header, value, out);
    const std::string field = lower_case(std::string(without_blanks(std::string_view(line).substr(0, sign))));
    if (!field.ends_with("file") || value.find('%') == std::string::npos) continue;
    add_matching(folder_of(header) / with_stars(value.substr(0, value.find(' '))), out);
    return;  // the last field that names any
  }
}

/// A file or folder that is there, or a file before a camera's name and its colon.
void add_file(const fs::path& named, std::vector<fs::path>& out) {
  std::error_code ignored;
  const std::string text = named.string();
  const bool is_there = fs::exists(named, ignored);
  const fs::path file = is_there ? named : fs::path(text.substr(0, text.rfind(':')));
  if (!is_there && !fs::exists(file, ignored)) return;
  out.push_back(file);
  add_voxel_files(file, out);
}

void add_named(const toml::value& value, const fs::path& folder, std::vector<fs::path>& out) {
  if (value.is_table()) {
    for (const auto& [key, one] : value.as_table()) add_named(one, folder, out);
  } else if (value.is_array()) {
    for (const toml::value& one : value.as_array()) add_named(one, folder, out);
  } else if (value.is_string() && !toml::get<std::string>(value).empty()) {
    add_file(folder / toml::get<std::string>(value), out);
  }
}

}  // namespace

std::vector<fs::path> input_files(const std::string& given) {
  std::vector<fs::path> out;
  if (given.empty()) return out;
  if (is_pattern(fs::path(given).filename().string())) {
    std::vector<fs::path> matching;
    add_matching(given, matching);
    for (const fs::path& one : matching) add_file(one, out);
  }
  add_file(given, out);
  return out;
}

std::vector<fs::path> files_of_case(const fs::path& file) {
  const auto text = read_whole_file(file, kMostTextBytes);
  if (!text || nests_too_deeply(*text, Notation::toml)) return {};
  std::vector<fs::path> out;
  try {
    std::stringstream in(*text);
    add_named(toml::parse(in, file.string()), file.parent_path(), out);
  } catch (const std::exception&) {
    return {};
  }
  return out;
}

}  // namespace birdseye::host
