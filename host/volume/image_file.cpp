#include "host/volume/image_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <new>
#include <optional>
#include <span>
#include <string>

#include "host/volume/decode.hpp"
#include "host/volume/isolated.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// What the copy of this process sends of itself: the file it is about to read, how it failed, or the image.
enum class Record : std::uint8_t { reading = 'r', error = 'e', image = 'i' };

using Send = std::function<void(const void* data, std::size_t size)>;

void send_text(const Send& send, Record kind, std::int32_t code, const std::string& text) {
  const auto length = static_cast<std::uint32_t>(text.size());
  send(&kind, sizeof kind);
  send(&code, sizeof code);
  send(&length, sizeof length);
  send(text.data(), text.size());
}

void send_image(const Send& send, const ImageFile& image) {
  const Record kind = Record::image;
  send(&kind, sizeof kind);
  send(image.size.data(), sizeof image.size);
  send(&image.components, sizeof image.components);
  send(image.spacing_mm.data(), 3 * sizeof(double));
  send(image.origin_mm.data(), 3 * sizeof(double));
  send(image.axes.data(), 9 * sizeof(double));
  send(image.values.data(), image.values.size() * sizeof(float));
}

Result<ImageFile> decode(const fs::path& path, int components, const Announce& announce) {
  std::error_code error;
  if (fs::is_directory(path, error)) return decode_dicom_folder(path, announce);
  announce(path);
  return is_dicom(path) ? decode_dicom_file(path, announce) : decode_image_file(path, components);
}

/// Takes the records apart. Bytes that end early are the end of a copy that died.
class Records {
 public:
  explicit Records(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool take(void* to, std::size_t size) {
    if (bytes_.size() < size) return false;
    std::memcpy(to, bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
    return true;
  }

  std::optional<Error> take_text() {
    std::int32_t code = 0;
    std::uint32_t length = 0;
    if (!take(&code, sizeof code) || !take(&length, sizeof length) || bytes_.size() < length) return std::nullopt;
    Error told{static_cast<Errc>(code), std::string(length, ' ')};
    take(told.what.data(), length);
    return told;
  }

  std::optional<ImageFile> take_image() {
    ImageFile image;
    if (!take(image.size.data(), sizeof image.size) || !take(&image.components, sizeof image.components) ||
        !take(image.spacing_mm.data(), 3 * sizeof(double)) || !take(image.origin_mm.data(), 3 * sizeof(double)) ||
        !take(image.axes.data(), 9 * sizeof(double))) {
      return std::nullopt;
    }
    std::size_t count = static_cast<std::size_t>(image.components);
    for (const int n : image.size) count *= static_cast<std::size_t>(n);
    if (bytes_.size() != count * sizeof(float)) return std::nullopt;
    image.values.resize(count);
    take(image.values.data(), bytes_.size());
    return image;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

/// Whether the image lies somewhere that a patient can.
Result<void> check_geometry(const fs::path& path, const ImageFile& image) {
  constexpr double kFurthest_mm = 1e5;
  for (const int n : image.size) {
    if (n < 1) return refused(Errc::bad_value, path, "holds no voxels; export it again");
  }
  if (!image.origin_mm.allFinite() || image.origin_mm.cwiseAbs().maxCoeff() > kFurthest_mm) {
    return refused(Errc::bad_value, path, "has no sensible place in the patient; export it again");
  }
  if (!image.spacing_mm.allFinite() || !(image.spacing_mm.minCoeff() > 0) ||
      image.spacing_mm.maxCoeff() > kFurthest_mm) {
    return refused(Errc::bad_value, path, "has no sensible voxel spacing; export it again");
  }
  if (!image.axes.allFinite() || !(image.axes.transpose() * image.axes).isIdentity(1e-3)) {
    return refused(Errc::unsupported, path, "its axes are sheared or have no length; resample it first");
  }
  return {};
}

}  // namespace

Error refused(Errc code, const fs::path& path, const std::string& why) {
  return {code, fmt::format("{}: {}", path.string(), why)};
}

Result<ImageFile> read_image(const fs::path& path, int components) {
  std::error_code error;
  if (!fs::exists(path, error)) return refused(Errc::not_found, path, "no such file or folder");
  if (!fs::is_directory(path, error)) {
    if (!fs::is_regular_file(path, error)) {
      return refused(Errc::unsupported, path, "is neither a file nor a folder; save it as a file first");
    }
    if (!std::ifstream(path)) return refused(Errc::unreadable, path, "cannot be opened; check its permissions");
  }
  constexpr Duration kLongest = Duration::from_ms(300'000);
  const auto work = [&](const Send& send) {
    const auto image =
        decode(path, components, [&send](const fs::path& file) { send_text(send, Record::reading, 0, file.string()); });
    if (image) {
      send_image(send, *image);
    } else {
      send_text(send, Record::error, static_cast<std::int32_t>(image.error().code), image.error().what);
    }
  };
  try {
    const auto outcome = run_isolated(work, kLongest);
    if (!outcome) return outcome.error();
    Records records(outcome->bytes);
    fs::path reading = path;
    Record kind{};
    while (records.take(&kind, sizeof kind)) {
      if (kind == Record::image) {
        auto image = records.take_image();
        if (!image) break;
        if (auto sound = check_geometry(path, *image); !sound) return sound.error();
        return *std::move(image);
      }
      auto told = records.take_text();
      if (!told) break;
      if (kind == Record::error) return *std::move(told);
      reading = told->what;
    }
    return refused(Errc::bad_format, reading, "is cut short, damaged, or too large to decode; copy it again");
  } catch (const std::bad_alloc&) {
    return refused(Errc::io, path, "needs more memory than there is; close other programs, or resample it");
  }
}

}  // namespace birdseye::host
