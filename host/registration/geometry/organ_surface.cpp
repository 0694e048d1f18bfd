#include "host/registration/geometry/organ_surface.hpp"

#include "host/registration/geometry/lattice_field.hpp"

namespace birdseye::host {

Result<SignedDistance> organ_distance(const Volume& ct, const Volume* labels, std::span<const int> values,
                                      const TransferFunction& transfer) {
  constexpr double kSpacing_mm = 2, kMargin_mm = 24;
  return signed_distance_of(ct, tissue_voxels(ct, labels, values, transfer), kSpacing_mm, kMargin_mm);
}

SignedDistance deformed_distance(const SignedDistance& organ, const DisplacementField& field) {
  LatticeField lattice(organ);
  for (std::size_t n = 0; n < lattice.size(); ++n) lattice.set(n, field.displacement(lattice.place_mm(n)));
  return seen_distance(organ, lattice);
}

}  // namespace birdseye::host
