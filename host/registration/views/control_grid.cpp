#include "host/registration/views/control_grid.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>

#include "host/volume/volume.hpp"

namespace birdseye::host {

namespace {

std::size_t at(int value) {
  return static_cast<std::size_t>(value);
}

/// B_1^n(t) to B_{n-1}^n(t) for the n - 1 inner points of degree n.
std::vector<double> inner_bernstein(int inner, double t) {
  const auto b = bernstein(inner + 1, t);
  return {b.begin() + 1, b.begin() + 1 + inner};
}

/// The integrals of B_i^n B_j^n over [0, 1]: C(n, i) C(n, j) / C(2n, i + j) / (2n + 1).
Eigen::MatrixXd gram(int degree) {
  const auto choose = [](int n, int k) {
    return std::exp(std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1));
  };
  Eigen::MatrixXd out(degree + 1, degree + 1);
  for (int i = 0; i <= degree; ++i) {
    for (int j = 0; j <= degree; ++j)
      out(i, j) = choose(degree, i) * choose(degree, j) / choose(2 * degree, i + j) / (2 * degree + 1);
  }
  return out;
}

}  // namespace

ControlGrid::ControlGrid(const std::array<int, 3>& inner_points) : inner_(inner_points) {
  assert(*std::min_element(inner_.begin(), inner_.end()) >= 1);
  assert(*std::max_element(inner_.begin(), inner_.end()) < kMostDegree);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int n = inner_[axis] + 1;
    const Eigen::MatrixXd lower = gram(n - 1);
    mass_[axis] = gram(n).block(1, 1, n - 1, n - 1);
    stiffness_[axis].resize(n - 1, n - 1);
    // A Bernstein polynomial's derivative is n times the difference of two of one degree less.
    for (int i = 1; i < n; ++i) {
      for (int j = 1; j < n; ++j)
        stiffness_[axis](i - 1, j - 1) =
            n * n * (lower(i - 1, j - 1) - lower(i - 1, j) - lower(i, j - 1) + lower(i, j));
    }
    root_[axis] = mass_[axis].llt().matrixU();
    inverse_root_[axis] = root_[axis].triangularView<Eigen::Upper>().solve(Eigen::MatrixXd::Identity(n - 1, n - 1));
  }
}

std::size_t ControlGrid::parameters() const {
  return 3 * grid_count(inner_);
}

std::vector<double> ControlGrid::refine(const std::vector<double>& parameters, const ControlGrid& finer) const {
  std::array<int, 3> size = inner_;
  std::vector<double> now = parameters;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    while (size[axis] < finer.inner_[axis]) {
      // From degree n to n + 1: point i is i / (n + 1) of the one before it and the rest of itself; the faces are zero.
      std::array<int, 3> more = size;
      ++more[axis];
      const int degree = size[axis] + 2;
      std::vector<double> raised(3 * grid_count(more), 0.0);
      for (int k = 0; k < more[2]; ++k) {
        for (int j = 0; j < more[1]; ++j) {
          for (int i = 0; i < more[0]; ++i) {
            std::array<int, 3> here{i, j, k};
            const int point = here[axis] + 1;
            const double before = static_cast<double>(point) / degree;
            for (const int back : {0, 1}) {
              std::array<int, 3> from = here;
              from[axis] -= back;
              if (from[axis] < 0 || from[axis] >= size[axis]) continue;
              const double weight = back == 1 ? before : 1 - before;
              for (std::size_t c = 0; c < 3; ++c) {
                raised[3 * grid_index(more, i, j, k) + c] +=
                    weight * now[3 * grid_index(size, from[0], from[1], from[2]) + c];
              }
            }
          }
        }
      }
      now = std::move(raised);
      size = more;
    }
  }
  return now;
}

BezierPatch ControlGrid::patch(const std::vector<double>& parameters, const Eigen::Vector3d& box_mm) const {
  BezierPatch patch = *BezierPatch::create({inner_[0] + 1, inner_[1] + 1, inner_[2] + 1});
  std::vector<Eigen::Vector3d> moves;
  for (std::size_t i = 0; i + 2 < parameters.size(); i += 3) {
    moves.emplace_back(Eigen::Vector3d(parameters[i], parameters[i + 1], parameters[i + 2]).cwiseQuotient(box_mm));
  }
  patch.set_displacements(moves);
  return patch;
}

std::vector<double> ControlGrid::apply(const std::array<Eigen::MatrixXd, 3>& along,
                                       const std::vector<double>& parameters) const {
  std::vector<double> now = parameters;
  std::size_t stride = 3;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t n = at(inner_[axis]);
    std::vector<double> next(now.size(), 0.0);
    for (std::size_t p = 0; p < now.size(); ++p) {
      const std::size_t here = p / stride % n;
      const std::size_t first = p - here * stride;
      for (std::size_t i = 0; i < n; ++i)
        next[p] += along[axis](static_cast<Eigen::Index>(here), static_cast<Eigen::Index>(i)) * now[first + i * stride];
    }
    now = std::move(next);
    stride *= n;
  }
  return now;
}

double ControlGrid::strain(const std::vector<double>& parameters, const Eigen::Vector3d& box_mm, double weight,
                           std::vector<double>& gradient) const {
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<Eigen::MatrixXd, 3> along = mass_;
    const double length = box_mm[static_cast<Eigen::Index>(axis)];
    along[axis] = stiffness_[axis] / (length * length);
    const std::vector<double> product = apply(along, parameters);
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      sum += product[i] * parameters[i];
      gradient[i] += 2 * weight * product[i];
    }
  }
  return sum;
}

std::vector<double> ControlGrid::from_even(const std::vector<double>& even) const {
  return apply(inverse_root_, even);
}

std::vector<double> ControlGrid::to_even(const std::vector<double>& parameters) const {
  return apply(root_, parameters);
}

std::vector<double> ControlGrid::gradient_to_even(const std::vector<double>& by_parameters) const {
  return apply({inverse_root_[0].transpose(), inverse_root_[1].transpose(), inverse_root_[2].transpose()},
               by_parameters);
}

ControlledGrid::ControlledGrid(const ControlGrid& control, const std::array<int, 3>& points)
    : inner_(control.inner_points()), points_(points) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < points[axis]; ++i) {
      const auto b = inner_bernstein(inner_[axis], static_cast<double>(i) / (points[axis] - 1));
      basis_[axis].insert(basis_[axis].end(), b.begin(), b.end());
    }
  }
}

void ControlledGrid::displacements(const std::vector<double>& parameters, std::vector<float>& out) const {
  out.resize(3 * grid_count(points_));
  const std::size_t nx = at(inner_[0]), ny = at(inner_[1]), nz = at(inner_[2]);
  tbb::parallel_for(0, points_[2], [&](int z) {
    std::vector<double> plane(3 * nx * ny), line(3 * nx);
    for (std::size_t n = 0; n < plane.size(); ++n) {
      double sum = 0;
      for (std::size_t k = 0; k < nz; ++k) sum += basis_[2][at(z) * nz + k] * parameters[3 * nx * ny * k + n];
      plane[n] = sum;
    }
    for (int y = 0; y < points_[1]; ++y) {
      for (std::size_t n = 0; n < line.size(); ++n) {
        double sum = 0;
        for (std::size_t j = 0; j < ny; ++j) sum += basis_[1][at(y) * ny + j] * plane[3 * nx * j + n];
        line[n] = sum;
      }
      float* to = &out[3 * grid_index(points_, 0, y, z)];
      for (int x = 0; x < points_[0]; ++x, to += 3) {
        double sum[3] = {0, 0, 0};
        for (std::size_t i = 0; i < nx; ++i) {
          const double b = basis_[0][at(x) * nx + i];
          for (std::size_t c = 0; c < 3; ++c) sum[c] += b * line[3 * i + c];
        }
        for (std::size_t c = 0; c < 3; ++c) to[c] = static_cast<float>(sum[c]);
      }
    }
  });
}

void ControlledGrid::pull_back(const std::vector<float>& by_displacement, std::vector<double>& by_parameters) const {
  const std::size_t nx = at(inner_[0]), ny = at(inner_[1]), nz = at(inner_[2]);
  std::vector<double> planes(3 * nx * ny * at(points_[2]), 0.0);
  tbb::parallel_for(0, points_[2], [&](int z) {
    double* const plane = &planes[3 * nx * ny * at(z)];
    std::vector<double> line(3 * nx);
    for (int y = 0; y < points_[1]; ++y) {
      std::fill(line.begin(), line.end(), 0.0);
      const float* from = &by_displacement[3 * grid_index(points_, 0, y, z)];
      for (int x = 0; x < points_[0]; ++x, from += 3) {
        if (from[0] == 0 && from[1] == 0 && from[2] == 0) continue;
        for (std::size_t i = 0; i < nx; ++i) {
          const double b = basis_[0][at(x) * nx + i];
          for (std::size_t c = 0; c < 3; ++c) line[3 * i + c] += b * static_cast<double>(from[c]);
        }
      }
      for (std::size_t j = 0; j < ny; ++j) {
        const double b = basis_[1][at(y) * ny + j];
        for (std::size_t n = 0; n < line.size(); ++n) plane[3 * nx * j + n] += b * line[n];
      }
    }
  });
  // In order, so that the sum is the same for any number of threads.
  for (int z = 0; z < points_[2]; ++z) {
    for (std::size_t k = 0; k < nz; ++k) {
      const double b = basis_[2][at(z) * nz + k];
      for (std::size_t n = 0; n < 3 * nx * ny; ++n)
        by_parameters[3 * nx * ny * k + n] += b * planes[3 * nx * ny * at(z) + n];
    }
  }
}

}  // namespace birdseye::host
