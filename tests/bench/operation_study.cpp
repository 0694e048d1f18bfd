// Whether refusing is no way to safety: simulated operations without a lie, how often the overlay is whole once the
// patient is registered, and whether the circle that the window states holds the truth and is no wider than it has to
// be.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "calibration/base/median.hpp"
#include "tests/support/rehearsal.hpp"

namespace {

using birdseye::testing::GreenFrame;
using birdseye::testing::Rehearsal;
using birdseye::testing::Watched;

double part_of(std::size_t some, std::size_t all) {
  return all > 0 ? 100.0 * static_cast<double>(some) / static_cast<double>(all) : 0;
}

}  // namespace

int main(int argc, char** argv) {
  const int trials = argc > 1 ? std::atoi(argv[1]) : 200;
  std::size_t registered = 0, frames = 0, green = 0, within = 0, beyond = 0;
  std::vector<double> errors_mm, radii_mm;
  for (int seed = 1; seed <= trials; ++seed) {
    Rehearsal operation(static_cast<unsigned>(seed));
    if (!operation.begin() || !operation.register_patient() || !operation.check()) continue;
    ++registered;
    operation.watch(0.4);  // until the jitter is known
    const Watched seen = operation.watch(8);
    frames += seen.frames;
    green += seen.green.size();
    for (const GreenFrame& frame : seen.green) {
      errors_mm.push_back(frame.error_mm);
      radii_mm.push_back(frame.radius_mm);
      if (frame.error_mm <= frame.radius_mm) ++within;
      if (frame.error_mm > 1.5 * frame.radius_mm) ++beyond;
    }
    if (seed % 20 == 0) fmt::print(stderr, "{} of {}\n", seed, trials);
  }
  if (errors_mm.empty()) {
    fmt::print("no operation showed an overlay\n");
    return 1;
  }
  std::ranges::sort(errors_mm);
  const double p95_mm = errors_mm[static_cast<std::size_t>(0.95 * static_cast<double>(errors_mm.size() - 1))];
  fmt::print(
      "| operations | registered | green of frames | within the circle | beyond 1.5 circles | median circle | "
      "errors' 95 % | ratio |\n|---|---|---|---|---|---|---|---|\n");
  const double radius_mm = birdseye::median_of(radii_mm);
  fmt::print("| {} | {} | {:.1f} % | {:.1f} % | {:.3f} % | {:.2f} mm | {:.2f} mm | {:.2f} |\n", trials, registered,
             part_of(green, frames), part_of(within, green), part_of(beyond, green), radius_mm, p95_mm,
             radius_mm / p95_mm);
  return 0;
}
