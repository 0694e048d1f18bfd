#include "host/bench/bench_machine.hpp"

#include <sys/utsname.h>
#include <tbb/info.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calibration/base/median.hpp"
#include "host/render/cpu/kernels.hpp"

namespace birdseye::host {

nlohmann::json bench_machine() {
  utsname machine{};
  ::uname(&machine);
  return {{"cores", tbb::info::default_concurrency()},
          {"isa", cpu::name_of(cpu::supported_isas().back())},
          {"kernel", machine.release}};
}

}  // namespace birdseye::host
