// A script of faults for the simulated instruments.

#include <cmath>

#include "hw-sim/faults/fault_script.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string path = testing::as_file("faults.toml", testing::as_text({data, size}));
  for (const auto instruments : {hw_sim::Instruments::tracker, hw_sim::Instruments::camera, hw_sim::Instruments::both,
                                 hw_sim::Instruments::with_programs}) {
    const auto script = hw_sim::read_fault_script(path, instruments, 1);
    if (!script) {
      testing::must_name(script.error().what, path);
      continue;
    }
    for (const auto* const faults : {&script->tracker, &script->camera, &script->world}) {
      double last_s = 0;
      for (const hw_sim::Fault& fault : *faults) {
        testing::must(fault.at_s >= last_s && fault.at_s <= 1e6, "faults come in the order of their times");
        testing::must(!fault.for_s || *fault.for_s > 0, "a fault lasts");
        for (const auto& [name, value] : fault.values) testing::must(std::isfinite(value), "a value is finite");
        last_s = fault.at_s;
      }
      hw_sim::FaultTimeline timeline(*faults, hw_sim::FaultTarget::tracker);
      timeline.begin(0);
      for (int i = 0; i < 100 && timeline.next_change_ns(); ++i) timeline.advance(*timeline.next_change_ns());
    }
  }
  return 0;
}
