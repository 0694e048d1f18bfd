#include "host/registration/geometry/organ_surface.hpp"

#include "host/registration/geometry/lattice_field.hpp"

namespace birdseye::host {

SignedDistance deformed_distance(const SignedDistance& organ, const DisplacementField& field) {
  LatticeField lattice(organ);
  for (std::size_t n = 0; n < lattice.size(); ++n) lattice.set(n, field.displacement(lattice.place_mm(n)));
  return seen_distance(organ, lattice);
}

}  // namespace birdseye::host
