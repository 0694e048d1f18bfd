#include "drivers/io/usb_address.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>

namespace birdseye::drivers {

namespace {

constexpr std::uint16_t kFtdiVendor = 0x0403;

std::optional<std::uint16_t> four_hex_digits(std::string_view text) {
  std::uint16_t number = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number, 16);
  if (text.size() != 4 || failed != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string words_of(const UsbCandidate& candidate) {
  return fmt::format("usb:{:04x}:{:04x}{}{}{}", candidate.vendor, candidate.product,
                     candidate.serial.empty() ? "" : ":", candidate.serial,
                     candidate.product_text.empty() ? "" : " (" + candidate.product_text + ")");
}

std::string list_of(const std::vector<UsbCandidate>& candidates) {
  std::string list;
  for (const UsbCandidate& candidate : candidates) list += (list.empty() ? "" : ", ") + words_of(candidate);
  return list;
}

}  // namespace

Result<UsbAddress> parse_usb_address(std::string_view text) {
  UsbAddress address;
  address.name = text;
  const bool long_enough = text.size() >= 13 && text.starts_with("usb:") && text[8] == ':';
  const auto vendor = long_enough ? four_hex_digits(text.substr(4, 4)) : std::nullopt;
  const auto product = long_enough ? four_hex_digits(text.substr(9, 4)) : std::nullopt;
  const bool has_serial = text.size() > 13;
  if (!vendor || !product || (has_serial && (text[13] != ':' || text.size() == 14))) {
    return Error{Errc::bad_value,
                 fmt::format("{}: is no USB device; write usb:VENDOR:PRODUCT or usb:VENDOR:PRODUCT:SERIAL, the numbers "
                             "of four hexadecimal digits as lsusb prints them",
                             text)};
  }
  address.vendor = *vendor;
  address.product = *product;
  if (has_serial) address.serial = text.substr(14);
  return address;
}

Result<std::size_t> choose_adapter(const std::vector<UsbCandidate>& candidates, const UsbAddress& address) {
  std::vector<std::size_t> matches;
  std::vector<UsbCandidate> alike, relatives;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const UsbCandidate& candidate = candidates[i];
    if (candidate.vendor == kFtdiVendor) relatives.push_back(candidate);
    if (candidate.vendor != address.vendor || candidate.product != address.product) continue;
    alike.push_back(candidate);
    if (address.serial.empty() || candidate.serial == address.serial) matches.push_back(i);
  }
  if (matches.size() == 1) return matches.front();
  if (matches.size() > 1) {
    return Error{
        Errc::bad_value,
        fmt::format("{}: {} adapters answer to that: {}; name the one by its serial number, or unplug the other",
                    address.name, matches.size(), list_of(alike))};
  }
  const std::vector<UsbCandidate>& instead = alike.empty() ? relatives : alike;
  return Error{Errc::not_found,
               instead.empty()
                   ? fmt::format("{}: no such adapter, and none of FTDI's at all; is it plugged in?", address.name)
                   : fmt::format("{}: no such adapter; plugged in are {}", address.name, list_of(instead))};
}

}  // namespace birdseye::drivers
