#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::drivers {

/// `usb:0403:6001` or `usb:0403:6001:SERIAL`, the numbers in hexadecimal.
struct UsbAddress {
  std::string name;  ///< as it was written
  std::uint16_t vendor = 0, product = 0;
  std::string serial;  ///< empty: the only adapter with these numbers
};
Result<UsbAddress> parse_usb_address(std::string_view text);

/// A device on the bus, as far as one sees without opening it.
struct UsbCandidate {
  std::uint16_t vendor = 0, product = 0;
  std::string product_text, serial;
};
/// The index of the one device that address means; else an error that lists the candidates.
Result<std::size_t> choose_adapter(const std::vector<UsbCandidate>& candidates, const UsbAddress& address);

}  // namespace birdseye::drivers
