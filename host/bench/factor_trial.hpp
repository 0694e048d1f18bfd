#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "host/bench/factor_classes.hpp"
#include "host/bench/true_places.hpp"

namespace birdseye::host {

/// A case of a class, and its truth.
struct FactorCase {
  RegistrationCase given;
  TransferFunction transfer;
  std::vector<PlacesOfKind> places;
  DisplacementField truth;  ///< rest = now + u(now)
  double truth_off_mm = 0;  ///< how far u, between the points of its lattice, is from exact landmarks at most
  double generation_s = 0;  ///< that the simulator took
};
/// Has the simulator make the case. size: WIDTHxHEIGHT of the views, px. Errors are SimulatorCase::make()'s, and those
/// of a case that cannot be read.
Result<FactorCase> make_factor_case(const FactorClass& wanted, const std::string& size, int seed);

/// Registers the case and holds what was found and what was said of it against the truth. The keys are those of
/// docs/manual/registration-study.md; what a registration does not say is absent, and where it fails, `error` says why
/// and only the errors before it are there. one_thread: whether the calling thread does all the work, whose processor
/// time alone then counts.
nlohmann::json factor_trial(const FactorCase& c, const std::string& optimiser, bool one_thread);

}  // namespace birdseye::host
