#include "host/registration/geometry/open_sides.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace birdseye::host {

namespace {

/// Along x, y and z of the patient frame, each towards plus, then towards minus.
constexpr std::array kSides{"left", "right", "back", "front", "top", "underside"};

std::size_t side_of(const Eigen::Vector3d& outwards) {
  Eigen::Index axis = 0;
  outwards.cwiseAbs().maxCoeff(&axis);
  return 2 * static_cast<std::size_t>(axis) + (outwards[axis] > 0 ? 0 : 1);
}

bool open(const KnownPlace& place) {
  constexpr double kHalf = 0.5;
  return place.normal.dot(place.covariance * place.normal) >
         kHalf * kHalf * place.normal.dot(place.prior_covariance * place.normal);
}

}  // namespace

std::vector<OpenSide> open_sides(std::span<const KnownPlace> places) {
  constexpr double kLeastShare = 0.1;
  struct Sum {
    double all = 0, open = 0, square_mm2 = 0;
  };
  std::array<Sum, kSides.size()> sums;
  for (const KnownPlace& place : places) {
    Sum& sum = sums[side_of(place.normal)];
    sum.all += 1;
    if (!open(place)) continue;
    sum.open += 1;
    sum.square_mm2 += place.covariance.trace();
  }
  std::vector<OpenSide> out;
  for (std::size_t n = 0; n < kSides.size(); ++n) {
    const Sum& sum = sums[n];
    if (sum.open > 0 && sum.open >= kLeastShare * sum.all)
      out.push_back({kSides[n], sum.open / sum.all, std::sqrt(sum.square_mm2 / sum.open)});
  }
  std::stable_sort(out.begin(), out.end(), [](const OpenSide& a, const OpenSide& b) { return a.share > b.share; });
  return out;
}

}  // namespace birdseye::host
