// birdseyed's configuration.

#include "device/birdseyed/config.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const auto config = device::read_config(testing::as_file("cart.toml", testing::as_text({data, size})));
  if (!config) {
    testing::must_name(config.error().what, "cart.toml:");
    return 0;
  }
  const auto& unit = config->tracker.minibird;
  testing::must(
      config->tracker.line.device.empty() || config->core.bird_names.size() == static_cast<std::size_t>(unit.birds),
      "each bird has a name");
  testing::must(unit.rate_hz >= 14 && unit.rate_hz <= 144, "a rate is one that units have");
  testing::must(config->wire.port >= 0 && config->wire.port <= 65'535, "a port is one");
  return 0;
}
