#pragma once

#include "hw-sim/world/world.hpp"

namespace birdseye::testing {

/// A patient whose liver is a ball, made in no time: the operation's script is that of any patient.
struct BallPatient {
  hw_sim::PhantomTruth truth{.liver_centre_mm = {10, -20, 30}, .tumour_centre_mm = {12, -40, 28}, .fiducials_mm = {}};
  hw_sim::Mesh liver;

  BallPatient() {
    for (const double x : {-50.0, 20.0, 70.0}) {
      for (const double z : {-60.0, 55.0}) truth.fiducials_mm.emplace_back(x, -110 + 0.1 * x, z);
    }
    const Eigen::Vector3d centre_mm = truth.liver_centre_mm, reach_mm = Eigen::Vector3d::Constant(65);
    liver = hw_sim::closed_surface([centre_mm](const Eigen::Vector3d& p) { return (p - centre_mm).norm() - 55; },
                                   centre_mm - reach_mm, centre_mm + reach_mm, 3);
  }

  /// The world in which the faults befall the operation.
  [[nodiscard]] Result<hw_sim::World> world(std::vector<hw_sim::Fault> faults,
                                            hw_sim::ReferenceOn reference = hw_sim::ReferenceOn::nothing) const {
    return hw_sim::World::create(truth, liver, hw_sim::laparoscope_lens(768, 576), 1, {}, nullptr,
                                 hw_sim::Happenings(std::move(faults)), reference);
  }
};

}  // namespace birdseye::testing
