#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <vector>

#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

/// Trilinear hexahedra over an organ of one elastic material, each as stiff and heavy as it is full of organ, and one
/// layer about them that is next to nothing, so that places just outside move along.
struct ElasticMesh {
  double side_mm = 0;
  std::array<int, 3> points{};     ///< of a regular grid over the organ's box
  std::vector<int> node_of_point;  ///< -1 where there is none; a node has three rows below
  Eigen::MatrixX3d places_mm;      ///< of the nodes, from the box's first point along its axes
  Eigen::SparseMatrix<double> stiffness;
  Eigen::VectorXd mass;
};

/// Of Young's modulus 1 and density 1, lengths in mm.
ElasticMesh elastic_mesh(const SignedDistance& organ);

/// Corner n of a cell is at (n & 1, n >> 1 & 1, n >> 2).
inline Eigen::Vector3d cell_corner(int n) {
  return {static_cast<double>(n & 1), static_cast<double>(n >> 1 & 1), static_cast<double>(n >> 2)};
}

}  // namespace birdseye::host
