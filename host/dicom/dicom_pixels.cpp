#include "host/dicom/dicom_pixels.hpp"

#include <dcmtk/dcmdata/dcfcache.h>
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "host/dicom/dicom_dataset.hpp"
#include "host/dicom/jpeg2000.hpp"
#include "host/dicom/refused.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

void register_codecs() {
  static const bool once = [] {
    DcmRLEDecoderRegistration::registerCodecs();
    DJDecoderRegistration::registerCodecs();
    DJLSDecoderRegistration::registerCodecs();
    return true;
  }();
  (void)once;
}

bool is_jpeg2000(E_TransferSyntax syntax) {
  return syntax == EXS_JPEG2000LosslessOnly || syntax == EXS_JPEG2000;
}

/// The bytes of one item of a pixel sequence, as long as the sequence is there; none where it cannot be read.
std::span<const std::uint8_t> item_bytes(DcmPixelSequence& sequence, unsigned long index) {
  DcmPixelItem* item = nullptr;
  Uint8* bytes = nullptr;
  if (sequence.getItem(item, index).bad() || item == nullptr || item->getUint8Array(bytes).bad() || bytes == nullptr)
    return {};
  return {bytes, item->getLength()};
}

/// Offsets in the pixel sequence at which frames begin, by its first item; empty where it has none.
std::vector<std::uint32_t> frame_offsets(DcmPixelSequence& sequence) {
  const auto bytes = item_bytes(sequence, 0);
  if (bytes.empty()) return {};
  std::vector<std::uint32_t> offsets(bytes.size() / 4);
  std::memcpy(offsets.data(), bytes.data(), offsets.size() * 4);
  return offsets;
}

/// The bytes of one frame of a pixel sequence: of its own fragment where there are as many as frames, else of those
/// between its offset and the next frame's.
std::vector<std::uint8_t> frame_bytes(DcmPixelSequence& sequence, int frame, int frames) {
  const unsigned long fragments = sequence.card() - 1;
  const auto wanted = static_cast<unsigned long>(frame);
  if (fragments == static_cast<unsigned long>(frames)) {
    const auto own = item_bytes(sequence, wanted + 1);
    return {own.begin(), own.end()};
  }
  const auto offsets = frame_offsets(sequence);
  std::vector<std::uint8_t> stream;
  std::uint64_t at = 0;
  for (unsigned long i = 1; i <= fragments; ++i) {
    DcmPixelItem* item = nullptr;
    if (sequence.getItem(item, i).bad() || item == nullptr) return {};
    const std::uint64_t begins = at;
    at += item->getLength() + 8;  // with its tag and length
    bool own = frames == 1;
    if (frames > 1) {
      if (offsets.size() != static_cast<std::size_t>(frames)) return {};
      own = begins >= offsets[wanted] && (wanted + 1 == offsets.size() || begins < offsets[wanted + 1]);
    }
    if (!own) continue;
    const auto bytes = item_bytes(sequence, i);
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  }
  return stream;
}

/// Columns and rows.
using PixelExtent = std::pair<int, int>;

int two_bytes(std::span<const std::uint8_t> stream, std::size_t at) {
  return stream[at] << 8 | stream[at + 1];
}

/// That a JPEG or JPEG-LS says it has, in its start of frame; none where the stream has no such.
std::optional<PixelExtent> size_of_jpeg(std::span<const std::uint8_t> stream) {
  constexpr int kMarker = 0xFF, kStartOfImage = 0xD8, kHuffmanTables = 0xC4, kReserved = 0xC8, kArithmetic = 0xCC,
                kJpegLs = 0xF7, kStartOfScan = 0xDA;
  std::size_t at = 0;
  while (at + 9 <= stream.size() && stream[at] == kMarker) {
    const int kind = stream[at + 1];
    if (kind == kMarker || kind == kStartOfImage) {  // a byte that fills up, or a marker without a length
      at += kind == kMarker ? 1 : 2;
      continue;
    }
    const bool starts_frame = kind == kJpegLs || (kind >= 0xC0 && kind <= 0xCF && kind != kHuffmanTables &&
                                                  kind != kReserved && kind != kArithmetic);
    if (starts_frame) return PixelExtent{two_bytes(stream, at + 7), two_bytes(stream, at + 5)};
    if (kind == kStartOfScan) break;
    at += 2 + static_cast<std::size_t>(two_bytes(stream, at + 2));
  }
  return std::nullopt;
}

/// That a JPEG 2000 codestream says it has, whatever a file format puts before it; none where there is no such.
std::optional<PixelExtent> size_of_jpeg2000(std::span<const std::uint8_t> stream) {
  constexpr std::array<std::uint8_t, 4> kStart{0xFF, 0x4F, 0xFF, 0x51};
  const auto found = std::search(stream.begin(), stream.end(), kStart.begin(), kStart.end());
  if (stream.end() - found < 24) return std::nullopt;
  const auto at = static_cast<std::size_t>(found - stream.begin());
  const auto number = [&](std::size_t i) {
    return std::int64_t{two_bytes(stream, at + 8 + 4 * i)} << 16 | two_bytes(stream, at + 10 + 4 * i);
  };
  const std::int64_t wide = number(0) - number(2), high = number(1) - number(3);
  if (wide < 1 || high < 1 || wide > kMostPixels || high > kMostPixels) return std::nullopt;
  return PixelExtent{static_cast<int>(wide), static_cast<int>(high)};
}

/// How many bytes the first segment of a stream of run lengths holds, which has a byte of each pixel; none where the
/// stream has no header.
std::optional<std::size_t> bytes_of_run_lengths(std::span<const std::uint8_t> stream) {
  constexpr std::size_t kHeaderBytes = 64;
  if (stream.size() < kHeaderBytes) return std::nullopt;
  const auto number = [&](std::size_t i) {
    std::uint32_t value = 0;
    for (std::size_t byte = 4; byte-- > 0;) value = value << 8U | stream[4 * i + byte];
    return std::size_t{value};
  };
  const std::size_t segments = number(0), end = segments > 1 ? std::min(number(2), stream.size()) : stream.size();
  std::size_t decoded = 0;
  for (std::size_t at = number(1); at < end;) {
    const std::size_t code = stream[at];
    const std::size_t taken = code < 128 ? 2 + code : code == 128 ? 1 : 2;
    if (taken > end - at) break;  // the byte that makes its length even
    decoded += code < 128 ? code + 1 : code == 128 ? 0 : 257 - code;
    at += taken;
  }
  return decoded;
}

/// Rounds scaled values to Hounsfield units. stored(i): the i-th stored value.
template <typename Stored>
Result<void> append_scaled(const fs::path& path, const DicomSlice& slice, std::size_t count, const Stored& stored,
                           std::vector<std::int16_t>& hu) {
  constexpr double kLeast = std::numeric_limits<std::int16_t>::min(), kMost = std::numeric_limits<std::int16_t>::max();
  const std::size_t had = hu.size();
  hu.resize(had + count);
  for (std::size_t i = 0; i < count; ++i) {
    const double value = slice.slope * stored(i) + slice.intercept;
    if (!(value >= kLeast && value <= kMost)) {
      return refused(Errc::bad_value, path,
                     fmt::format("has a value of {:g}, which is no Hounsfield unit; is it a CT?", value));
    }
    hu[had + i] = static_cast<std::int16_t>(value + std::copysign(0.5, value));
  }
  return {};
}

}  // namespace

/// The file of the last slice.
struct DicomPixels::Open {
  fs::path path;
  std::unique_ptr<DcmFileFormat> file;
  DcmPixelData* pixels = nullptr;
  DcmPixelSequence* sequence = nullptr;  ///< where the pixels are compressed
  E_TransferSyntax syntax = EXS_Unknown;
  DcmFileCache cache;
  PixelBits bits;
  int high_bit = 15, frames = 1;
  Uint32 next_fragment = 0;
  int next_frame = 0;

  [[nodiscard]] std::string undecoded() const;
  /// What is wrong with the size of a compressed frame: a decoder fills a part of a larger picture, and leaves out what
  /// a smaller one has no place for. Empty where nothing is.
  [[nodiscard]] std::string wrong_size(const DicomSlice& slice) const;
  /// Of one frame, as stored.
  std::optional<std::vector<std::uint8_t>> frame(const DicomSlice& slice);
};

std::string DicomPixels::Open::undecoded() const {
  return fmt::format("its pixels cannot be decoded; export it again, uncompressed ({})", DcmXfer(syntax).getXferName());
}

std::string DicomPixels::Open::wrong_size(const DicomSlice& slice) const {
  const auto said = [&slice](const std::string& held) {
    return fmt::format("its compressed picture is of {} where its Columns and Rows say {} x {}; export it again", held,
                       slice.columns, slice.rows);
  };
  const bool together = frames > 1 && sequence->card() - 1 != static_cast<unsigned long>(frames);
  if (syntax == EXS_RLELossless && together) return {};  // nothing says where a frame ends
  // Frames of several fragments are of one size, which the first of all says.
  const auto first = together ? item_bytes(*sequence, 1) : std::span<const std::uint8_t>();
  const auto stream = together ? std::vector(first.begin(), first.end()) : frame_bytes(*sequence, slice.frame, frames);
  if (syntax == EXS_RLELossless) {
    const auto held = bytes_of_run_lengths(stream);
    if (!held) return undecoded();
    const auto due = static_cast<std::size_t>(slice.columns) * static_cast<std::size_t>(slice.rows);
    const auto spare = static_cast<std::size_t>(std::min(slice.columns, slice.rows));
    return *held < due || *held >= due + spare ? said(fmt::format("{} pixels", *held)) : std::string();
  }
  const auto size = is_jpeg2000(syntax) ? size_of_jpeg2000(stream) : size_of_jpeg(stream);
  if (!size) return undecoded();
  return *size == PixelExtent{slice.columns, slice.rows} ? std::string()
                                                         : said(fmt::format("{} x {}", size->first, size->second));
}

std::optional<std::vector<std::uint8_t>> DicomPixels::Open::frame(const DicomSlice& slice) {
  if (is_jpeg2000(syntax)) {
    const auto stream = frame_bytes(*sequence, slice.frame, frames);
    if (stream.empty()) return std::nullopt;
    return decode_jpeg2000(stream, slice.columns, slice.rows, bits);
  }
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(slice.columns) * static_cast<std::size_t>(slice.rows) *
                                  static_cast<std::size_t>(bits.allocated / 8));
  bytes.resize((bytes.size() + 1) / 2 * 2);  // as DCMTK wants it
  OFString colours;
  Uint32 fragment = slice.frame == next_frame ? next_fragment : 0;
  const OFCondition read =
      pixels->getUncompressedFrame(file->getDataset(), static_cast<Uint32>(slice.frame), fragment, bytes.data(),
                                   static_cast<Uint32>(bytes.size()), colours, &cache);
  if (read.bad()) return std::nullopt;
  next_fragment = fragment;
  next_frame = slice.frame + 1;
  return bytes;
}

DicomPixels::DicomPixels() {
  register_codecs();
}

DicomPixels::~DicomPixels() = default;

Result<void> DicomPixels::append_hu(const fs::path& path, const DicomSlice& slice, std::vector<std::int16_t>& hu) {
  if (!open_ || open_->path != path) {
    auto loaded = load_dicom(path);
    if (!loaded) return loaded.error();
    open_ = std::make_unique<Open>();
    open_->path = path;
    open_->file = *std::move(loaded);
    DcmDataset& dataset = *open_->file->getDataset();
    DcmElement* element = nullptr;
    dataset.findAndGetElement(DCM_PixelData, element);
    open_->pixels = dynamic_cast<DcmPixelData*>(element);
    open_->bits.allocated = integer_of(dataset, DCM_BitsAllocated).value_or(16);
    open_->bits.stored = integer_of(dataset, DCM_BitsStored).value_or(open_->bits.allocated);
    open_->high_bit = integer_of(dataset, DCM_HighBit).value_or(open_->bits.stored - 1);
    open_->bits.is_signed = integer_of(dataset, DCM_PixelRepresentation).value_or(0) == 1;
    open_->frames = integer_of(dataset, DCM_NumberOfFrames).value_or(1);
    open_->syntax = dataset.getOriginalXfer();
    if (open_->pixels != nullptr && DcmXfer(open_->syntax).isEncapsulated())
      open_->pixels->getEncapsulatedRepresentation(open_->syntax, nullptr, open_->sequence);
  }
  const PixelBits& bits = open_->bits;
  const bool sound =
      open_->pixels != nullptr && (open_->sequence != nullptr) == bool{DcmXfer(open_->syntax).isEncapsulated()} &&
      (bits.allocated == 8 || bits.allocated == 16) && bits.stored > 0 && bits.stored <= bits.allocated &&
      open_->high_bit >= bits.stored - 1 && open_->high_bit < bits.allocated;
  if (!sound) return refused(Errc::unreadable, path, open_->undecoded());
  if (open_->sequence != nullptr) {
    if (const std::string wrong = open_->wrong_size(slice); !wrong.empty())
      return refused(Errc::unreadable, path, wrong);
  }
  const auto bytes = open_->frame(slice);
  if (!bytes) return refused(Errc::unreadable, path, open_->undecoded());
  // Other bits of a pixel may hold overlays; JPEG 2000 leaves none.
  const int shift = is_jpeg2000(open_->syntax) ? 0 : open_->high_bit + 1 - bits.stored;
  const int mask = (1 << bits.stored) - 1, sign = bits.is_signed ? 1 << (bits.stored - 1) : 0;
  const auto stored = [&, wide = bits.allocated == 16](std::size_t i) {
    std::uint16_t pixel = (*bytes)[i];
    if (wide) std::memcpy(&pixel, bytes->data() + 2 * i, 2);
    const int value = (pixel >> shift) & mask;
    return static_cast<double>((value ^ sign) - sign);
  };
  const auto count = static_cast<std::size_t>(slice.columns) * static_cast<std::size_t>(slice.rows);
  return append_scaled(path, slice, count, stored, hu);
}

}  // namespace birdseye::host
