#pragma once

#include <span>
#include <string>
#include <vector>

namespace birdseye::host {

/// Cases that are alike but for their seed, and differ from the class "elastic" in one thing.
struct FactorClass {
  std::string name;
  std::vector<std::string> options;  ///< of `birdseye-sim case`
};

/// All there are: kinds of deformation, numbers of views, light, what the organ looks like, what hides it, and poses.
std::span<const FactorClass> factor_classes();

}  // namespace birdseye::host
