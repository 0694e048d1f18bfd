#include "host/confine/allowance.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <system_error>

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

/// Of the regular files that `at` gives, until there are too many. each: whether each is an input of its own.
template <typename Iterator>
bool add_files(Iterator at, std::error_code& failed, bool each, std::size_t most, Readable& readable) {
  for (; !failed && at != Iterator(); at.increment(failed)) {
    std::error_code ignored;
    if (!at->is_regular_file(ignored)) continue;  // a link to one is one
    if (readable.files.size() == most) return false;
    readable.files.push_back(at->path());
    const std::uintmax_t bytes = size_of(at->path());
    readable.bytes += bytes;
    if (each) readable.processor_time = readable.processor_time + allowance_of(bytes).processor_time;
  }
  if (!each) readable.processor_time = allowance_of(readable.bytes).processor_time;
  return true;
}

Result<Readable> of_folder(const fs::path& folder) {
  constexpr std::size_t kMostFiles = 200'000;  // whoever reads them takes half of that
  Readable readable{{}, folder, 0, {}};
  std::error_code failed;
  const fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, failed);
  if (!add_files(at, failed, true, kMostFiles, readable))
    return Error{Errc::unsupported,
                 "holds over " + std::to_string(kMostFiles) + " files; give the folder of one patient"};
  // An empty one takes its time too, and is told.
  readable.processor_time = std::max(readable.processor_time, allowance_of(readable.bytes).processor_time);
  return readable;
}

fs::path folder_of(const fs::path& file) {
  return resolved(file.has_parent_path() ? file.parent_path() : fs::path("."));
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

bool names_other_files(const fs::path& file) {
  constexpr std::array kHeaders{".mhd", ".nhdr", ".hdr", ".hdr.gz"};
  const std::string name = lower_case(file.filename().string());
  return std::ranges::any_of(kHeaders, [&name](const char* ending) { return name.ends_with(ending); });
}

bool stands_for_folder(const fs::path& file) {
  return lower_case(file.stem().string()) == "dicomdir";
}

Result<Readable> readable_for(const fs::path& input) {
  std::error_code failed;
  const fs::path real = resolved(input);
  if (fs::is_directory(real, failed)) return of_folder(real);
  if (stands_for_folder(input)) return of_folder(folder_of(input));
  if (!names_other_files(input)) {
    const std::uintmax_t bytes = size_of(real);
    return Readable{{real}, {}, bytes, allowance_of(bytes).processor_time};
  }
  constexpr std::size_t kMostBeside = 10'000;  // a folder of scans has hundreds, and one of photographs thousands
  Readable readable{{real}, {}, 0, {}};        // also where its folder cannot be listed
  const fs::directory_iterator at(folder_of(input), fs::directory_options::skip_permission_denied, failed);
  if (!add_files(at, failed, false, kMostBeside, readable))
    return Error{Errc::unsupported, "lies among over " + std::to_string(kMostBeside) +
                                        " files, any of which may hold its voxels; put it and those into a folder of "
                                        "their own"};
  return readable;
}

}  // namespace birdseye::host
