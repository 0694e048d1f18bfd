#pragma once

#include <igtl_util.h>

#include <Eigen/Geometry>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Messages of a server that nobody of ours wrote, byte by byte as the OpenIGTLink standard has them; their checksum is
/// by the protocol's own library.
namespace birdseye::testing {

using Bytes = std::vector<std::uint8_t>;

inline void put(Bytes& out, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
inline void put_float(Bytes& out, double value) {
  put(out, std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4);
}
inline void put_text(Bytes& out, std::string_view text, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) out.push_back(i < text.size() ? static_cast<std::uint8_t>(text[i]) : 0);
}

/// How the bodies are wrapped, and when they are stamped: 0 is no time.
struct Envelope {
  std::int64_t stamp_ns = 0;
  unsigned version = 1;
  std::vector<std::pair<std::string, std::string>> meta_data = {{"Status", "OK"}};  ///< from version 2 on
};

inline Bytes foreign_message(std::string_view type, std::string_view device, const Envelope& envelope,
                             const Bytes& content) {
  Bytes body;
  if (envelope.version >= 2) {
    std::size_t texts = 0;
    for (const auto& [key, value] : envelope.meta_data) texts += key.size() + value.size();
    put(body, 12, 2);                                 // this extended header
    put(body, 2 + 8 * envelope.meta_data.size(), 2);  // an index
    put(body, texts, 4);
    put(body, 7, 4);  // an id
  }
  body.insert(body.end(), content.begin(), content.end());
  if (envelope.version >= 2) {
    put(body, envelope.meta_data.size(), 2);
    for (const auto& [key, value] : envelope.meta_data) {
      put(body, key.size(), 2);
      put(body, 3, 2);  // of the value: US-ASCII
      put(body, value.size(), 4);
    }
    for (const auto& [key, value] : envelope.meta_data) put_text(body, key + value, key.size() + value.size());
  }
  Bytes out;
  put(out, envelope.version, 2);
  put_text(out, type, 12);
  put_text(out, device, 20);
  const auto ns = static_cast<std::uint64_t>(envelope.stamp_ns);
  put(out, ns / 1'000'000'000, 4);
  put(out, ((ns % 1'000'000'000 << 32U) + 500'000'000) / 1'000'000'000, 4);
  put(out, body.size(), 8);
  put(out, crc64(body.data(), body.size(), 0), 8);
  out.insert(out.end(), body.begin(), body.end());
  return out;
}

inline void put_matrix(Bytes& out, const Eigen::Isometry3d& pose) {
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) put_float(out, pose.matrix()(row, column));
  }
}

inline Bytes transform_message(std::string_view device, const Envelope& envelope, const Eigen::Isometry3d& pose) {
  Bytes content;
  put_matrix(content, pose);
  return foreign_message("TRANSFORM", device, envelope, content);
}

/// A picture, its matrix that of an image which lies mirrored and askew in a room.
struct ForeignImage {
  int width = 4, height = 3, slices = 1, components = 3;
  int scalar_type = 3, scalar_bytes = 1;  ///< 3: 8 bits without a sign; 4: 16 with
  std::uint8_t first = 0;                 ///< of the pixels, which count up from it
};

inline Bytes image_message(std::string_view device, const Envelope& envelope, const ForeignImage& image) {
  Bytes content;
  put(content, 1, 2);
  put(content, static_cast<unsigned>(image.components), 1);
  put(content, static_cast<unsigned>(image.scalar_type), 1);
  put(content, 2, 1);  // little endian
  put(content, 1, 1);  // RAS
  for (const int size : {image.width, image.height, image.slices}) put(content, static_cast<unsigned>(size), 2);
  for (const double value : {-0.2, 0.0, 0.0, 0.0, 0.0, -0.3, 0.0, -1.0, 0.0, 10.0, 20.0, 30.0})
    put_float(content, value);
  for (int i = 0; i < 3; ++i) put(content, 0, 2);
  for (const int size : {image.width, image.height, image.slices}) put(content, static_cast<unsigned>(size), 2);
  const int bytes = image.width * image.height * image.slices * image.components * image.scalar_bytes;
  for (int i = 0; i < bytes; ++i) content.push_back(static_cast<std::uint8_t>(image.first + i));
  return foreign_message("IMAGE", device, envelope, content);
}

}  // namespace birdseye::testing
