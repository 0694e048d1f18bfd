#include "host/registration/views/confidence.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace birdseye::host {

namespace {

/// Found on simulated livers, 3 degrees of freedom (docs/manual/registration.md): with it, expected and true errors
/// agree there.
constexpr double kIndependentPixels = 400;
/// How far an organ is off before any picture is seen, all coordinates together. Root mean square over its box, on
/// whose faces nothing moves; an organ's surface within moves about twice as far.
constexpr double kLoosest_mm = 3;
constexpr double kStep_mm = 0.3;

}  // namespace

double expected_error_mm(const Summit& summit) {
  const auto count = static_cast<Eigen::Index>(summit.coordinates);
  const auto offset = [](const Eigen::VectorXd& direction) {
    const Eigen::VectorXd at = kStep_mm * direction;
    return std::vector<double>(at.begin(), at.end());
  };
  const std::vector<double> nowhere(summit.coordinates, 0.0);
  const std::vector<double> here = summit.gradient(nowhere);
  Eigen::MatrixXd curvature(count, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const std::vector<double> there = summit.gradient(offset(Eigen::VectorXd::Unit(count, j)));
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto n = static_cast<std::size_t>(i);
      curvature(i, j) = (here[n] - there[n]) / kStep_mm;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(0.5 * (curvature + curvature.transpose()));
  const std::vector<float> rest = summit.surface_moves(nowhere);
  const double least = static_cast<double>(count) / (kLoosest_mm * kLoosest_mm);
  double sum = 0;
  for (Eigen::Index j = 0; j < count; ++j) {
    const double information = std::max(kIndependentPixels * modes.eigenvalues()[j], least);
    const std::vector<float> there = summit.surface_moves(offset(modes.eigenvectors().col(j)));
    double squares = 0;
    for (std::size_t i = 0; i < rest.size(); ++i) squares += std::pow(static_cast<double>(there[i] - rest[i]), 2);
    sum += squares / (kStep_mm * kStep_mm) / information;
  }
  constexpr double kAxes = 3;
  return std::sqrt(sum / (static_cast<double>(rest.size()) / kAxes));
}

}  // namespace birdseye::host
