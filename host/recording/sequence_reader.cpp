#include "host/recording/sequence_reader.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <sstream>

#include "host/files/frame_size.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

Error refused(Errc code, const fs::path& path, const std::string& why) {
  return {code, fmt::format("{}: {}", path.string(), why)};
}

}  // namespace

/// The bytes of all frames, one after the other.
struct SequenceReader::Pixels {
  std::ifstream in;
  std::uint64_t begin = 0;
  bool compressed = false;
  std::uint64_t at = 0;  ///< that the next byte decompressed is
  z_stream zip{};
  std::vector<std::uint8_t> chunk = std::vector<std::uint8_t>(1U << 18U);

  ~Pixels() {
    if (compressed) ::inflateEnd(&zip);
  }

  /// From the first frame on, again.
  void rewind() {
    in.clear();
    in.seekg(static_cast<std::streamoff>(begin));
    at = 0;
    if (!compressed) return;
    ::inflateReset(&zip);
    zip.avail_in = 0;
  }

  /// The next bytes; fewer where the file ends or is damaged.
  std::size_t inflate_to(std::uint8_t* to, std::size_t size) {
    zip.next_out = to;
    zip.avail_out = static_cast<uInt>(size);
    while (zip.avail_out > 0) {
      if (zip.avail_in == 0) {
        in.read(reinterpret_cast<char*>(chunk.data()), static_cast<std::streamsize>(chunk.size()));
        zip.next_in = chunk.data();
        zip.avail_in = static_cast<uInt>(in.gcount());
        if (zip.avail_in == 0) break;
      }
      if (::inflate(&zip, Z_NO_FLUSH) != Z_OK) break;
    }
    const std::size_t got = size - zip.avail_out;
    at += got;
    return got;
  }

  bool read(std::uint64_t offset, std::vector<std::uint8_t>& to) {
    if (!compressed) {
      in.clear();
      in.seekg(static_cast<std::streamoff>(begin + offset));
      in.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(to.size()));
      return static_cast<std::size_t>(in.gcount()) == to.size();
    }
    if (offset < at) rewind();
    while (at < offset) {
      if (inflate_to(to.data(), static_cast<std::size_t>(std::min<std::uint64_t>(to.size(), offset - at))) == 0)
        return false;
    }
    return inflate_to(to.data(), to.size()) == to.size();
  }
};

SequenceReader::SequenceReader(fs::path path, SequenceHeader header)
    : path_(std::move(path)), header_(std::move(header)) {}
SequenceReader::SequenceReader(SequenceReader&&) noexcept = default;
SequenceReader& SequenceReader::operator=(SequenceReader&&) noexcept = default;
SequenceReader::~SequenceReader() = default;

Result<SequenceReader> SequenceReader::open(const fs::path& path) {
  auto header = read_sequence_header(path);
  if (!header) return header.error();
  SequenceReader reader(path, *std::move(header));
  if (auto taken = reader.take_layout(); !taken) return taken.error();
  if (auto found = reader.find_pixels(); !found) return found.error();
  return reader;
}

Result<void> SequenceReader::take_layout() {
  const auto& fields = header_.fields;
  if (value_of(fields, "ObjectType") != "Image" || !header_.whole)
    return refused(Errc::bad_format, path_, "is no MetaImage sequence, or its header is cut short; give a .igs.mha");
  std::istringstream size{std::string(value_of(fields, "DimSize"))};
  std::int64_t width = -1, height = -1, count = -1;
  size >> width >> height >> count;
  constexpr std::int64_t kMostPx = 16384, kMostFrames = 100'000'000;
  if (!size || width < 0 || height < 0 || count < 0 || width > kMostPx || height > kMostPx || count > kMostFrames) {
    return refused(Errc::bad_format, path_,
                   fmt::format("DimSize = {} is no width, height and count", value_of(fields, "DimSize")));
  }
  told_ = static_cast<std::size_t>(count);
  const std::string_view type = value_of(fields, "ElementType"), channels = value_of(fields, "ElementNumberOfChannels");
  if (width == 0 || height == 0 || type == "MET_OTHER") return {};
  if (type != "MET_UCHAR" || !(channels.empty() || channels == "1" || channels == "3")) {
    return refused(Errc::unsupported, path_,
                   fmt::format("pixels of {} {} where 8 bits, grey or RGB (MET_UCHAR, 1 or 3 channels), are read",
                               channels.empty() ? "1" : channels, type));
  }
  if (!is_frame_size(width, height)) {
    return refused(Errc::unsupported, path_,
                   fmt::format("its frames are {}x{} px, more than a camera's {} px at most; record or write it anew "
                               "with smaller pictures",
                               width, height, kMostFramePixels));
  }
  channels_ = channels == "3" ? 3 : 1;
  // Marked or unmarked side first, far or near row first, as PLUS names them; a third letter is of volumes.
  const std::string_view orientation = value_of(fields, "UltrasoundImageOrientation");
  const bool known = orientation.empty() || orientation.starts_with("XX") ||
                     (orientation.size() >= 2 && (orientation[0] == 'M' || orientation[0] == 'U') &&
                      (orientation[1] == 'F' || orientation[1] == 'N'));
  if (!known) {
    return refused(Errc::unsupported, path_,
                   fmt::format("its pictures' orientation is {} where MF, UF, MN or UN are read", orientation));
  }
  mirrored_ = orientation.starts_with('U');
  from_below_ = orientation.size() >= 2 && orientation[1] == 'N';
  width_px_ = static_cast<int>(width);
  height_px_ = static_cast<int>(height);
  return {};
}

Result<void> SequenceReader::find_pixels() {
  if (width_px_ == 0) return {};
  const std::string named(value_of(header_.fields, "ElementDataFile"));
  const fs::path file = named == "LOCAL" ? path_ : path_.parent_path() / named;
  std::error_code ignored;
  pixels_ = std::make_unique<Pixels>();
  pixels_->begin = named == "LOCAL" ? header_.data_offset : 0;
  pixels_->in.open(file, std::ios::binary);
  if (named.empty() || fs::path(named).has_parent_path() || !pixels_->in || !fs::is_regular_file(file, ignored))
    return refused(Errc::not_found, path_, fmt::format("the file of its pixels, \"{}\", is not beside it", named));
  if (!value_of(header_.fields, "BinaryData").empty() && !says_true(header_.fields, "BinaryData")) {
    return refused(Errc::unsupported, path_,
                   "its pixels are text (BinaryData), which is not read; save it again with BinaryData = True");
  }
  pixels_->compressed = says_true(header_.fields, "CompressedData");
  if (pixels_->compressed && ::inflateInit(&pixels_->zip) != Z_OK)
    return refused(Errc::io, path_, "cannot be decompressed; is there memory left?");
  const auto frame_bytes = static_cast<std::uint64_t>(channels_) * static_cast<std::uint64_t>(width_px_) *
                           static_cast<std::uint64_t>(height_px_);
  pixels_->rewind();
  const std::uint64_t size = fs::file_size(file, ignored);
  const std::uint64_t there = size > pixels_->begin ? size - pixels_->begin : 0;
  // A compressed file may unpack to a thousand times its size: read() finds its end, frame by frame.
  whole_ = pixels_->compressed ? told_ : static_cast<std::size_t>(std::min<std::uint64_t>(told_, there / frame_bytes));
  more_ = !pixels_->compressed && there > (told_ + 1) * frame_bytes;
  return {};
}

Result<std::vector<std::uint8_t>> SequenceReader::read(std::size_t index) {
  const auto missing = [&] {
    return refused(Errc::bad_format, path_,
                   fmt::format("has no frame {}: {} of {} frames are whole", index, whole_, told_));
  };
  if (index >= whole_) return missing();
  const auto width = static_cast<std::size_t>(width_px_), height = static_cast<std::size_t>(height_px_);
  const auto channels = static_cast<std::size_t>(channels_);
  std::vector<std::uint8_t> bytes(width * height * channels);
  if (!pixels_->read(index * bytes.size(), bytes)) {
    if (!pixels_->compressed)
      return refused(Errc::unreadable, path_, fmt::format("frame {} cannot be read any more", index));
    whole_ = static_cast<std::size_t>(pixels_->at / bytes.size());
    return missing();
  }
  if (channels == 3 && !mirrored_ && !from_below_) return bytes;
  std::vector<std::uint8_t> rgb(width * height * 3);
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t from = (from_below_ ? height - 1 - y : y) * width + (mirrored_ ? width - 1 - x : x);
      for (std::size_t c = 0; c < 3; ++c)
        rgb[3 * (y * width + x) + c] = bytes[channels * from + (channels == 3 ? c : 0)];
    }
  }
  return rgb;
}

}  // namespace birdseye::host
