#include "host/confine/allowance.hpp"

#include <algorithm>
#include <array>

#include "calibration/base/lower_case.hpp"

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

/// Whether a file's voxels may lie in another file beside it.
bool is_header(const fs::path& file) {
  constexpr std::array kHeaders{".mhd", ".nhdr", ".hdr", ".img"};
  return std::ranges::find(kHeaders, lower_case(file.extension().string())) != kHeaders.end();
}

/// A file of a folder that is read, and what it leads to.
void add_file(const fs::directory_entry& entry, Readable& readable) {
  std::error_code ignored;
  if (!entry.is_regular_file(ignored)) return;
  if (entry.is_symlink(ignored)) readable.paths.push_back(resolved(entry.path()));
  readable.bytes += size_of(entry.path());
}

}  // namespace

Allowance allowance_of(std::uintmax_t bytes) {
  constexpr std::uintmax_t kLeast_bytes = 256U << 20U;   // the libraries' own
  constexpr std::uintmax_t kMost_bytes = 1ULL << 40U;    // no product below goes over the type's bounds
  constexpr std::uintmax_t kDeflate = 1032, kTimes = 3;  // RFC 1951: 258 bytes of 2 bits
  const std::uintmax_t counted = std::min(bytes, kMost_bytes);
  // What it unpacks to is worked through at 100 MB a second, but no CT needs 20 s for that; JPEG 2000 needs 0.3 s a MB.
  const double mb = 1e-6 * static_cast<double>(counted);
  const double unpacking_s = std::min(20.0, static_cast<double>(kDeflate) * mb / 100);
  return {kLeast_bytes + kTimes * kDeflate * counted, Duration::from_seconds(2 + unpacking_s + 0.5 * mb)};
}

Readable readable_for(const fs::path& input) {
  std::error_code failed;
  const fs::path real = resolved(input);
  if (fs::is_directory(real, failed)) {
    Readable readable{{real}, 0};
    fs::recursive_directory_iterator at(real, fs::directory_options::skip_permission_denied, failed);
    for (; !failed && at != fs::recursive_directory_iterator(); at.increment(failed)) add_file(*at, readable);
    return readable;
  }
  const fs::path folder = resolved(input.has_parent_path() ? input.parent_path() : fs::path("."));
  if (!is_header(input)) return {{real, folder}, size_of(real)};
  Readable readable{{real, folder}, 0};
  fs::directory_iterator at(folder, fs::directory_options::skip_permission_denied, failed);
  for (; !failed && at != fs::directory_iterator(); at.increment(failed)) add_file(*at, readable);
  return readable;
}

}  // namespace birdseye::host
