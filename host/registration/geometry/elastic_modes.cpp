#include "host/registration/geometry/elastic_modes.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "host/registration/geometry/elastic_mesh.hpp"

namespace birdseye::host {

namespace {

constexpr Eigen::Index kSpare = 18;  ///< of a subspace, the last, which have hardly turned to modes yet

/// Displacements along each axis that are polynomials of the place, up to the fifth degree: near to what is smoothest.
Eigen::MatrixXd polynomials(const Eigen::MatrixX3d& places) {
  constexpr int kDegree = 5;
  const Eigen::RowVector3d low = places.colwise().minCoeff(), high = places.colwise().maxCoeff();
  const Eigen::ArrayX3d t =
      (places.rowwise() - 0.5 * (low + high)).array().rowwise() / (0.5 * (high - low)).array().max(1.0);
  std::vector<Eigen::VectorXd> each;
  for (int a = 0; a <= kDegree; ++a) {
    for (int b = 0; a + b <= kDegree; ++b) {
      for (int c = 0; a + b + c <= kDegree; ++c) each.emplace_back(t.col(0).pow(a) * t.col(1).pow(b) * t.col(2).pow(c));
    }
  }
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(3 * places.rows(), 3 * static_cast<Eigen::Index>(each.size()));
  Eigen::Index column = 0;
  for (const Eigen::VectorXd& values : each) {
    for (Eigen::Index axis = 0; axis < 3; ++axis, ++column) {
      for (Eigen::Index n = 0; n < places.rows(); ++n) out(3 * n + axis, column) = values[n];
    }
  }
  return out;
}

/// The lowest of K x = lambda M x by subspace iteration (K.-J. Bathe and E. L. Wilson, 1972): each step solves with K,
/// made definite by a little of M, and turns the subspace to its own eigenvectors.
struct Modes {
  Eigen::VectorXd eigenvalues;
  Eigen::MatrixXd vectors;
};
Modes lowest(const ElasticMesh& mesh) {
  constexpr int kSteps = 2;
  const double soft = 1e-6 * mesh.stiffness.diagonal().sum() / mesh.mass.sum();
  Eigen::SparseMatrix<double> shifted = mesh.stiffness;
  shifted.diagonal() += soft * mesh.mass;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(shifted);
  Modes out{{}, polynomials(mesh.places_mm)};
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::MatrixXd forces = mesh.mass.asDiagonal() * out.vectors;
    Eigen::MatrixXd solved(forces.rows(), forces.cols());
    tbb::parallel_for(Eigen::Index{0}, forces.cols(),
                      [&](Eigen::Index n) { solved.col(n) = factor.solve(forces.col(n)); });
    const Eigen::MatrixXd of_stiffness = solved.transpose() * forces;  // shifted * solved is forces
    const Eigen::MatrixXd of_mass = solved.transpose() * mesh.mass.asDiagonal() * solved;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> turned(of_stiffness, of_mass);
    out.eigenvalues = turned.eigenvalues().array() - soft;
    out.vectors = solved * turned.eigenvectors();
  }
  const Eigen::Index kept = out.eigenvalues.size() - kSpare;
  out.eigenvalues.conservativeResize(kept);
  out.vectors.conservativeResize(Eigen::NoChange, kept);
  return out;
}

}  // namespace

std::shared_ptr<const ElasticModes> ElasticModes::of(const SignedDistance& organ) {
  const std::shared_ptr<ElasticModes> out(new ElasticModes(organ));
  ElasticMesh mesh = elastic_mesh(organ);
  Modes modes = lowest(mesh);
  out->side_mm_ = mesh.side_mm;
  out->points_ = mesh.points;
  out->node_of_point_ = std::move(mesh.node_of_point);
  out->eigenvalues_ = std::move(modes.eigenvalues);
  out->modes_ = modes.vectors;

  Eigen::VectorXd sum = Eigen::VectorXd::Zero(out->count());
  Eigen::Index count = 0;
  for (int k = 0; k < organ.points()[2]; k += 2) {
    for (int j = 0; j < organ.points()[1]; j += 2) {
      for (int i = 0; i < organ.points()[0]; i += 2) {
        const Eigen::Vector3d place = organ.patient_from_box() * (organ.spacing_mm() * Eigen::Vector3d(i, j, k));
        if (std::abs(organ.distance_mm(place)) > organ.spacing_mm()) continue;
        sum += out->at(place).colwise().squaredNorm().transpose();
        ++count;
      }
    }
  }
  out->mean_squares_ = sum / static_cast<double>(3 * std::max<Eigen::Index>(1, count));
  return out;
}

ElasticModes::Corners ElasticModes::corners_of(const Eigen::Vector3d& place_in_patient_mm) const {
  // One layer of cells about the organ moves along with it; from beyond, the way back to it leads along the distance.
  constexpr double kBeside_mm = 6;
  Eigen::Vector3d place = place_in_patient_mm;
  for (int step = 0; step < 3; ++step) {
    const auto at = organ_.sample(place);
    if (at.distance_mm <= kBeside_mm) break;
    place -= (at.distance_mm - kBeside_mm) * at.gradient / std::max(0.5, at.gradient.norm());
  }
  const Eigen::Vector3d x = organ_.patient_from_box().inverse(Eigen::Isometry) * place / side_mm_;
  std::array<int, 3> base{};
  Eigen::Vector3d t;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<Eigen::Index>(axis);
    const double v = std::clamp(x[n], 0.0, static_cast<double>(points_[axis] - 1));
    base[axis] = std::min(static_cast<int>(v), points_[axis] - 2);
    t[n] = v - base[axis];
  }
  Corners out{};
  double sum = 0;
  for (int n = 0; n < 8; ++n) {
    const auto i = static_cast<std::size_t>(n);
    const Eigen::Vector3d far = cell_corner(n);
    out.node[i] = node_of_point_[grid_index(points_, base[0] + (n & 1), base[1] + (n >> 1 & 1), base[2] + (n >> 2))];
    if (out.node[i] < 0) continue;
    out.weight[i] =
        (far.cwiseProduct(t) + (Eigen::Vector3d::Ones() - far).cwiseProduct(Eigen::Vector3d::Ones() - t)).prod();
    sum += out.weight[i];
  }
  constexpr double kLeast = 1e-6;
  for (double& weight : out.weight) weight /= std::max(kLeast, sum);
  return out;
}

Eigen::Matrix3Xd ElasticModes::at(const Eigen::Vector3d& place_in_patient_mm) const {
  const Corners corners = corners_of(place_in_patient_mm);
  Eigen::Matrix3Xd out = Eigen::Matrix3Xd::Zero(3, count());
  for (std::size_t n = 0; n < 8; ++n) {
    if (corners.node[n] >= 0) out += corners.weight[n] * modes_.middleRows<3>(Eigen::Index{3} * corners.node[n]);
  }
  return out;
}

Eigen::MatrixX3d ElasticModes::sum_at(const Eigen::VectorXd& shares, const Eigen::MatrixX3d& places) const {
  const Eigen::VectorXd of_nodes = modes_ * shares;
  Eigen::MatrixX3d out = Eigen::MatrixX3d::Zero(places.rows(), 3);
  for (Eigen::Index i = 0; i < places.rows(); ++i) {
    const Corners corners = corners_of(places.row(i).transpose());
    for (std::size_t n = 0; n < 8; ++n) {
      if (corners.node[n] >= 0)
        out.row(i) += corners.weight[n] * of_nodes.segment<3>(Eigen::Index{3} * corners.node[n]).transpose();
    }
  }
  return out;
}

ElasticBasis::ElasticBasis(std::shared_ptr<const ElasticModes> modes, double rigid_mm, double elastic_mm)
    : modes_(std::move(modes)), sigmas_(modes_->count()) {
  const Eigen::Index elastic = modes_->count() - ElasticModes::kRigid;
  const Eigen::VectorXd& squares = modes_->mean_squares();
  sigmas_.head<ElasticModes::kRigid>().setConstant(rigid_mm / std::sqrt(squares.head<ElasticModes::kRigid>().sum()));
  const Eigen::VectorXd inverse = modes_->eigenvalues().tail(elastic).cwiseInverse();
  sigmas_.tail(elastic) = elastic_mm * inverse / std::sqrt(inverse.cwiseAbs2().dot(squares.tail(elastic)));
}

Eigen::Matrix3Xd ElasticBasis::at(const Eigen::Vector3d& place_in_patient_mm) const {
  return modes_->at(place_in_patient_mm) * sigmas_.asDiagonal();
}

Eigen::MatrixX3d ElasticBasis::sum_at(const Eigen::VectorXd& unknowns, const Eigen::MatrixX3d& places) const {
  return modes_->sum_at(sigmas_.cwiseProduct(unknowns), places);
}

}  // namespace birdseye::host
