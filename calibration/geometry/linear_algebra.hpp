#pragma once

#include <Eigen/Core>

namespace birdseye {

// Eigen's decompositions, each compiled once: a unit that calls them by template takes seconds longer to compile.
// Matrices of few rows have their own functions, which calculate without the heap.

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix6Xd = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Of a symmetric matrix.
template <int kSize>
struct SymmetricEigen {
  Eigen::Matrix<double, kSize, 1> values;       ///< ascending
  Eigen::Matrix<double, kSize, kSize> vectors;  ///< of length one, a column each
};

/// Reads the lower triangle.
SymmetricEigen<3> symmetric_eigen(const Eigen::Matrix3d& matrix);
SymmetricEigen<Eigen::Dynamic> symmetric_eigen(const Eigen::MatrixXd& matrix);
/// Ascending; reads the lower triangle.
Eigen::Vector3d symmetric_eigenvalues(const Eigen::Matrix3d& matrix);

/// x of matrix * x = right, by Cholesky's L D L^T with pivoting, for a symmetric matrix that has no eigenvalue below
/// zero. Along a direction that the matrix leaves open, x is zero or rounding.
Eigen::Vector3d solve_symmetric(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right);
Vector6d solve_symmetric(const Matrix6d& matrix, const Vector6d& right);
Matrix6Xd solve_symmetric(const Matrix6d& matrix, const Matrix6Xd& right);
Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right);
/// By the same.
Matrix6d inverse_symmetric(const Matrix6d& matrix);
Eigen::MatrixXd inverse_symmetric(const Eigen::MatrixXd& matrix);

/// The covariance of parameters from their information. Kinds of parameters may differ by orders of magnitude: they are
/// brought to one scale before they are inverted.
Eigen::MatrixXd inverse_information(const Eigen::MatrixXd& information);

/// Whether measurements can have such a covariance: finite, symmetric, and without a variance below zero along any
/// direction. What has no variance, as a parameter that was held, goes with nothing either.
bool is_covariance(const Eigen::MatrixXd& matrix);

/// Whether a measurement can have such an error, in mm, px or ms: nothing is calibrated beyond 10,000.
bool is_measured_error(double error);

/// W with W^T W = covariance^-1: brings what has this covariance to one of unit variances.
Matrix6d whitening(const Matrix6d& covariance);

/// x that makes |matrix * x - right| least, and of several such x the shortest.
Eigen::Vector3d solve_least_norm(const Eigen::Matrix3d& matrix, const Eigen::Vector3d& right);
Eigen::MatrixXd solve_least_norm(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right);

/// x that makes |matrix * x - right| least, by QR with pivoting, and how many columns of the matrix are independent.
struct LeastSquares {
  Eigen::MatrixXd x;
  Eigen::Index rank = 0;
};
LeastSquares solve_least_squares(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right);

}  // namespace birdseye
