#include "host/files/sequence_header.hpp"

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <optional>

#include "drivers/system/next_line.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFrame = "Seq_Frame";
/// A header's lines are short; one that is longer is pixels.
constexpr std::size_t kLongestLine = 1 << 16;

/// A line of a MetaImage's header, "key = value", or of an NRRD's, "key:=value".
std::optional<std::pair<std::string_view, std::string_view>> field_of(std::string_view line) {
  const auto equals = line.find('=');
  if (equals == std::string_view::npos || equals == 0) return std::nullopt;
  const auto bare = [](std::string_view text) {
    const auto first = text.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) return std::string_view();
    return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
  };
  return std::pair{bare(line.substr(0, line[equals - 1] == ':' ? equals - 1 : equals)), bare(line.substr(equals + 1))};
}

/// What has come of the lines so far.
struct Taken {
  std::size_t fields = 0;
  std::string twice;  ///< the name of a field that stands twice with different values, of which one reader takes the
                      ///< first, another the last
};

void put(SequenceHeader::Fields& fields, std::string_view key, std::string_view name, std::string_view value,
         Taken& taken) {
  const auto [field, is_new] = fields.emplace(key, value);
  if (is_new) ++taken.fields;
  if (!is_new && field->second != value) taken.twice = name;
}

void take_line(std::string_view line, SequenceHeader& header, Taken& taken) {
  const auto field = field_of(line);
  if (!field) return;
  std::string_view key = field->first;
  if (!key.starts_with(kFrame)) {
    if (!key.starts_with('#')) put(header.fields, key, key, field->second, taken);
    return;
  }
  key.remove_prefix(kFrame.size());
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), number);
  if (error != std::errc() || end == key.data() + key.size() || *end != '_') return;
  key.remove_prefix(static_cast<std::size_t>(end - key.data()) + 1);
  if (key.ends_with(kTransformField)) header.transforms.emplace(key.substr(0, key.size() - kTransformField.size()));
  put(header.frames[number], key, field->first, field->second, taken);
}

}  // namespace

Result<SequenceHeader> read_sequence_header(const fs::path& path, const HeaderBounds& most) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file", path.string())};
  std::ifstream in(path, std::ios::binary);
  if (!in) return Error{Errc::unreadable, fmt::format("{}: cannot be opened; check its permissions", path.string())};
  SequenceHeader header;
  std::string line;
  Taken taken;
  std::uint64_t bytes = 0;
  for (bool nrrd = false, first = true; next_line(in, line, kLongestLine); first = false) {
    if (first) nrrd = line.starts_with("NRRD");
    take_line(line, header, taken);
    bytes += line.size() + 1;
    if (taken.fields > most.fields || bytes > most.bytes) {
      return Error{Errc::unsupported,
                   fmt::format("{}: its header has more than the {} fields or {:.0f} MB of text that are read; divide "
                               "the recording into shorter ones, or give a sequence's file",
                               path.string(), most.fields, static_cast<double>(most.bytes) / 1e6)};
    }
    // Here the header ends and the pixels begin.
    if (line.starts_with("ElementDataFile") || (nrrd && (line.empty() || line == "\r"))) {
      header.whole = true;
      header.data_offset = in.eof() ? static_cast<std::uint64_t>(fs::file_size(path, ignored))
                                    : static_cast<std::uint64_t>(std::streamoff(in.tellg()));
      break;
    }
  }
  if (in.bad()) return Error{Errc::unreadable, fmt::format("{}: {}", path.string(), kNotReadToItsEnd)};
  if (!taken.twice.empty() && (header.whole || !header.frames.empty())) {
    return Error{Errc::bad_format, fmt::format("{}: has {} twice, with different values; keep the line that is right",
                                               path.string(), taken.twice.substr(0, 80))};
  }
  return header;
}

std::string_view value_of(const SequenceHeader::Fields& fields, std::string_view key) {
  const auto found = fields.find(key);
  return found == fields.end() ? std::string_view() : std::string_view(found->second);
}

bool says_true(const SequenceHeader::Fields& fields, std::string_view key) {
  const std::string_view value = value_of(fields, key);
  return !value.empty() && (value[0] == 'T' || value[0] == 't' || value[0] == '1');
}

}  // namespace birdseye::host
