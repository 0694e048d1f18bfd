#include "host/volume/header_fields.hpp"

#include <fmt/format.h>

#include <optional>

#include "calibration/base/lower_case.hpp"

namespace birdseye::host {

namespace {

/// The lines at the begin of a file, one after the other, for as long as they may be those of a header.
class HeaderLines {
 public:
  explicit HeaderLines(std::istream& file) : file_(file) {}

  /// Empty at the end of the file, or of what may be a header.
  std::optional<std::string> next() {
    if (bytes_ >= kLongestHeader || !file_) return std::nullopt;
    std::string line;
    for (char c = 0; line.size() < kLongestHeader && file_.get(c) && c != '\n';) line += c;
    bytes_ += line.size() + 1;
    return line;
  }

 private:
  static constexpr std::size_t kLongestHeader = 1 << 20;

  std::istream& file_;
  std::size_t bytes_ = 0;
};

void put_field(HeaderFields& fields, const std::string& name, const std::string& value) {
  const auto [known, is_new] = fields.emplace(name, value);
  if (!is_new && known->second != value) fields[name + std::string(kAgain)] = value;
}

/// NRRD's own name for one that is written as one word, as "spaceunits".
std::string nrrd_name(const std::string& name) {
  for (const std::string_view known :
       {"space dimension", "space directions", "space units", "space origin", "measurement frame", "sample units",
        "axis mins", "axis maxs", "old min", "old max", "line skip", "byte skip", "data file"}) {
    std::string one_word(known);
    one_word.erase(one_word.find(' '), 1);
    if (name == one_word) return std::string(known);
  }
  return name;
}

constexpr const char* kLastOfMetaImage = "ElementDataFile";

/// The name by which MetaIO is told what the voxels are or where they lie, and that this one is but for capitals; empty
/// where it is none of these.
std::string_view meant_name(const std::string& name) {
  const std::string small = lower_case(name);
  for (const std::string_view known : {"NDims",
                                       "DimSize",
                                       "ElementType",
                                       "ElementNumberOfChannels",
                                       "ElementSpacing",
                                       "ElementSize",
                                       "Offset",
                                       "Position",
                                       "Origin",
                                       "ImagePosition",
                                       "TransformMatrix",
                                       "Rotation",
                                       "Orientation",
                                       "AnatomicalOrientation",
                                       "DistanceUnits",
                                       "BinaryData",
                                       "BinaryDataByteOrderMSB",
                                       "ElementByteOrderMSB",
                                       "CompressedData",
                                       "CompressedDataSize",
                                       "HeaderSize",
                                       "ElementToIntensityFunctionSlope",
                                       "ElementToIntensityFunctionOffset",
                                       kLastOfMetaImage}) {
    if (lower_case(known) == small) return known;
  }
  return {};
}

std::string line_fault(const std::string& line, const std::string& name, char sign) {
  const std::string_view meant = meant_name(name);
  if (meant.empty() || (meant == name && sign == '=')) return {};
  return fmt::format(
      "has the line \"{}\" in its header, which some programs read and others pass over: write it as \"{} = ...\", "
      "spelt so, or export the file again",
      without_blanks(line).substr(0, 80), meant);
}

}  // namespace

std::string_view without_blanks(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\v\f";
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

HeaderFields nrrd_fields(std::istream& file) {
  HeaderFields fields;
  HeaderLines lines(file);
  while (const auto line = lines.next()) {
    const std::string_view text = without_blanks(*line);
    if (text.empty()) break;
    const auto at = text.find(':');
    if (at == std::string_view::npos) continue;
    put_field(fields, nrrd_name(lower_case(without_blanks(text.substr(0, at)))),
              std::string(without_blanks(text.substr(at + 1))));
  }
  return fields;
}

MetaImageHeader meta_image_header(std::istream& file) {
  MetaImageHeader header;
  std::string bare;  // the first line without a sign
  HeaderLines lines(file);
  while (const auto line = lines.next()) {
    const std::string_view text = without_blanks(*line);
    if (text.empty()) continue;
    const auto at = text.find_first_of("=:");
    if (at == std::string_view::npos) {
      if (bare.empty()) bare = text.substr(0, 80);
      continue;
    }
    const std::string name(without_blanks(text.substr(0, at)));
    if (header.fault.empty()) header.fault = line_fault(*line, name, text[at]);
    const auto from = text.find_first_not_of("=: \t", at);
    put_field(header.fields, name,
              std::string(from == std::string_view::npos ? std::string_view() : text.substr(from)));
    if (name == kLastOfMetaImage) break;
  }
  // MetaIO takes the "=" of the next line for that of such a line. Without a last line there is no telling a header
  // from what follows it.
  if (header.fault.empty() && !bare.empty() && header.fields.contains(kLastOfMetaImage)) {
    header.fault = fmt::format(
        "has the line \"{}\" in its header, which has no \"=\": take it away, or export the file again", bare);
  }
  return header;
}

std::string field_of(const HeaderFields& fields, const char* name) {
  const auto found = fields.find(name);
  return found == fields.end() ? std::string() : found->second;
}

bool says_true(const HeaderFields& fields, const char* name) {
  const std::string value = field_of(fields, name);
  return !value.empty() && (value[0] == 'T' || value[0] == 't' || value[0] == '1');
}

}  // namespace birdseye::host
