#include "hw-sim/case/elastic_body.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/IterativeLinearSolvers>
#include <algorithm>
#include <cmath>

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using CellStiffness = Eigen::Matrix<double, 24, 24>;
using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Of a node's three numbers, the first.
Eigen::Index first_of(int node) {
  return Eigen::Index{3} * node;
}

/// The corner of a cell, x fastest.
std::array<int, 3> corner(int at) {
  return {at & 1, (at >> 1) & 1, (at >> 2) & 1};
}

/// The stiffness of a cube of tissue of modulus one, by two of Gauss's points an axis.
CellStiffness cube_stiffness(double edge_mm, double poisson) {
  const double lame = poisson / ((1 + poisson) * (1 - 2 * poisson));
  const double shear = 0.5 / (1 + poisson);
  Eigen::Matrix<double, 6, 6> law = Eigen::Matrix<double, 6, 6>::Zero();
  law.topLeftCorner<3, 3>().setConstant(lame);
  for (int i = 0; i < 3; ++i) {
    law(i, i) += 2 * shear;
    law(i + 3, i + 3) = shear;
  }
  CellStiffness sum = CellStiffness::Zero();
  const double weight = std::pow(0.5 * edge_mm, 3);
  for (int point = 0; point < 8; ++point) {
    Vector3d at;
    for (std::size_t axis = 0; axis < 3; ++axis)
      at[static_cast<Eigen::Index>(axis)] = 0.5 + (corner(point)[axis] - 0.5) / std::sqrt(3.0);
    Eigen::Matrix<double, 6, 24> strain = Eigen::Matrix<double, 6, 24>::Zero();
    for (int n = 0; n < 8; ++n) {
      Vector3d value, slope;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        const bool far = corner(n)[axis] == 1;
        value[a] = far ? at[a] : 1 - at[a];
        slope[a] = (far ? 1 : -1) / edge_mm;
      }
      const Vector3d g(slope.x() * value.y() * value.z(), value.x() * slope.y() * value.z(),
                       value.x() * value.y() * slope.z());
      const int c = 3 * n;
      for (int i = 0; i < 3; ++i) strain(i, c + i) = g[i];
      strain(3, c) = g.y();
      strain(3, c + 1) = g.x();
      strain(4, c + 1) = g.z();
      strain(4, c + 2) = g.y();
      strain(5, c) = g.z();
      strain(5, c + 2) = g.x();
    }
    sum += weight * strain.transpose() * law * strain;
  }
  return sum;
}

/// The cell that holds a point, or none; where: the point's place in it, 0 to 1 along each axis.
bool find_cell(const Grid& nodes, const Vector3d& point_mm, std::array<int, 3>& cell, Vector3d& where) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double t = (point_mm[a] - nodes.origin_mm[a]) / nodes.spacing_mm[a];
    if (!(t >= 0 && t <= nodes.size[axis] - 1)) return false;
    cell[axis] = std::min(static_cast<int>(t), nodes.size[axis] - 2);
    where[a] = t - cell[axis];
  }
  return true;
}

}  // namespace

ElasticBody::ElasticBody(const Grid& nodes, const std::vector<double>& filled, double poisson)
    : nodes_(nodes), number_(nodes.voxels(), -1) {
  int count = 0;
  std::size_t at = 0;
  for (int k = 0; k + 1 < nodes.size[2]; ++k) {
    for (int j = 0; j + 1 < nodes.size[1]; ++j) {
      for (int i = 0; i + 1 < nodes.size[0]; ++i, ++at) {
        if (filled[at] <= 0) continue;
        Cell cell;
        cell.filled = filled[at];
        for (int n = 0; n < 8; ++n) {
          const auto [x, y, z] = corner(n);
          int& node = number_[nodes.index(i + x, j + y, k + z)];
          if (node < 0) node = count++;
          cell.nodes[static_cast<std::size_t>(n)] = node;
        }
        cells_.push_back(cell);
      }
    }
  }
  const CellStiffness cube = cube_stiffness(nodes.spacing_mm.x(), poisson);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(cells_.size() * 24 * 24);
  for (const Cell& cell : cells_) {
    for (int row = 0; row < 24; ++row) {
      for (int column = 0; column < 24; ++column) {
        entries.emplace_back(3 * cell.nodes[static_cast<std::size_t>(row / 3)] + row % 3,
                             3 * cell.nodes[static_cast<std::size_t>(column / 3)] + column % 3,
                             cell.filled * cube(row, column));
      }
    }
  }
  stiffness_.resize(first_of(count), first_of(count));
  stiffness_.setFromTriplets(entries.begin(), entries.end());
  springs_ = VectorXd::Zero(first_of(count));
}

std::vector<std::pair<int, double>> ElasticBody::about(const Vector3d& point_mm) const {
  std::array<int, 3> cell{};
  Vector3d where;
  std::vector<std::pair<int, double>> out;
  if (!find_cell(nodes_, point_mm, cell, where)) return out;
  for (int n = 0; n < 8; ++n) {
    const auto [x, y, z] = corner(n);
    const int node = number(cell[0] + x, cell[1] + y, cell[2] + z);
    if (node < 0) return {};
    out.emplace_back(node, (x == 1 ? where.x() : 1 - where.x()) * (y == 1 ? where.y() : 1 - where.y()) *
                               (z == 1 ? where.z() : 1 - where.z()));
  }
  return out;
}

void ElasticBody::hold(const Vector3d& point_mm, double stiffness) {
  for (const auto& [node, weight] : about(point_mm)) springs_.segment<3>(first_of(node)).array() += stiffness * weight;
}

ElasticBody::Load ElasticBody::no_load() const {
  return VectorXd::Zero(springs_.size());
}

void ElasticBody::push(Load& load, const Vector3d& point_mm, const Vector3d& force) const {
  for (const auto& [node, weight] : about(point_mm)) load.segment<3>(first_of(node)) += weight * force;
}

void ElasticBody::weigh(Load& load, const Vector3d& force_per_mm3) const {
  const double eighth_mm3 = nodes_.spacing_mm.prod() / 8;
  for (const Cell& cell : cells_) {
    for (const int node : cell.nodes) load.segment<3>(first_of(node)) += cell.filled * eighth_mm3 * force_per_mm3;
  }
}

Result<VectorXd> ElasticBody::settle(const Load& load) const {
  constexpr int kMostSteps = 10'000;
  SparseRows held = stiffness_;
  held.diagonal() += springs_;
  Eigen::ConjugateGradient<SparseRows, Eigen::Lower | Eigen::Upper> solver;
  solver.setTolerance(1e-9);
  solver.setMaxIterations(kMostSteps);
  solver.compute(held);
  VectorXd displacement_mm = solver.solve(load);
  if (solver.info() != Eigen::Success || !displacement_mm.allFinite())
    return Error{Errc::degenerate, fmt::format("the elastic organ of {} cells comes to no rest", cells_.size())};
  return displacement_mm;
}

ElasticBody::Load ElasticBody::pull(const VectorXd& displacement_mm) const {
  return stiffness_ * displacement_mm + springs_.cwiseProduct(displacement_mm);
}

std::vector<Vector3d> ElasticBody::over_lattice(const VectorXd& displacement_mm) const {
  std::vector<int> free(number_.size(), -1);
  int count = 0;
  for (std::size_t i = 0; i < number_.size(); ++i) {
    if (number_[i] < 0) free[i] = count++;
  }
  // Each free node is the mean of its neighbours in the lattice.
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixX3d known = Eigen::MatrixX3d::Zero(count, 3);
  const auto [columns, rows, slices] = nodes_.size;
  const std::array<std::array<int, 3>, 6> steps = {
      {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
  for (int k = 0; k < slices; ++k) {
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        const int row = free[nodes_.index(i, j, k)];
        if (row < 0) continue;
        for (const auto& [x, y, z] : steps) {
          if (i + x < 0 || j + y < 0 || k + z < 0 || i + x >= columns || j + y >= rows || k + z >= slices) continue;
          const std::size_t other = nodes_.index(i + x, j + y, k + z);
          entries.emplace_back(row, row, 1);
          if (free[other] >= 0) {
            entries.emplace_back(row, free[other], -1);
          } else {
            known.row(row) += displacement_mm.segment<3>(first_of(number_[other])).transpose();
          }
        }
      }
    }
  }
  SparseRows laplacian(count, count);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  Eigen::ConjugateGradient<SparseRows, Eigen::Lower | Eigen::Upper> solver;
  solver.setTolerance(1e-9);
  solver.compute(laplacian);
  Eigen::MatrixX3d followed(count, 3);
  tbb::parallel_for(0, 3, [&](int axis) { followed.col(axis) = solver.solve(known.col(axis)); });
  std::vector<Vector3d> out(number_.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = number_[i] >= 0 ? Vector3d(displacement_mm.segment<3>(first_of(number_[i])))
                             : Vector3d(followed.row(free[i]).transpose());
  }
  return out;
}

Vector3d NodeField::at(const Vector3d& point_mm) const {
  std::array<std::array<int, 4>, 3> at{};
  std::array<std::array<double, 4>, 3> weight{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const int last = nodes_.size[axis] - 1;
    const double t = std::clamp((point_mm[a] - nodes_.origin_mm[a]) / nodes_.spacing_mm[a], 0.0, double(last));
    const int cell = std::min(static_cast<int>(t), last - 1);
    const double f = t - cell;
    for (int n = 0; n < 4; ++n) at[axis][static_cast<std::size_t>(n)] = std::clamp(cell + n - 1, 0, last);
    weight[axis] = {0.5 * f * (-1 + f * (2 - f)), 1 + 0.5 * f * f * (3 * f - 5), 0.5 * f * (1 + f * (4 - 3 * f)),
                    0.5 * f * f * (f - 1)};
  }
  Vector3d sum = Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t j = 0; j < 4; ++j) {
      const double across = weight[1][j] * weight[2][k];
      const std::size_t row = nodes_.index(0, at[1][j], at[2][k]);
      for (std::size_t i = 0; i < 4; ++i)
        sum += across * weight[0][i] * values_[row + static_cast<std::size_t>(at[0][i])];
    }
  }
  return sum;
}

}  // namespace birdseye::hw_sim
