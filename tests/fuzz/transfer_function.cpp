// Which HU has which colour, as JSON.

#include <cmath>

#include "host/render/scene/transfer_function.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string path = testing::as_file("input.json", testing::as_text({data, size}));
  const auto transfer = host::load_transfer_function(path);
  if (!transfer) {
    testing::must_name(transfer.error().what, path);
    return 0;
  }
  for (int hu = host::TransferFunction::kLowestHu; hu <= host::TransferFunction::kHighestHu; hu += 7) {
    const auto& entry = transfer->at(hu);
    testing::must(entry.r >= 0 && entry.r <= 1 && std::isfinite(entry.extinction_per_mm), "a colour is one");
  }
  const std::string text = host::transfer_text(*transfer);
  const auto again = host::load_transfer_function(testing::as_file("again.json", text));
  testing::must(again && host::transfer_text(*again) == text, "what is written reads back the same");
  return 0;
}
