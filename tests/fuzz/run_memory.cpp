// What birdseyed remembers of its former runs.

#include "device/birdseyed/safe_mode.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const auto run = device::parse_run_memory(testing::as_text({data, size}));
  if (!run) return 0;
  testing::must(device::parse_run_memory(device::text_of(*run)) == run, "a memory that is written anew is the same");
  return 0;
}
