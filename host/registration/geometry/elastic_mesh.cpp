#include "host/registration/geometry/elastic_mesh.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

constexpr double kPoisson = 0.3;  ///< of soft tissue as a registration sees it; 0.45 fits worse
/// Cells an organ's longest side, and their sides.
constexpr double kAcross = 15, kLeastCell_mm = 6, kMostCell_mm = 18;
constexpr double kLeastFull = 1e-3;

using Stiffness = Eigen::Matrix<double, 24, 24>;

/// Of a trilinear cube of Young's modulus 1, by two Gauss points an axis (K.-J. Bathe, Finite Element Procedures,
/// chapter 5).
Stiffness stiffness_of_cell(double side_mm) {
  const double lambda = kPoisson / ((1 + kPoisson) * (1 - 2 * kPoisson)), mu = 1 / (2 * (1 + kPoisson));
  Eigen::Matrix<double, 6, 6> material = Eigen::Matrix<double, 6, 6>::Zero();
  material.topLeftCorner<3, 3>().setConstant(lambda);
  material.diagonal() += (Eigen::Matrix<double, 6, 1>() << 2 * mu, 2 * mu, 2 * mu, mu, mu, mu).finished();
  Stiffness out = Stiffness::Zero();
  const double gauss = 0.5 / std::sqrt(3.0);
  for (int point = 0; point < 8; ++point) {
    const Eigen::Vector3d at =
        Eigen::Vector3d::Constant(0.5) + 2 * gauss * (cell_corner(point) - Eigen::Vector3d::Constant(0.5));
    Eigen::Matrix<double, 6, 24> strain = Eigen::Matrix<double, 6, 24>::Zero();
    for (int n = 0; n < 8; ++n) {
      const Eigen::Vector3d far = cell_corner(n), sign = 2 * far - Eigen::Vector3d::Ones();
      const Eigen::Vector3d share = Eigen::Vector3d::Ones() - far + sign.cwiseProduct(at);
      const Eigen::Vector3d slope = Eigen::Vector3d(sign.x() * share.y() * share.z(), sign.y() * share.x() * share.z(),
                                                    sign.z() * share.x() * share.y()) /
                                    side_mm;
      const int c = 3 * n;
      strain(0, c) = strain(3, c + 1) = strain(5, c + 2) = slope.x();
      strain(1, c + 1) = strain(3, c) = strain(4, c + 2) = slope.y();
      strain(2, c + 2) = strain(4, c + 1) = strain(5, c) = slope.z();
    }
    out += strain.transpose() * material * strain * (side_mm * side_mm * side_mm / 8);
  }
  return out;
}

/// The share of a cell that is organ.
double fullness(const SignedDistance& organ, const Eigen::Vector3d& low_in_box_mm, double side_mm) {
  constexpr int kSamples = 4;
  int inside = 0;
  for (int k = 0; k < kSamples; ++k) {
    for (int j = 0; j < kSamples; ++j) {
      for (int i = 0; i < kSamples; ++i) {
        const Eigen::Vector3d at = low_in_box_mm + side_mm / kSamples * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5);
        if (organ.distance_mm(organ.patient_from_box() * at) < 0) ++inside;
      }
    }
  }
  return static_cast<double>(inside) / (kSamples * kSamples * kSamples);
}

using Cells = std::array<int, 3>;

std::vector<double> fullness_of_cells(const SignedDistance& organ, const Cells& cells, double side_mm) {
  std::vector<double> full(grid_count(cells));
  tbb::parallel_for(0, cells[2], [&](int k) {
    for (int j = 0; j < cells[1]; ++j) {
      for (int i = 0; i < cells[0]; ++i)
        full[grid_index(cells, i, j, k)] = fullness(organ, side_mm * Eigen::Vector3d(i, j, k), side_mm);
    }
  });
  return full;
}

/// Whether a cell or one beside it has organ in it.
bool near_organ(const std::vector<double>& full, const Cells& cells, int i, int j, int k) {
  for (int c = std::max(0, k - 1); c <= std::min(cells[2] - 1, k + 1); ++c) {
    for (int b = std::max(0, j - 1); b <= std::min(cells[1] - 1, j + 1); ++b) {
      for (int a = std::max(0, i - 1); a <= std::min(cells[0] - 1, i + 1); ++a) {
        if (full[grid_index(cells, a, b, c)] > 0) return true;
      }
    }
  }
  return false;
}

/// Cells put together to a mesh.
class Assembly {
 public:
  explicit Assembly(ElasticMesh& mesh)
      : mesh_(mesh), of_cell_(stiffness_of_cell(mesh.side_mm)), volume_mm3_(std::pow(mesh.side_mm, 3)) {
    mesh_.node_of_point.assign(grid_count(mesh_.points), -1);
  }

  void add(const Eigen::Vector3i& cell, double share) {
    std::array<int, 8> nodes{};
    for (int n = 0; n < 8; ++n) {
      const Eigen::Vector3i point = cell + cell_corner(n).cast<int>();
      nodes[static_cast<std::size_t>(n)] = node_at(point);
      masses_[static_cast<std::size_t>(nodes[static_cast<std::size_t>(n)])] += share * volume_mm3_ / 8;
    }
    const double stiff = std::max(kLeastFull, share);
    for (int a = 0; a < 24; ++a) {
      for (int b = 0; b < 24; ++b) {
        entries_.emplace_back(3 * nodes[static_cast<std::size_t>(a / 3)] + a % 3,
                              3 * nodes[static_cast<std::size_t>(b / 3)] + b % 3, stiff * of_cell_(a, b));
      }
    }
  }

  void finish() {
    const auto nodes = static_cast<Eigen::Index>(places_mm_.size());
    mesh_.stiffness.resize(3 * nodes, 3 * nodes);
    mesh_.stiffness.setFromTriplets(entries_.begin(), entries_.end());
    mesh_.mass.resize(3 * nodes);
    mesh_.places_mm.resize(nodes, 3);
    for (Eigen::Index n = 0; n < nodes; ++n) {
      mesh_.mass.segment<3>(3 * n).setConstant(masses_[static_cast<std::size_t>(n)]);
      mesh_.places_mm.row(n) = places_mm_[static_cast<std::size_t>(n)].transpose();
    }
  }

 private:
  int node_at(const Eigen::Vector3i& point) {
    int& node = mesh_.node_of_point[grid_index(mesh_.points, point.x(), point.y(), point.z())];
    if (node < 0) {
      node = static_cast<int>(places_mm_.size());
      places_mm_.emplace_back(mesh_.side_mm * point.cast<double>());
      masses_.push_back(0);
    }
    return node;
  }

  ElasticMesh& mesh_;
  Stiffness of_cell_;
  double volume_mm3_;
  std::vector<Eigen::Triplet<double>> entries_;
  std::vector<Eigen::Vector3d> places_mm_;
  std::vector<double> masses_;
};

}  // namespace

ElasticMesh elastic_mesh(const SignedDistance& organ) {
  ElasticMesh out;
  out.side_mm = std::clamp(organ.box_mm().maxCoeff() / kAcross, kLeastCell_mm, kMostCell_mm);
  Cells cells{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cells[axis] = static_cast<int>(std::ceil(organ.box_mm()[static_cast<Eigen::Index>(axis)] / out.side_mm));
    out.points[axis] = cells[axis] + 1;
  }
  const std::vector<double> full = fullness_of_cells(organ, cells, out.side_mm);
  Assembly assembly(out);
  for (int k = 0; k < cells[2]; ++k) {
    for (int j = 0; j < cells[1]; ++j) {
      for (int i = 0; i < cells[0]; ++i) {
        if (near_organ(full, cells, i, j, k)) assembly.add({i, j, k}, full[grid_index(cells, i, j, k)]);
      }
    }
  }
  assembly.finish();
  return out;
}

}  // namespace birdseye::host
