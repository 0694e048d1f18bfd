#include "host/dicom/dicom_pixels.hpp"

#include <dcmtk/dcmdata/dcfcache.h>
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>

#include <cmath>
#include <cstring>
#include <limits>

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

/// Offsets in the pixel sequence at which frames begin, by its first item; empty where it has none.
std::vector<std::uint32_t> frame_offsets(DcmPixelSequence& sequence) {
  DcmPixelItem* table = nullptr;
  Uint8* bytes = nullptr;
  if (sequence.getItem(table, 0).bad() || table->getUint8Array(bytes).bad() || bytes == nullptr) return {};
  std::vector<std::uint32_t> offsets(table->getLength() / 4);
  std::memcpy(offsets.data(), bytes, offsets.size() * 4);
  return offsets;
}

/// The bytes of one frame of a pixel sequence: of its own fragment where there are as many as frames, else of those
/// between its offset and the next frame's.
std::vector<std::uint8_t> frame_bytes(DcmPixelSequence& sequence, int frame, int frames) {
  const auto offsets = frame_offsets(sequence);
  const unsigned long fragments = sequence.card() - 1;
  const auto wanted = static_cast<unsigned long>(frame);
  std::vector<std::uint8_t> stream;
  std::uint64_t at = 0;
  for (unsigned long i = 0; i < fragments; ++i) {
    DcmPixelItem* item = nullptr;
    if (sequence.getItem(item, i + 1).bad() || item == nullptr) return {};
    const std::uint64_t begins = at;
    at += item->getLength() + 8;  // with its tag and length
    bool own = frames == 1 || (fragments == static_cast<unsigned long>(frames) && i == wanted);
    if (frames > 1 && fragments != static_cast<unsigned long>(frames)) {
      if (offsets.size() != static_cast<std::size_t>(frames)) return {};
      own = begins >= offsets[wanted] && (wanted + 1 == offsets.size() || begins < offsets[wanted + 1]);
    }
    Uint8* bytes = nullptr;
    if (!own || item->getUint8Array(bytes).bad() || bytes == nullptr) continue;
    stream.insert(stream.end(), bytes, bytes + item->getLength());
  }
  return stream;
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
  DcmPixelSequence* sequence = nullptr;  ///< where it is JPEG 2000, which DCMTK does not decode
  DcmFileCache cache;
  PixelBits bits;
  int high_bit = 15, frames = 1;
  Uint32 next_fragment = 0;
  int next_frame = 0;

  /// Of one frame, as stored.
  std::optional<std::vector<std::uint8_t>> frame(const DicomSlice& slice);
};

std::optional<std::vector<std::uint8_t>> DicomPixels::Open::frame(const DicomSlice& slice) {
  if (sequence != nullptr) {
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
    if (open_->pixels != nullptr && is_jpeg2000(dataset.getOriginalXfer())) {
      open_->pixels->getEncapsulatedRepresentation(dataset.getOriginalXfer(), nullptr, open_->sequence);
    }
  }
  const PixelBits& bits = open_->bits;
  const std::string undecoded = fmt::format("its pixels cannot be decoded; export it again, uncompressed ({})",
                                            DcmXfer(open_->file->getDataset()->getOriginalXfer()).getXferName());
  const bool sound = open_->pixels != nullptr && (bits.allocated == 8 || bits.allocated == 16) && bits.stored > 0 &&
                     bits.stored <= bits.allocated && open_->high_bit >= bits.stored - 1 &&
                     open_->high_bit < bits.allocated;
  if (!sound) return refused(Errc::unreadable, path, undecoded);
  const auto bytes = open_->frame(slice);
  if (!bytes) return refused(Errc::unreadable, path, undecoded);
  // Other bits of a pixel may hold overlays; JPEG 2000 leaves none.
  const int shift = open_->sequence != nullptr ? 0 : open_->high_bit + 1 - bits.stored;
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
