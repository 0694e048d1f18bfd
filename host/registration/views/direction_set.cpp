#include "host/registration/views/direction_set.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

using Value = std::function<double(const std::vector<double>&)>;

struct ValuedPlace {
  Eigen::VectorXd x;
  double value;
};

class LineSearch {
 public:
  LineSearch(const Value& value, const ValuedPlace& from, const Eigen::VectorXd& along)
      : value_(value), from_(from), along_(along) {}

  /// The best place found along the line.
  ValuedPlace search(double step, double close) const {
    Point low{-step, 0}, middle{0, from_.value}, high = at(step);
    if (high.value > middle.value) {
      low = middle;
      middle = high;
      high = at(kFurther * middle.t);
    } else {
      low = at(-step);
      if (low.value > middle.value) {
        high = middle;
        middle = low;
        low = at(kFurther * middle.t);
      }
    }
    for (int n = 0; n < kMostFurther && std::max(low.value, high.value) > middle.value; ++n) {
      if (high.value > middle.value) {
        low = middle;
        middle = high;
        high = at(kFurther * middle.t);
      } else {
        high = middle;
        middle = low;
        low = at(kFurther * middle.t);
      }
    }
    for (int n = 0; n < kParabolas; ++n) {
      const double t = vertex(low, middle, high);
      if (std::abs(t - middle.t) < close || t <= low.t || t >= high.t) break;
      const Point tried = at(t);
      Point& shrinks = (t < middle.t) == (tried.value > middle.value) ? high : low;
      if (tried.value > middle.value) {
        shrinks = middle;
        middle = tried;
      } else {
        shrinks = tried;
      }
    }
    return {from_.x + middle.t * along_, middle.value};
  }

 private:
  struct Point {
    double t, value;
  };
  static constexpr double kFurther = 2;
  static constexpr int kMostFurther = 6, kParabolas = 2;

  [[nodiscard]] Point at(double t) const {
    const Eigen::VectorXd x = from_.x + t * along_;
    return {t, value_({x.begin(), x.end()})};
  }
  /// Of the parabola through three points; the middle one where they lie on a line.
  static double vertex(const Point& a, const Point& b, const Point& c) {
    const double p = (b.t - a.t) * (b.value - c.value), q = (b.t - c.t) * (b.value - a.value);
    const double down = p - q;
    return down == 0 ? b.t : b.t - 0.5 * ((b.t - a.t) * p - (b.t - c.t) * q) / down;
  }

  const Value& value_;
  const ValuedPlace& from_;
  const Eigen::VectorXd& along_;
};

}  // namespace

std::vector<double> climb_by_direction_set(const Value& value, const std::vector<double>& start, double step,
                                           double close) {
  const auto n = static_cast<Eigen::Index>(start.size());
  Eigen::MatrixXd directions = Eigen::MatrixXd::Identity(n, n);
  ValuedPlace here{Eigen::Map<const Eigen::VectorXd>(start.data(), n), value(start)};
  for (;;) {
    const ValuedPlace before = here;
    Eigen::Index best = 0;
    double most = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::VectorXd along = directions.col(i);
      ValuedPlace next = LineSearch(value, here, along).search(step, close);
      if (next.value - here.value > most) {
        most = next.value - here.value;
        best = i;
      }
      here = std::move(next);
    }
    const Eigen::VectorXd went = here.x - before.x;
    const double length = went.norm();
    if (length < close) {
      // A round at a large step may see nothing where a smaller one would.
      if (step <= 4 * close) break;
      step = std::max(step / 4, 4 * close);
      continue;
    }
    const Eigen::VectorXd whole = went / length;
    here = LineSearch(value, here, whole).search(std::min(step, length), close);
    // In place of the direction that it most depends on, so that directions stay independent.
    directions.col(best) = directions.col(n - 1);
    directions.col(n - 1) = whole;
    step = std::clamp(length / 2, 4 * close, step);
  }
  return {here.x.begin(), here.x.end()};
}

}  // namespace birdseye::host
