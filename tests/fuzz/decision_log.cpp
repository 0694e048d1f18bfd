// The table of what a window showed of each frame.

#include "host/operation/decision_log.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string path = testing::as_file("frames.csv", testing::as_text({data, size}));
  const auto decisions = host::read_decisions(path);
  if (!decisions) testing::must_name(decisions.error().what, path);
  return 0;
}
