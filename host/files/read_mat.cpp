#include "host/files/read_mat.hpp"

#include <algorithm>
#include <fstream>
#include <iostream>
#include <mutex>
#include <string>
#include <system_error>

namespace birdseye::host {

namespace {

/// While any of these lives, what is written to std::cerr is lost: OpenCV's readers tell their faults there, and their
/// exceptions, in words for programmers.
class QuietCerr {
 public:
  QuietCerr() {
    const std::lock_guard lock(mutex());
    if (alive()++ == 0) said_to() = std::cerr.rdbuf(nullptr);
  }
  ~QuietCerr() {
    const std::lock_guard lock(mutex());
    if (--alive() == 0) std::cerr.rdbuf(said_to());
  }
  QuietCerr(const QuietCerr&) = delete;
  QuietCerr& operator=(const QuietCerr&) = delete;

 private:
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  static int& alive() {
    static int count = 0;
    return count;
  }
  static std::streambuf*& said_to() {
    static std::streambuf* buffer = nullptr;
    return buffer;
  }
};

/// Whether it is a PNG without its last chunk; the reader would say so on standard error, past std::cerr.
bool is_cut_png(const std::filesystem::path& path) {
  constexpr std::streamoff kLastBytes = 64;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file.tellg();
  std::string first(4, '\0'), last(static_cast<std::size_t>(std::clamp<std::streamoff>(size, 0, kLastBytes)), '\0');
  file.seekg(0);
  file.read(first.data(), static_cast<std::streamsize>(first.size()));
  file.seekg(std::max<std::streamoff>(0, size - kLastBytes));
  file.read(last.data(), static_cast<std::streamsize>(last.size()));
  return first == "\x89PNG" && last.find("IEND") == std::string::npos;
}

}  // namespace

cv::Mat read_mat(const std::filesystem::path& path, cv::ImreadModes mode) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return {};  // a pipe would be waited for
  if (is_cut_png(path)) return {};
  const QuietCerr quiet;
  try {
    return cv::imread(path.string(), mode);
  } catch (const cv::Exception&) {  // a size that no picture has
    return {};
  }
}

const char* why_no_picture(const std::filesystem::path& path) {
  std::error_code failed;
  const auto bytes = std::filesystem::file_size(path, failed);
  if (std::error_code ignored;
      std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored))
    return "it is no file but a folder, a pipe or a device";
  if (!failed && bytes == 0) return "the file is empty";
  if (!std::ifstream(path)) return "the file cannot be opened";
  return is_cut_png(path) ? "the file is cut short" : "the file is damaged, or no picture";
}

}  // namespace birdseye::host
