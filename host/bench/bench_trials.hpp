#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/case/registration_case.hpp"

namespace birdseye::host {

/// A case that birdseye-sim is to make: one problem of registration, and its truth.
struct SimulatedCase {
  std::string phantom = "liver", size = "768x576";
  int seed = 1, inner = 1;  ///< inner control points an axis
  int views = 5;
  double amplitude_mm = 10, noise = 1, light_offset_mm = 0;
  bool plain_background = false;  ///< nothing behind the organ
};
/// Has the simulator make the case. Errc::bad_value, with the simulator's words, for a seed that the simulator refuses.
Result<RegistrationCase> simulate(const SimulatedCase& wanted);

/// How a case is registered. The registration has as many unknowns as the case's truth.
struct Method {
  std::string optimiser = "gradient", similarity = "mi";
  int most_evaluations = 55;  ///< the paper's, for simplex and powell
};

struct Trial {
  double epsilon_before = 0, epsilon_after = 0, tre_before_mm = 0, tre_after_mm = 0;
  double surface_after_mm = 0, inside_after_mm = 0;
  double time_s = 0, processor_s = 0;  ///< processor_s: of all cores together; a busy machine adds little to it
  int evaluations = 0;
};
/// Without the times.
nlohmann::json json_of(const Trial& trial);
/// From such JSON, times zero. Throws nlohmann::json::exception for any other.
Trial trial_of(const nlohmann::json& json);
Result<Trial> try_once(const RegistrationCase& c, const Method& method);

/// Makes `count` cases of seeds 1, 2 and on, passing over seeds that the simulator refuses, and calls `work` with each
/// case and its seed.
Result<void> for_cases(SimulatedCase wanted, int count,
                       const std::function<Result<void>(const RegistrationCase&, int seed)>& work);

/// A trial is a success where it leaves at most this share of the error (the paper's Equation 7).
inline constexpr double kSuccess = 0.05;
/// trials, success_rate, and medians, means and the whole distribution.
nlohmann::json summary_of(const std::vector<Trial>& trials);

}  // namespace birdseye::host
