#include "host/confine/allowance.hpp"

#include <algorithm>

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

std::uintmax_t size_of(const fs::path& file) {
  std::error_code failed;
  const std::uintmax_t bytes = fs::file_size(file, failed);
  return failed ? 0 : bytes;
}

/// Where the links of a path lead; the path itself where they lead nowhere.
fs::path resolved(const fs::path& path) {
  std::error_code failed;
  const fs::path real = fs::canonical(path, failed);
  return failed ? path : real;
}

}  // namespace

Allowance allowance_of(std::uintmax_t bytes) {
  constexpr std::uintmax_t kLeast_bytes = 256U << 20U;   // the libraries' own
  constexpr std::uintmax_t kMost_bytes = 1ULL << 40U;    // no product below goes over the type's bounds
  constexpr std::uintmax_t kDeflate = 1032, kTimes = 3;  // RFC 1951: 258 bytes of 2 bits
  constexpr std::int64_t kLeast_ms = 2000, kPerMb_ms = 500;
  const std::uintmax_t counted = std::min(bytes, kMost_bytes);
  return {kLeast_bytes + kTimes * kDeflate * counted,
          Duration::from_ms(kLeast_ms + kPerMb_ms * static_cast<std::int64_t>(counted / 1'000'000))};
}

Readable readable_for(const fs::path& input) {
  std::error_code failed;
  const fs::path real = resolved(input);
  if (!fs::is_directory(real, failed))
    return {{real, resolved(input.parent_path().empty() ? "." : input.parent_path())}, size_of(real)};
  Readable readable{{real}, 0};
  fs::recursive_directory_iterator at(real, fs::directory_options::skip_permission_denied, failed);
  for (; !failed && at != fs::recursive_directory_iterator(); at.increment(failed)) {
    std::error_code ignored;
    if (!at->is_regular_file(ignored)) continue;
    if (at->is_symlink(ignored)) readable.paths.push_back(resolved(at->path()));
    readable.bytes += size_of(at->path());
  }
  return readable;
}

}  // namespace birdseye::host
