#pragma once

#include <string>

#include "calibration/base/verdict.hpp"
#include "calibration/guide/guidance.hpp"

/// What a guided calibration says, in the present language.
namespace birdseye::host {

/// What to do with the scope.
std::string words_of(const calibration::ScopeMove& move);
/// The same, and from where; or what to do before a pose can be named.
std::string words_of(const calibration::NextPose& next);
std::string words_of(Grade grade);

}  // namespace birdseye::host
