#include "host/registration/views/patch_field.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace birdseye::host {

Eigen::Affine3d patient_from_cube(const Tissue& tissue) {
  Eigen::Affine3d patient_from_cube = tissue.patient_from_grid;
  patient_from_cube.scale(tissue.box_mm());
  return patient_from_cube;
}

std::vector<double> closest_parameters(const DisplacementField& field, const ControlGrid& control,
                                       const Tissue& tissue) {
  // Enough places for as many unknowns; those on the box's faces say nothing.
  constexpr int kLeastSide = 9;
  const auto& inner = control.inner_points();
  const int side = std::max(kLeastSide, 2 * *std::max_element(inner.begin(), inner.end()) + 3);
  const ControlledGrid grid(control, {side, side, side});
  const std::size_t count = control.parameters() / 3;
  Eigen::MatrixXd basis(side * side * side, static_cast<Eigen::Index>(count));
  std::vector<float> response;
  for (std::size_t c = 0; c < count; ++c) {
    std::vector<double> one(control.parameters(), 0.0);
    one[3 * c] = 1;
    grid.displacements(one, response);
    for (Eigen::Index p = 0; p < basis.rows(); ++p)
      basis(p, static_cast<Eigen::Index>(c)) = static_cast<double>(response[3 * static_cast<std::size_t>(p)]);
  }
  Eigen::MatrixXd wanted(basis.rows(), 3);
  for (int p = 0; p < basis.rows(); ++p) {
    const int i = p % side, j = p / side % side, k = p / side / side;
    const Eigen::Vector3d share = Eigen::Vector3d(i, j, k) / (side - 1);
    const Eigen::Vector3d at = tissue.patient_from_grid * Eigen::Vector3d(share.cwiseProduct(tissue.box_mm()));
    wanted.row(p) = (tissue.patient_from_grid.linear().transpose() * field.displacement(at)).transpose();
  }
  const Eigen::MatrixXd found = (basis.transpose() * basis).ldlt().solve(basis.transpose() * wanted);
  std::vector<double> out;
  for (Eigen::Index c = 0; c < found.rows(); ++c) out.insert(out.end(), {found(c, 0), found(c, 1), found(c, 2)});
  return out;
}

DisplacementField driven_field(const ControlGrid& control, const std::vector<double>& parameters, const Tissue& tissue,
                               int level) {
  PatchOctree tree = *PatchOctree::uniform(level);
  control.patch(parameters, tissue.box_mm()).drive(tree);
  return field_of(tree, patient_from_cube(tissue));
}

}  // namespace birdseye::host
