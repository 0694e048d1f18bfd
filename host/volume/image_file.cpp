#include "host/volume/image_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <new>
#include <optional>
#include <string>

#include "host/volume/decode.hpp"
#include "host/volume/isolated.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// What the copy of this process sends of itself: the file it is about to read, how it failed, or the image.
enum class MessageKind : std::uint8_t { reading = 'r', error = 'e', image = 'i' };

void send_text(const Send& send, MessageKind kind, std::int32_t code, const std::string& text) {
  const auto length = static_cast<std::uint32_t>(text.size());
  send(&kind, sizeof kind);
  send(&code, sizeof code);
  send(&length, sizeof length);
  send(text.data(), text.size());
}

void send_image(const Send& send, const ImageFile& image) {
  const MessageKind kind = MessageKind::image;
  send(&kind, sizeof kind);
  send(image.size.data(), sizeof image.size);
  send(image.spacing_mm.data(), 3 * sizeof(double));
  send(image.origin_mm.data(), 3 * sizeof(double));
  send(image.axes.data(), 9 * sizeof(double));
  send(image.hu.data(), image.hu.size() * sizeof image.hu[0]);
  send(image.values.data(), image.values.size() * sizeof image.values[0]);
}

Result<ImageFile> decode(const fs::path& path, int components, const Announce& announce) {
  std::error_code error;
  if (fs::is_directory(path, error)) return decode_dicom_folder(path, announce);
  announce(path);
  return is_dicom(path) ? decode_dicom_file(path, announce) : decode_image_file(path, components);
}

std::optional<Error> receive_text(const Receive& receive) {
  constexpr std::uint32_t kLongest = 1 << 16;
  std::int32_t code = 0;
  std::uint32_t length = 0;
  if (!receive(&code, sizeof code) || !receive(&length, sizeof length) || length > kLongest) return std::nullopt;
  Error told{static_cast<Errc>(code), std::string(length, ' ')};
  if (!receive(told.what.data(), length)) return std::nullopt;
  return told;
}

std::optional<ImageFile> receive_image(const Receive& receive, int components) {
  ImageFile image;
  image.components = components;
  if (!receive(image.size.data(), sizeof image.size) || !receive(image.spacing_mm.data(), 3 * sizeof(double)) ||
      !receive(image.origin_mm.data(), 3 * sizeof(double)) || !receive(image.axes.data(), 9 * sizeof(double))) {
    return std::nullopt;
  }
  constexpr int kMost = 65535;
  std::size_t count = static_cast<std::size_t>(components);
  for (const int n : image.size) {
    if (n < 0 || n > kMost) return std::nullopt;
    count *= static_cast<std::size_t>(n);
  }
  if (components == 1) {
    auto hu = receive_values<std::int16_t>(receive, count);
    if (!hu) return std::nullopt;
    image.hu = *std::move(hu);
  } else {
    auto values = receive_values<float>(receive, count);
    if (!values) return std::nullopt;
    image.values = *std::move(values);
  }
  return image;
}

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

Result<ImageFile> read_image(const fs::path& path, int components, const std::stop_token& stop) {
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
    const auto image = decode(
        path, components, [&send](const fs::path& file) { send_text(send, MessageKind::reading, 0, file.string()); });
    if (image && image->components != components) {
      const Error other = refused(Errc::unsupported, path, "is a CT; give a displacement field");
      send_text(send, MessageKind::error, static_cast<std::int32_t>(other.code), other.what);
    } else if (image) {
      send_image(send, *image);
    } else {
      send_text(send, MessageKind::error, static_cast<std::int32_t>(image.error().code), image.error().what);
    }
  };
  fs::path reading = path;
  std::optional<Result<ImageFile>> read;
  const auto take = [&](const Receive& receive) {
    MessageKind kind{};
    while (!read && receive(&kind, sizeof kind)) {
      if (kind == MessageKind::image) {
        if (auto image = receive_image(receive, components)) read = *std::move(image);
        return;
      }
      auto told = receive_text(receive);
      if (!told) return;
      if (kind == MessageKind::error) {
        read = *std::move(told);
      } else {
        reading = told->what;
      }
    }
  };
  try {
    const auto ran = run_isolated(work, take, kLongest, stop);
    if (stop.stop_requested()) return refused(Errc::disconnected, path, "was not read: cancelled");
    if (!read) {
      if (!ran && ran.error().code == Errc::io) return refused(Errc::io, path, ran.error().what);
      if (!ran && ran.error().code == Errc::timeout) {
        return refused(Errc::timeout, reading,
                       fmt::format("its decoder {} after {:.0f} s; copy it again, to a disk of this machine",
                                   ran.error().what, kLongest.seconds()));
      }
      return refused(Errc::bad_format, reading,
                     fmt::format("is cut short, damaged, or too large to decode{}; copy it again",
                                 ran ? "" : fmt::format(" (its decoder {})", ran.error().what)));
    }
    if (!*read) return read->error();
    if (auto sound = check_geometry(path, **read); !sound) return sound.error();
    return *std::move(*read);
  } catch (const std::bad_alloc&) {
    return refused(Errc::io, path, "needs more memory than there is; close other programs, or resample it");
  }
}

}  // namespace birdseye::host
