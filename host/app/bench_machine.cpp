#include "host/app/bench_machine.hpp"

#include <sys/utsname.h>
#include <tbb/info.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/render/cpu/kernels.hpp"

namespace birdseye::host {

nlohmann::json bench_machine() {
  utsname machine{};
  ::uname(&machine);
  return {{"cores", tbb::info::default_concurrency()},
          {"isa", cpu::name_of(cpu::supported_isas().back())},
          {"kernel", machine.release}};
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace birdseye::host
