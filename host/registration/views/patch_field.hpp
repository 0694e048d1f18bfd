#pragma once

#include <vector>

#include "host/deform/displacement_field.hpp"
#include "host/registration/views/control_grid.hpp"
#include "host/registration/views/tissue.hpp"

namespace birdseye::host {

/// From the unit cube of a patch or an octree to the patient: the tissue's box.
Eigen::Affine3d patient_from_cube(const Tissue& tissue);

/// The parameters of control, mm, whose deformation comes closest to a field, by least squares over a grid of the
/// tissue's box.
std::vector<double> closest_parameters(const DisplacementField& field, const ControlGrid& control,
                                       const Tissue& tissue);

/// The field of an octree of this level over the tissue's box, its free vertices driven by the control points.
DisplacementField driven_field(const ControlGrid& control, const std::vector<double>& parameters, const Tissue& tissue,
                               int level);

}  // namespace birdseye::host
