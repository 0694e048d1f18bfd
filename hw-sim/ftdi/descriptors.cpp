#include "hw-sim/ftdi/descriptors.hpp"

#include <bit>
#include <string>

namespace birdseye::hw_sim {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t kDevice = 1, kConfiguration = 2, kString = 3;

Bytes string_descriptor(const std::string& text) {
  Bytes bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), kString};
  for (const char c : text) {
    bytes.push_back(static_cast<std::uint8_t>(c));
    bytes.push_back(0);
  }
  return bytes;
}

}  // namespace

std::optional<Bytes> descriptor(std::uint8_t type, std::uint8_t index, const Ft232rSettings& settings) {
  if (type == kDevice) {
    return Bytes{18,   kDevice, 0x00, 0x02, 0, 0, 0, 8,  // USB 2.0; packets of 8 bytes at the control endpoint
                 0x03, 0x04,    0x01, 0x60,              // 0403:6001
                 0x00, 0x06,                             // an FT232R
                 1,    2,       3,    1};                // its strings; one configuration
  }
  if (type == kConfiguration && index == 0) {
    return Bytes{9,    kConfiguration,
                 32,   0,
                 1,    1,
                 0,    0xA0,
                 45,  // powered by the bus, 90 mA
                 9,    4,
                 0,    0,
                 2,    0xFF,
                 0xFF, 0xFF,
                 2,  // one interface of the vendor's own kind
                 7,    5,
                 0x81, 2,
                 64,   0,
                 0,  // bulk in
                 7,    5,
                 0x02, 2,
                 64,   0,
                 0};  // bulk out
  }
  if (type == kString && index == 0) return Bytes{4, kString, 0x09, 0x04};  // there is English
  if (type == kString && index == 1) return string_descriptor(settings.manufacturer);
  if (type == kString && index == 2) return string_descriptor(settings.product);
  if (type == kString && index == 3) return string_descriptor(settings.serial);
  return std::nullopt;
}

std::array<std::uint16_t, 64> eeprom_of(const Ft232rSettings& settings) {
  // Lights and clock outputs on the five spare pins, as the maker delivers it: none of them is free for use as GPIO.
  std::array<std::uint16_t, 64> words{0x4000, 0x0403, 0x6001, 0x0600, 0x2DA0, 0x0008, 0, 0, 0, 0, 0x1023, 0x0005};
  std::size_t word = 12, entry = 7;
  for (const std::string* text : {&settings.manufacturer, &settings.product, &settings.serial}) {
    const Bytes bytes = string_descriptor(*text);
    if (word + bytes.size() / 2 >= words.size()) break;  // the last word is the checksum's
    words[entry++] = static_cast<std::uint16_t>(bytes.size() << 8U | (0x80U + 2 * word));
    for (std::size_t i = 0; i < bytes.size(); i += 2)
      words[word++] = static_cast<std::uint16_t>(bytes[i] | bytes[i + 1] << 8U);
  }
  std::uint16_t checksum = 0xAAAA;
  for (std::size_t i = 0; i + 1 < words.size(); ++i)
    checksum = std::rotl(static_cast<std::uint16_t>(checksum ^ words[i]), 1);
  words.back() = checksum;
  return words;
}

}  // namespace birdseye::hw_sim
