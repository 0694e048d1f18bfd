#include "host/volume/nifti_label_names.hpp"

#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace birdseye::host {

namespace {

constexpr std::size_t kHeaderBytes = 348, kMostBytes = 1 << 22;

/// What lies between the header and the voxels, at most kMostBytes of it; empty for no single-file NIfTI-1.
std::string bytes_before_voxels(const std::filesystem::path& path) {
  const gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) return {};
  std::string bytes(kHeaderBytes, '\0');
  float offset = 0;
  if (gzread(file, bytes.data(), kHeaderBytes) == static_cast<int>(kHeaderBytes) &&
      std::memcmp(bytes.data() + 344, "n+1", 3) == 0) {
    std::memcpy(&offset, bytes.data() + 108, sizeof offset);
  }
  bytes.clear();
  if (offset > static_cast<float>(kHeaderBytes) && offset <= static_cast<float>(kMostBytes)) {
    bytes.resize(static_cast<std::size_t>(offset) - kHeaderBytes);
    const int got = gzread(file, bytes.data(), static_cast<unsigned>(bytes.size()));
    bytes.resize(static_cast<std::size_t>(std::max(got, 0)));
  }
  gzclose_r(file);
  return bytes;
}

/// What stands between two marks from `at` on, which moves past it; empty where they are not there.
std::string_view between(std::string_view text, std::string_view from, std::string_view to, std::size_t& at) {
  const std::size_t begin = text.find(from, at);
  const std::size_t end = begin == text.npos ? text.npos : text.find(to, begin + from.size());
  at = end == text.npos ? text.npos : end + to.size();
  return end == text.npos ? std::string_view() : text.substr(begin + from.size(), end - begin - from.size());
}

}  // namespace

std::vector<NamedLabel> nifti_label_names(const std::filesystem::path& path) {
  const std::string bytes = bytes_before_voxels(path);
  std::vector<NamedLabel> names;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::string_view label = between(bytes, "<Label ", "</Label>", at);
    std::size_t in_label = 0;
    const std::string_view key = between(label, "Key=\"", "\"", in_label);
    NamedLabel named;
    const auto read = std::from_chars(key.data(), key.data() + key.size(), named.number);
    const std::size_t begins = label.find('>');
    if (key.empty() || read.ec != std::errc() || begins == label.npos) continue;
    std::string_view name = label.substr(begins + 1);
    constexpr std::string_view kPlain = "<![CDATA[";
    if (name.starts_with(kPlain)) name = name.substr(kPlain.size(), name.find("]]>") - kPlain.size());
    named.name = name;
    named.values = {named.number};
    names.push_back(std::move(named));
  }
  return names;
}

}  // namespace birdseye::host
