#include "calibration/geometry/linear_algebra.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace birdseye {

SymmetricEigen<3> symmetric_eigen(const Eigen::Matrix3d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

SymmetricEigen<Eigen::Dynamic> symmetric_eigen(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::Vector3d symmetric_eigenvalues(const Eigen::Matrix3d& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

Eigen::Vector3d solve_symmetric(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right) {
  return matrix.ldlt().solve(right);
}

Vector6d solve_symmetric(const Matrix6d& matrix, const Vector6d& right) {
  return matrix.ldlt().solve(right);
}

Matrix6Xd solve_symmetric(const Matrix6d& matrix, const Matrix6Xd& right) {
  return matrix.ldlt().solve(right);
}

Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  return matrix.ldlt().solve(right);
}

Matrix6d inverse_symmetric(const Matrix6d& matrix) {
  return matrix.ldlt().solve(Matrix6Xd(Matrix6d::Identity()));
}

Eigen::MatrixXd inverse_symmetric(const Eigen::MatrixXd& matrix) {
  return matrix.ldlt().solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols())));
}

Eigen::MatrixXd inverse_information(const Eigen::MatrixXd& information) {
  const Eigen::VectorXd unit = information.diagonal().cwiseSqrt().cwiseInverse();
  return unit.asDiagonal() * inverse_symmetric(Eigen::MatrixXd(unit.asDiagonal() * information * unit.asDiagonal())) *
         unit.asDiagonal();
}

bool is_covariance(const Eigen::MatrixXd& matrix) {
  constexpr double kLargest = 1e12, kRounded = 1e-9;
  if (!matrix.allFinite() || matrix.cwiseAbs().maxCoeff() >= kLargest || matrix.diagonal().minCoeff() < 0 ||
      !matrix.isApprox(matrix.transpose(), 1e-6))
    return false;
  // The axes differ by their units, so each is measured by its own sigma.
  const Eigen::VectorXd sigma = matrix.diagonal().cwiseSqrt();
  const Eigen::VectorXd inverse = sigma.unaryExpr([](double one) { return one > 0 ? 1 / one : 0; });
  const Eigen::VectorXd held = (sigma.array() == 0).cast<double>();
  if (!(held.asDiagonal() * matrix).isZero(0)) return false;
  const Eigen::MatrixXd correlation = inverse.asDiagonal() * matrix * inverse.asDiagonal();
  return symmetric_eigen(correlation).values.minCoeff() >= -kRounded;
}

bool is_measured_error(double error) {
  constexpr double kLargest = 1e4;
  return error >= 0 && error <= kLargest;
}

Matrix6d whitening(const Matrix6d& covariance) {
  return Matrix6d(covariance.llt().matrixL()).triangularView<Eigen::Lower>().solve(Matrix6Xd(Matrix6d::Identity()));
}

Eigen::Vector3d solve_least_norm(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right) {
  return matrix.completeOrthogonalDecomposition().solve(right);
}

Eigen::MatrixXd solve_least_norm(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  return matrix.completeOrthogonalDecomposition().solve(right);
}

LeastSquares solve_least_squares(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(matrix);
  return {solver.solve(right), solver.rank()};
}

}  // namespace birdseye
