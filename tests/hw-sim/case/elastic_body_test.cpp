#include "hw-sim/case/elastic_body.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kPoisson = 0.4;
constexpr double kEdgeMm = 7;

Grid nodes_of(int x, int y, int z) {
  Grid nodes;
  nodes.size = {x, y, z};
  nodes.spacing_mm = Vector3d::Constant(kEdgeMm);
  nodes.origin_mm = {3, -5, 11};
  return nodes;
}

std::vector<double> cells_of(const Grid& nodes, double share) {
  const auto cells = [&](std::size_t axis) { return static_cast<std::size_t>(nodes.size[axis] - 1); };
  return std::vector<double>(cells(0) * cells(1) * cells(2), share);
}

/// A force per area on the two ends of a block along x, drawing them apart: trilinear cells take half of it at the
/// edges.
ElasticBody::Load drawn_apart(const ElasticBody& body, double force_per_mm2) {
  ElasticBody::Load load = body.no_load();
  const Grid& nodes = body.nodes();
  for (int k = 0; k < nodes.size[2]; ++k) {
    for (int j = 0; j < nodes.size[1]; ++j) {
      const double at_edge =
          (j == 0 || j == nodes.size[1] - 1 ? 0.5 : 1) * (k == 0 || k == nodes.size[2] - 1 ? 0.5 : 1);
      const Vector3d force(force_per_mm2 * kEdgeMm * kEdgeMm * at_edge, 0, 0);
      body.push(load, nodes.point(nodes.size[0] - 1, j, k), force);
      body.push(load, nodes.point(0, j, k), -force);
    }
  }
  return load;
}

/// The patch test: under a load that calls for a uniform strain, a block strains uniformly, to the digit, as Hooke
/// says.
TEST(ElasticBody, DrawnApartStrainsUniformlyByHookesLaw) {
  const Grid nodes = nodes_of(6, 4, 5);
  ElasticBody body(nodes, cells_of(nodes, 1), kPoisson);
  constexpr double kHold = 1e-7;  // only so much that it does not float away
  for (int k = 0; k < nodes.size[2]; ++k) {
    for (int j = 0; j < nodes.size[1]; ++j) {
      for (int i = 0; i < nodes.size[0]; ++i) body.hold(nodes.point(i, j, k), kHold);
    }
  }
  const auto settled = body.settle(drawn_apart(body, 0.05));
  ASSERT_TRUE(settled) << settled.error().what;
  const std::vector<Vector3d> moves = body.over_lattice(*settled);
  const Vector3d middle = 0.5 * (nodes.origin_mm + nodes.last_mm());
  const Vector3d strain(0.05, -kPoisson * 0.05, -kPoisson * 0.05);  // the modulus is one
  for (int k = 0; k < nodes.size[2]; ++k) {
    for (int j = 0; j < nodes.size[1]; ++j) {
      for (int i = 0; i < nodes.size[0]; ++i) {
        const Vector3d expected = strain.cwiseProduct(nodes.point(i, j, k) - middle);
        EXPECT_LT((moves[nodes.index(i, j, k)] - expected).norm(), 1e-5);
      }
    }
  }
}

TEST(ElasticBody, HalfFilledIsHalfAsStiff) {
  const Grid nodes = nodes_of(4, 3, 3);
  const auto lengthened_mm = [&](double share) {
    ElasticBody body(nodes, cells_of(nodes, share), kPoisson);
    for (int i = 0; i < nodes.size[0]; ++i) body.hold(nodes.point(i, 1, 1), 1e-6);
    const auto settled = body.settle(drawn_apart(body, 0.01));
    EXPECT_TRUE(settled);
    const std::vector<Vector3d> moves = body.over_lattice(*settled);
    return (moves[nodes.index(3, 1, 1)] - moves[nodes.index(0, 1, 1)]).x();
  };
  EXPECT_NEAR(lengthened_mm(0.5), 2 * lengthened_mm(1), 1e-4 * lengthened_mm(1));
}

/// A lump in a larger lattice, held at one side, under its weight.
TEST(ElasticBody, AtRestPullsBackWithWhatItCarriesAndTheSpringsBearItsWeight) {
  const Grid nodes = nodes_of(12, 11, 10);
  std::vector<double> filled = cells_of(nodes, 0);
  double volume_mm3 = 0;
  std::size_t at = 0;
  for (int k = 0; k < 9; ++k) {
    for (int j = 0; j < 10; ++j) {
      for (int i = 0; i < 11; ++i, ++at) {
        const double r = Vector3d((i - 5) / 4.5, (j - 4.5) / 4.0, (k - 4) / 3.5).norm();
        filled[at] = r > 1 ? 0 : 0.2 + 0.8 * hashed_uniform(3, at);
        volume_mm3 += filled[at] * std::pow(kEdgeMm, 3);
      }
    }
  }
  ElasticBody body(nodes, filled, kPoisson);
  constexpr double kStiffness = 2;
  std::vector<Vector3d> held;
  for (int j = 3; j < 7; ++j) {
    for (int k = 3; k < 6; ++k) held.push_back(nodes.point(2, j, k));
  }
  for (const Vector3d& point : held) body.hold(point, kStiffness);
  const Vector3d weight(1e-4, -2e-4, 3e-4);
  ElasticBody::Load load = body.no_load();
  body.weigh(load, weight);
  const auto settled = body.settle(load);
  ASSERT_TRUE(settled);
  EXPECT_LT((body.pull(*settled) - load).norm(), 1e-8 * load.norm());
  const std::vector<Vector3d> moves = body.over_lattice(*settled);
  Vector3d borne = Vector3d::Zero();
  for (int j = 3; j < 7; ++j) {
    for (int k = 3; k < 6; ++k) borne += kStiffness * moves[nodes.index(2, j, k)];
  }
  EXPECT_LT((borne - volume_mm3 * weight).norm(), 1e-6 * volume_mm3 * weight.norm());
  // Around it nothing moves further than the body's own surface: the lattice follows.
  double most_mm = 0;
  for (Eigen::Index i = 0; i < settled->size(); i += 3) most_mm = std::max(most_mm, settled->segment<3>(i).norm());
  for (const Vector3d& move : moves) EXPECT_LE(move.norm(), most_mm * (1 + 1e-6));
}

TEST(ElasticBody, HeldByNothingIsRefused) {
  const Grid nodes = nodes_of(4, 4, 4);
  const ElasticBody body(nodes, cells_of(nodes, 1), kPoisson);
  ElasticBody::Load load = body.no_load();
  body.weigh(load, {0, 0, 1e-4});
  EXPECT_FALSE(body.settle(load));
}

TEST(NodeField, PassesThroughItsNodesAndIsExactForALinearField) {
  const Grid nodes = nodes_of(7, 6, 8);
  Eigen::Matrix3d slope;
  slope << 0.1, -0.02, 0.03, 0.04, 0.2, 0, -0.05, 0.01, 0.07;
  std::vector<Vector3d> linear, wave;
  for (int k = 0; k < nodes.size[2]; ++k) {
    for (int j = 0; j < nodes.size[1]; ++j) {
      for (int i = 0; i < nodes.size[0]; ++i) {
        linear.emplace_back(slope * nodes.point(i, j, k));
        wave.emplace_back(std::sin(i), std::cos(j), std::sin(k + i));
      }
    }
  }
  const NodeField line(nodes, linear), waves(nodes, wave);
  EXPECT_LT((waves.at(nodes.point(3, 2, 4)) - wave[nodes.index(3, 2, 4)]).norm(), 1e-12);
  for (std::uint64_t i = 0; i < 200; ++i) {
    // Within the outermost cells, where splines have nodes on both sides.
    const Vector3d share(hashed_uniform(1, 3 * i), hashed_uniform(1, 3 * i + 1), hashed_uniform(1, 3 * i + 2));
    const Vector3d p = nodes.point(1, 1, 1) + share.cwiseProduct(nodes.last_mm() - nodes.point(2, 2, 2));
    EXPECT_LT((line.at(p) - slope * p).norm(), 1e-12);
  }
  // The slope does not leap from one cell into the next.
  const Vector3d node = nodes.point(3, 3, 3);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = 1e-5 * Vector3d::Unit(axis);
    EXPECT_LT((waves.at(node + step) + waves.at(node - step) - 2 * waves.at(node)).norm() / 1e-5, 1e-4);
  }
}

}  // namespace
}  // namespace birdseye::hw_sim
