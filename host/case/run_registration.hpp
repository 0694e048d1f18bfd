#pragma once

#include <functional>
#include <memory>
#include <string>

#include "host/case/registration_case.hpp"
#include "host/registration/geometry/organ_at_rest.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

struct CaseRegistration {
  ViewRegistration found;
  std::shared_ptr<const OrganAtRest> organ;  ///< by which geometry found it; null with another optimiser
};

/// Registers a case by the optimiser that the case names. By geometry, the expected errors of targets are of the
/// target, where the case has one, and of its landmarks after it. Now and then calls tell with a line for a person.
Result<CaseRegistration> run_registration(const RegistrationCase& c, const TransferFunction& transfer,
                                          bool estimate_uncertainty,
                                          const std::function<void(const std::string&)>& tell);

}  // namespace birdseye::host
