#include "host/registration/geometry/organ_at_rest.hpp"

#include <utility>

#include "host/registration/views/tissue.hpp"

namespace birdseye::host {

Result<std::shared_ptr<const OrganAtRest>> organ_at_rest(const Volume& ct, const Volume* labels,
                                                         std::span<const int> values,
                                                         const TransferFunction& transfer) {
  auto distance = organ_distance(ct, labels, values, transfer);
  if (!distance) return distance.error();
  auto modes = ElasticModes::of(*distance);
  return std::make_shared<const OrganAtRest>(OrganAtRest{*std::move(distance), std::move(modes)});
}

}  // namespace birdseye::host
