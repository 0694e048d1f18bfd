#include "host/dicom/jpeg2000.hpp"

#include <gdcmDataElement.h>
#include <gdcmJPEG2000Codec.h>
#include <gdcmPhotometricInterpretation.h>
#include <gdcmPixelFormat.h>
#include <gdcmSequenceOfFragments.h>

namespace birdseye::host {

std::optional<std::vector<std::uint8_t>> decode_jpeg2000(std::span<const std::uint8_t> stream, int columns, int rows,
                                                         const PixelBits& bits) {
  gdcm::Fragment fragment;
  std::vector<char> bytes(stream.begin(), stream.end());
  if (bytes.size() % 2 != 0) bytes.push_back(0);
  fragment.SetByteValue(bytes.data(), gdcm::VL(static_cast<std::uint32_t>(bytes.size())));
  gdcm::DataElement packed(gdcm::Tag(0x7FE0, 0x0010)), plain;
  packed.SetVR(gdcm::VR::OB);
  auto* const fragments = new gdcm::SequenceOfFragments;
  packed.SetValue(*fragments);  // and owns them from here: it counts references
  fragments->AddFragment(fragment);

  gdcm::JPEG2000Codec codec;
  const unsigned size[] = {static_cast<unsigned>(columns), static_cast<unsigned>(rows), 1};
  codec.SetNumberOfDimensions(2);
  codec.SetDimensions(size);
  codec.SetPlanarConfiguration(0);
  codec.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  codec.SetPixelFormat(gdcm::PixelFormat(
      1, static_cast<unsigned short>(bits.allocated), static_cast<unsigned short>(bits.stored),
      static_cast<unsigned short>(bits.stored - 1), static_cast<unsigned short>(bits.is_signed ? 1 : 0)));
  if (!codec.Decode(packed, plain) || plain.GetByteValue() == nullptr) return std::nullopt;
  const gdcm::ByteValue& value = *plain.GetByteValue();
  const auto due =
      static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) * static_cast<std::size_t>(bits.allocated / 8);
  if (value.GetLength() < due) return std::nullopt;
  const auto* first = reinterpret_cast<const std::uint8_t*>(value.GetPointer());
  return std::vector<std::uint8_t>(first, first + due);
}

}  // namespace birdseye::host
