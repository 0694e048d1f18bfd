#include "host/volume/voxel_bytes.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "calibration/base/lower_case.hpp"
#include "host/volume/header_fields.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// Where the voxels begin, in which file, and whether Deflate has packed them.
struct Place {
  fs::path file;
  std::streamoff begins = 0;
  bool packed = false;
  bool in_parts = false;  ///< what is packed is read to the end of the file, part by part; else the first part alone
};

std::optional<Place> place_beside(const fs::path& header, const std::string& name, bool packed, bool in_parts) {
  if (name.find('%') != std::string::npos || lower_case(name.substr(0, 4)) == "list") return std::nullopt;
  return Place{header.parent_path() / name, 0, packed, in_parts};
}

std::optional<Place> place_in_nrrd(const fs::path& path, std::ifstream& file) {
  const HeaderFields fields = nrrd_fields(file);
  for (const char* skipped : {"line skip", "byte skip"})
    if (const std::string count = lower_case(field_of(fields, skipped)); !count.empty() && count != "0")
      return std::nullopt;
  const std::string encoding = lower_case(field_of(fields, "encoding"));
  const bool packed = encoding == "gzip" || encoding == "gz";
  if (!packed && encoding != "raw") return std::nullopt;
  if (const auto beside = fields.find("data file"); beside != fields.end())
    return place_beside(path, beside->second, packed, true);
  return Place{path, static_cast<std::streamoff>(file.tellg()), packed, true};
}

std::optional<Place> place_in_meta_image(const fs::path& path, std::ifstream& file) {
  const HeaderFields fields = meta_image_header(file).fields;
  const bool text = !field_of(fields, "BinaryData").empty() && !says_true(fields, "BinaryData");
  if (field_of(fields, "NDims").empty() || text) return std::nullopt;
  if (const std::string skipped = lower_case(field_of(fields, "HeaderSize")); !skipped.empty() && skipped != "0")
    return std::nullopt;
  const bool packed = says_true(fields, "CompressedData");
  const auto beside = fields.find("ElementDataFile");
  if (beside == fields.end()) return std::nullopt;
  if (lower_case(beside->second) != "local") return place_beside(path, beside->second, packed, false);
  return Place{path, static_cast<std::streamoff>(file.tellg()), packed, false};
}

/// in_parts: of all that was packed one after the other, as gzip allows; what follows and is not packed counts as
/// nothing. Empty where the first stream is damaged.
std::optional<std::size_t> unpacked_bytes(std::ifstream& file, bool in_parts, std::size_t enough) {
  constexpr int kZlibOrGzip = 15 + 32;
  z_stream stream{};
  if (inflateInit2(&stream, kZlibOrGzip) != Z_OK) return std::nullopt;
  std::vector<char> in(1U << 18U), out(1U << 18U);
  std::size_t count = 0, of_whole_streams = 0;
  bool any_whole = false;
  for (int state = Z_OK; count < enough && (state == Z_OK || state == Z_STREAM_END);) {
    if (state == Z_STREAM_END) {
      any_whole = true;
      of_whole_streams = count;
      if (!in_parts) break;
      inflateReset(&stream);
    }
    if (stream.avail_in == 0) {
      file.read(in.data(), static_cast<std::streamsize>(in.size()));
      if (file.gcount() == 0) break;
      stream.next_in = reinterpret_cast<Bytef*>(in.data());
      stream.avail_in = static_cast<uInt>(file.gcount());
    }
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    state = inflate(&stream, Z_NO_FLUSH);
    count += out.size() - stream.avail_out;
  }
  inflateEnd(&stream);
  if (count >= enough) return count;
  return any_whole ? std::optional(of_whole_streams) : std::nullopt;
}

}  // namespace

std::optional<std::size_t> voxel_bytes(const fs::path& path, std::size_t enough) {
  std::ifstream header(path, std::ios::binary);
  std::array<char, 4> first{};
  header.read(first.data(), first.size());
  const bool is_nrrd = header.gcount() == 4 && std::string(first.data(), first.size()) == "NRRD";
  header.clear();
  header.seekg(0);
  const auto place = is_nrrd ? place_in_nrrd(path, header) : place_in_meta_image(path, header);
  if (!place || place->begins < 0) return std::nullopt;
  std::ifstream file(place->file, std::ios::binary);
  if (place->packed) {
    file.seekg(place->begins);
    return file ? unpacked_bytes(file, place->in_parts, enough) : std::nullopt;
  }
  std::error_code error;
  const auto all_bytes = fs::file_size(place->file, error);
  const auto begins = static_cast<std::uintmax_t>(place->begins);
  if (error || all_bytes < begins) return std::nullopt;
  return static_cast<std::size_t>(all_bytes - begins);
}

std::string too_many(std::size_t held_bytes, std::size_t said_bytes) {
  return fmt::format(
      "holds {} bytes of voxels or more, and the size in its header is of {}: the header was edited, or is another "
      "file's; export it again",
      held_bytes, said_bytes);
}

}  // namespace birdseye::host
