#include "host/files/read_mat.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <string_view>

#include "drivers/system/whole_file.hpp"
#include "host/confine/run_confined.hpp"

namespace birdseye::host {

namespace {

constexpr std::size_t kMostFileBytes = 256U << 20U;
constexpr std::size_t kMostPixelBytes = 768U << 20U;  // 16,384 pixels squared, of three bytes
constexpr std::int32_t kMostSidePx = 1 << 16;

/// Of a picture that comes back; its pixels follow, row by row.
struct Size {
  std::int32_t rows = 0, columns = 0;
};

/// In the confined process: Size and pixels; nothing where it is no picture.
template <cv::ImreadModes kMode>
std::string decoded(std::string_view file) {
  const auto bytes = static_cast<int>(file.size());
  const cv::Mat in(1, bytes, CV_8U, const_cast<char*>(file.data()));  // NOLINT: it is only read
  cv::Mat picture;
  try {
    picture = cv::imdecode(in, kMode);
  } catch (const cv::Exception&) {  // a size that no picture has
    return {};
  }
  if (picture.empty()) return {};
  const Size size{picture.rows, picture.cols};
  std::string out(sizeof size + picture.total() * picture.elemSize(), '\0');
  std::memcpy(out.data(), &size, sizeof size);
  std::memcpy(out.data() + sizeof size, picture.data, out.size() - sizeof size);
  return out;
}

/// Whether it is a PNG without its last chunk, of which the decoder gives a part.
bool is_cut_png(std::string_view file) {
  constexpr std::size_t kLastBytes = 64;
  const std::string_view last = file.substr(file.size() - std::min(file.size(), kLastBytes));
  return file.substr(0, 4) == "\x89PNG" && last.find("IEND") == std::string_view::npos;
}

/// By what the confined process sends, which is not to be trusted.
Result<cv::Mat> read_mat(const std::filesystem::path& path, ConfinedWork decode, int type) {
  const auto wrong = [](const char* why) { return Error{Errc::bad_format, why}; };
  const auto file = read_whole_file(path, kMostFileBytes);
  if (!file && file.error().code == Errc::bad_value) return wrong("it is no file but a folder, a pipe or a device");
  if (!file && file.error().code == Errc::unsupported) return wrong("the file is larger than any picture");
  if (!file) return wrong("the file cannot be opened");
  if (file->empty()) return wrong("the file is empty");
  if (is_cut_png(*file)) return wrong("the file is cut short");
  const auto came = run_confined(decode, *file, sizeof(Size) + kMostPixelBytes);
  if (!came && came.error().code == Errc::bad_value) return wrong("it has more than 16,384 x 16,384 pixels");
  if (!came) return came.error();
  constexpr const char* kDamaged = "the file is damaged, or no picture";
  Size size;
  if (came->size() < sizeof size) return wrong(kDamaged);
  std::memcpy(&size, came->data(), sizeof size);
  const std::string_view pixels = std::string_view(*came).substr(sizeof size);
  if (size.rows <= 0 || size.columns <= 0 || size.rows > kMostSidePx || size.columns > kMostSidePx)
    return wrong(kDamaged);
  const auto side = [](std::int32_t px) { return static_cast<std::size_t>(px); };
  if (side(size.rows) * side(size.columns) * side(CV_ELEM_SIZE(type)) != pixels.size()) return wrong(kDamaged);
  cv::Mat picture(size.rows, size.columns, type);
  std::memcpy(picture.data, pixels.data(), pixels.size());
  return picture;
}

}  // namespace

Result<cv::Mat> read_grey_mat(const std::filesystem::path& path) {
  return read_mat(path, decoded<cv::IMREAD_GRAYSCALE>, CV_8UC1);
}

Result<cv::Mat> read_bgr_mat(const std::filesystem::path& path) {
  return read_mat(path, decoded<cv::IMREAD_COLOR>, CV_8UC3);
}

}  // namespace birdseye::host
