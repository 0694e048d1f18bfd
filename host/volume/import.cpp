#include "host/volume/import.hpp"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <string>

#include "host/volume/decode.hpp"
#include "host/volume/isolated.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// What the copy of this process sends of itself: the file it is about to read, how it failed, or the volume.
enum class Record : std::uint8_t { reading = 'r', error = 'e', volume = 'v' };

using Send = std::function<void(const void* data, std::size_t size)>;

void send_text(const Send& send, Record kind, std::int32_t code, const std::string& text) {
  const auto length = static_cast<std::uint32_t>(text.size());
  send(&kind, sizeof kind);
  send(&code, sizeof code);
  send(&length, sizeof length);
  send(text.data(), text.size());
}

void send_volume(const Send& send, const Volume& volume) {
  const Record kind = Record::volume;
  send(&kind, sizeof kind);
  send(volume.size.data(), sizeof volume.size);
  send(volume.spacing_mm.data(), 3 * sizeof(double));
  send(volume.patient_from_voxel.matrix().data(), 16 * sizeof(double));
  send(volume.hu.data(), volume.hu.size() * sizeof(std::int16_t));
}

Result<Volume> decode(const fs::path& path, const Announce& announce) {
  std::error_code error;
  if (fs::is_directory(path, error)) return decode_dicom_folder(path, announce);
  announce(path);
  return is_dicom(path) ? decode_dicom_file(path, announce) : decode_image_file(path, announce);
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

  std::optional<Volume> take_volume() {
    Volume volume;
    if (!take(volume.size.data(), sizeof volume.size) || !take(volume.spacing_mm.data(), 3 * sizeof(double)) ||
        !take(volume.patient_from_voxel.matrix().data(), 16 * sizeof(double))) {
      return std::nullopt;
    }
    volume.hu.resize(bytes_.size() / sizeof(std::int16_t));
    take(volume.hu.data(), bytes_.size());
    const auto last =
        volume.size[2] < 1 ? 0 : volume.index(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1) + 1;
    if (volume.hu.empty() || volume.hu.size() != last) return std::nullopt;
    return volume;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

}  // namespace

Result<Volume> import_volume(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return refused(Errc::not_found, path, "no such file or folder");
  if (!fs::is_directory(path, error) && !std::ifstream(path)) {
    return refused(Errc::unreadable, path, "cannot be opened; check its permissions");
  }
  constexpr Duration kLongest = Duration::from_ms(300'000);
  const auto outcome = run_isolated(
      [&path](const Send& send) {
        const auto volume =
            decode(path, [&send](const fs::path& file) { send_text(send, Record::reading, 0, file.string()); });
        if (volume) {
          send_volume(send, *volume);
        } else {
          send_text(send, Record::error, static_cast<std::int32_t>(volume.error().code), volume.error().what);
        }
      },
      kLongest);
  if (!outcome) return outcome.error();
  Records records(outcome->bytes);
  fs::path reading = path;
  Record kind{};
  while (records.take(&kind, sizeof kind)) {
    if (kind == Record::volume) {
      if (auto volume = records.take_volume()) return *std::move(volume);
      break;
    }
    auto told = records.take_text();
    if (!told) break;
    if (kind == Record::error) return *std::move(told);
    reading = told->what;
  }
  return refused(Errc::bad_format, reading, "is cut short, damaged, or too large to decode; copy it again");
}

}  // namespace birdseye::host
