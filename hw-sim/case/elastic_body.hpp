#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <cstddef>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/phantom/grid.hpp"

namespace birdseye::hw_sim {

/// Linear elasticity by finite elements: trilinear hexahedra, the cubic cells of a lattice of nodes, each as stiff as
/// the share of it that is tissue. The tissue's modulus is one: forces are in mm^2 of it, springs in mm of it.
class ElasticBody {
 public:
  /// A force at each of the body's nodes, three numbers a node.
  using Load = Eigen::VectorXd;

  /// nodes: of equal spacing along all axes. filled: for each cell, x fastest, the share of it that is tissue, 0 to 1.
  /// poisson: below 0.5.
  ElasticBody(const Grid& nodes, const std::vector<double>& filled, double poisson);

  /// A spring from a point of the tissue to where it is at rest, shared out among its cell's nodes. Of no effect at a
  /// point that lies in no tissue.
  void hold(const Eigen::Vector3d& point_mm, double stiffness);

  [[nodiscard]] Load no_load() const;
  /// A force on a point of the tissue; of no effect where there is none.
  void push(Load& load, const Eigen::Vector3d& point_mm, const Eigen::Vector3d& force) const;
  /// A force on all of the tissue, per mm^3.
  void weigh(Load& load, const Eigen::Vector3d& force_per_mm3) const;

  /// Displacements of the body's nodes at which springs and tissue carry the load, by conjugate gradients, to 1e-9 of
  /// the load. Refused where they do not converge, as where nothing holds the body.
  [[nodiscard]] Result<Eigen::VectorXd> settle(const Load& load) const;
  /// What tissue and springs pull with at such displacements.
  [[nodiscard]] Load pull(const Eigen::VectorXd& displacement_mm) const;

  /// The same displacements by node of the lattice; nodes without tissue follow smoothly (harmonically).
  [[nodiscard]] std::vector<Eigen::Vector3d> over_lattice(const Eigen::VectorXd& displacement_mm) const;

  [[nodiscard]] const Grid& nodes() const { return nodes_; }
  [[nodiscard]] std::size_t cells() const { return cells_.size(); }

 private:
  struct Cell {
    std::array<int, 8> nodes{};  ///< of the body
    double filled = 0;
  };
  /// The body's nodes about a point, and their weights; empty where there is no tissue.
  [[nodiscard]] std::vector<std::pair<int, double>> about(const Eigen::Vector3d& point_mm) const;
  [[nodiscard]] int number(int i, int j, int k) const { return number_[nodes_.index(i, j, k)]; }

  Grid nodes_;
  std::vector<int> number_;  ///< of each node of the lattice in the body, or -1
  std::vector<Cell> cells_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> stiffness_;  ///< of the tissue
  Eigen::VectorXd springs_;
};

/// Vectors on a lattice's nodes, and smoothly between them: through each of the nodes and with a continuous slope
/// (Catmull and Rom's splines along each axis); beyond the lattice as at its edge.
class NodeField {
 public:
  NodeField(const Grid& nodes, std::vector<Eigen::Vector3d> values) : nodes_(nodes), values_(std::move(values)) {}
  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector3d& point_mm) const;

 private:
  Grid nodes_;
  std::vector<Eigen::Vector3d> values_;
};

}  // namespace birdseye::hw_sim
