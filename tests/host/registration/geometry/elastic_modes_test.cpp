#include "host/registration/geometry/elastic_modes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/ball.hpp"

namespace birdseye::host {
namespace {

class ElasticBall : public ::testing::Test {
 protected:
  static constexpr double kBall_mm = 40;

  static void SetUpTestSuite() { modes() = ElasticModes::of(testing::ball(kBall_mm)); }
  static void TearDownTestSuite() { modes().reset(); }
  static std::shared_ptr<const ElasticModes>& modes() {
    static std::shared_ptr<const ElasticModes> kept;
    return kept;
  }
  /// Within the ball.
  static Eigen::Vector3d place(std::mt19937& random) {
    std::uniform_real_distribution<double> along(-0.5 * kBall_mm, 0.5 * kBall_mm);
    return {along(random), along(random), along(random)};
  }
};

TEST_F(ElasticBall, SixModesAreRigid) {
  const Eigen::VectorXd& values = modes()->eigenvalues();
  EXPECT_LT(values.head<6>().cwiseAbs().maxCoeff(), 1e-6 * values[6]);
  std::mt19937 random(1);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d a = place(random), b = place(random);
    const Eigen::Matrix3Xd apart = modes()->at(a).leftCols<6>() - modes()->at(b).leftCols<6>();
    // Two places of what moves rigidly keep their distance.
    EXPECT_LT(((a - b).transpose() * apart).norm(), 1e-6 * (a - b).norm() * apart.norm());
  }
}

// H. Lamb, Proceedings of the London Mathematical Society 13 (1882): a free solid ball's lowest motion is a torsion of
// five orientations, omega a / c = 2.501, c the speed of shear waves; whatever its Poisson's ratio. Cells are a quarter
// of the ball's radius: those that it fills in part make it softer by some hundredths.
TEST_F(ElasticBall, TheLowestOthersAreLambsTorsions) {
  const double shear = 1 / (2 * (1 + 0.3));
  const double lamb = 2.501 * 2.501 * shear / (kBall_mm * kBall_mm);
  for (int mode = 6; mode < 11; ++mode) EXPECT_NEAR(std::sqrt(modes()->eigenvalues()[mode] / lamb), 1, 0.08) << mode;
  EXPECT_GT(modes()->eigenvalues()[11], 1.02 * modes()->eigenvalues()[10]);
}

TEST_F(ElasticBall, ASumOfModesIsWhatTheyAreOneByOne) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  const ElasticBasis basis(modes(), 3, 2);
  Eigen::VectorXd unknowns(basis.unknowns());
  for (double& unknown : unknowns) unknown = normal(random);
  Eigen::MatrixX3d places(10, 3);
  for (int i = 0; i < 10; ++i) places.row(i) = 1.5 * place(random).transpose();
  const Eigen::MatrixX3d sum = basis.sum_at(unknowns, places);
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d each = basis.at(places.row(i).transpose()) * unknowns;
    EXPECT_LT((sum.row(i).transpose() - each).norm(), 1e-9);
  }
}

TEST_F(ElasticBall, MovesItsSurfaceAsFarAsItIsTold) {
  const ElasticBasis rigid(modes(), 3, 0), elastic(modes(), 0, 2);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  double of_rigid = 0, of_elastic = 0;
  constexpr int kPlaces = 300;
  for (int i = 0; i < kPlaces; ++i) {
    const Eigen::Vector3d on_surface =
        kBall_mm * Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    of_rigid += rigid.at(on_surface).squaredNorm() / (3 * kPlaces);
    of_elastic += elastic.at(on_surface).squaredNorm() / (3 * kPlaces);
  }
  EXPECT_NEAR(std::sqrt(of_rigid), 3, 0.15);
  EXPECT_NEAR(std::sqrt(of_elastic), 2, 0.1);
}

}  // namespace
}  // namespace birdseye::host
