// A USB adapter as a configuration names it.

#include <fmt/format.h>

#include "drivers/io/usb_address.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const auto address = drivers::parse_usb_address(testing::as_text({data, size}));
  if (!address) return 0;
  const auto again = drivers::parse_usb_address(fmt::format("usb:{:04x}:{:04x}{}{}", address->vendor, address->product,
                                                            address->serial.empty() ? "" : ":", address->serial));
  testing::must(again && again->vendor == address->vendor && again->product == address->product &&
                    again->serial == address->serial,
                "an address that is written anew is the same");
  return 0;
}
