// Whether refusing is no way to safety: simulated operations without a lie, how often the overlay is whole once the
// patient is registered, and whether the circle that the window states holds the truth and is no wider than it has to
// be.
//
//     operation_study SEED            one operation, as one line of JSON
//     operation_study <LINES          the table of many
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calibration/base/median.hpp"
#include "tests/support/rehearsal.hpp"

namespace {

using birdseye::testing::GreenFrame;
using birdseye::testing::Rehearsal;
using birdseye::testing::Watched;
using nlohmann::json;

double part_of(std::size_t some, std::size_t all) {
  return all > 0 ? 100.0 * static_cast<double>(some) / static_cast<double>(all) : 0;
}

/// What one operation shows once its patient is registered; no frames where that did not come about.
json operation_of(unsigned seed) {
  json out{
      {"seed", seed}, {"registered", false}, {"frames", 0}, {"errors_mm", json::array()}, {"radii_mm", json::array()}};
  Rehearsal operation(seed);
  if (!operation.begin() || !operation.register_patient() || !operation.check()) return out;
  out["registered"] = true;
  operation.watch(0.4);  // until the jitter is known
  const Watched seen = operation.watch(8);
  out["frames"] = seen.frames;
  for (const GreenFrame& frame : seen.green) {
    out["errors_mm"].push_back(frame.error_mm);
    out["radii_mm"].push_back(frame.radius_mm);
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1) {
    fmt::print("{}\n", operation_of(static_cast<unsigned>(std::atoi(argv[1]))).dump());
    return 0;
  }
  std::size_t trials = 0, registered = 0, frames = 0, within = 0, beyond = 0;
  std::vector<double> errors_mm, radii_mm;
  for (std::string line; std::getline(std::cin, line);) {
    const json one = json::parse(line);
    ++trials;
    registered += one.at("registered").get<bool>() ? 1 : 0;
    frames += one.at("frames").get<std::size_t>();
    for (std::size_t i = 0; i < one.at("errors_mm").size(); ++i) {
      const auto error_mm = one["errors_mm"][i].get<double>(), radius_mm = one.at("radii_mm").at(i).get<double>();
      errors_mm.push_back(error_mm);
      radii_mm.push_back(radius_mm);
      if (error_mm <= radius_mm) ++within;
      if (error_mm > 1.5 * radius_mm) ++beyond;
    }
  }
  if (errors_mm.empty()) {
    fmt::print("no operation showed an overlay\n");
    return 1;
  }
  const std::size_t green = errors_mm.size();
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
