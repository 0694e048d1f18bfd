#include "calibration/points/odd_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "calibration/points/point_error.hpp"
#include "calibration/points/point_fit.hpp"

namespace birdseye::calibration {

namespace {

using Points = std::span<const Eigen::Vector3d>;
using Subset = std::vector<std::size_t>;

constexpr double kFalseAlarm = 0.01;  // for the whole search
constexpr double kSure = 0.95;
constexpr std::size_t kFewestSound = 4, kMostOdd = 2;

/// A choice of points to leave out, and what the fit of the rest leaves.
struct Without {
  Subset left_out;
  double squares_mm2 = 0;
  detail::RigidFit fit;
};

bool holds(const Subset& subset, std::size_t i) {
  return std::find(subset.begin(), subset.end(), i) != subset.end();
}

std::optional<Without> fit_without(Points to_mm, Points from_mm, const Subset& left_out) {
  std::vector<Eigen::Vector3d> to, from;
  for (std::size_t i = 0; i < to_mm.size(); ++i) {
    if (holds(left_out, i)) continue;
    to.push_back(to_mm[i]);
    from.push_back(from_mm[i]);
  }
  const auto fit = detail::fit_rigid(to, from);
  if (!fit) return std::nullopt;
  Without out{left_out, 0, *fit};
  for (std::size_t i = 0; i < to.size(); ++i)
    out.squares_mm2 += (to[i] - fit->rotation * from[i] - fit->translation_mm).squaredNorm();
  return out;
}

/// All choices of one or of two points to leave out, best first; those that leave no fit are passed over.
std::vector<Without> choices(Points to_mm, Points from_mm, std::size_t count) {
  std::vector<Without> out;
  const auto add = [&](const Subset& subset) {
    if (auto without = fit_without(to_mm, from_mm, subset)) out.push_back(*std::move(without));
  };
  for (std::size_t i = 0; i < to_mm.size(); ++i) {
    if (count == 1) add({i});
    for (std::size_t j = i + 1; count == 2 && j < to_mm.size(); ++j) add({i, j});
  }
  std::sort(out.begin(), out.end(), [](const Without& a, const Without& b) { return a.squares_mm2 < b.squares_mm2; });
  return out;
}

double dof_of(std::size_t points) {
  return 3 * static_cast<double>(points) - 6;
}

/// The tests, with the localisation error given or estimated from the rest.
class Noise {
 public:
  explicit Noise(std::optional<double> localisation_rms_mm) : given_(localisation_rms_mm) {}

  /// The probability that chance alone drops the squares so far when more points are left out.
  [[nodiscard]] double chance(double squares_mm2, double rest_mm2, double freed_dof, double rest_dof) const {
    const double drop_mm2 = squares_mm2 - rest_mm2;
    if (given_) return chi_square_tail(drop_mm2 / variance(*given_), freed_dof);
    const double rest_variance = std::max(rest_mm2 / rest_dof, variance(kFinestLocalisation_mm));
    return f_tail(drop_mm2 / freed_dof / rest_variance, freed_dof, rest_dof);
  }
  /// How much less likely a rest is than the best rest, all having the same degrees of freedom.
  [[nodiscard]] double likelihood_ratio(double rest_mm2, double best_mm2, double rest_dof) const {
    if (given_) return std::exp(-0.5 * (rest_mm2 - best_mm2) / variance(*given_));
    const double floor_mm2 = rest_dof * variance(kFinestLocalisation_mm);
    return std::pow((best_mm2 + floor_mm2) / (rest_mm2 + floor_mm2), 0.5 * rest_dof);
  }

 private:
  /// Per coordinate.
  static double variance(double localisation_rms_mm) { return localisation_rms_mm * localisation_rms_mm / 3; }
  std::optional<double> given_;
};

std::string names_of(const Subset& subset, const char* last) {
  std::string text;
  for (std::size_t i = 0; i < subset.size(); ++i) {
    if (i > 0) text += i + 1 == subset.size() ? last : ", ";
    text += std::to_string(subset[i] + 1);
  }
  return text;
}

/// The points of the choices that hold 95 % of the probability.
Subset suspects_among(const std::vector<Without>& ranked, const Noise& noise, double rest_dof) {
  double total = 0;
  std::vector<double> weights;
  for (const Without& w : ranked) {
    weights.push_back(noise.likelihood_ratio(w.squares_mm2, ranked.front().squares_mm2, rest_dof));
    total += weights.back();
  }
  std::set<std::size_t> suspects;
  double held = 0;
  for (std::size_t i = 0; i < ranked.size() && held < kSure; ++i) {
    held += weights[i] / total;
    suspects.insert(ranked[i].left_out.begin(), ranked[i].left_out.end());
  }
  return {suspects.begin(), suspects.end()};
}

OddPoints cannot_tell(std::size_t n) {
  OddPoints out;
  out.verdict = OddPointsVerdict::cannot_tell;
  out.told = fmt::format(
      "with {} fiducials a wrong one cannot be told from the others: any three fit one another closely; touch {} more "
      "to be sure",
      n, n == 3 ? "two" : "one");
  return out;
}

OddPoints name(Points to_mm, Points from_mm, const Without& found, double chance) {
  OddPoints out;
  out.verdict = OddPointsVerdict::named;
  const auto sound = static_cast<double>(to_mm.size() - found.left_out.size());
  out.fre_without_rms_mm = std::sqrt(found.squares_mm2 / sound);
  for (const std::size_t i : found.left_out) {
    const double off_mm = (to_mm[i] - found.fit.rotation * from_mm[i] - found.fit.translation_mm).norm();
    out.named.push_back(
        {i, off_mm,
         fmt::format("lies {:.1f} mm from where the others put it, which fit one another to {:.2f} mm without it; by "
                     "chance in {} of sound sets",
                     off_mm, out.fre_without_rms_mm,
                     chance < 1e-4 ? "under 0.01 %" : fmt::format("{:.2f} %", 100 * chance))});
  }
  out.told = fmt::format("fiducial{} {} {} wrong: touch {} again", found.left_out.size() > 1 ? "s" : "",
                         names_of(found.left_out, " and "), found.left_out.size() > 1 ? "are" : "is",
                         found.left_out.size() > 1 ? "them" : "it");
  return out;
}

}  // namespace

OddPoints find_odd_points(Points to_mm, Points from_mm, std::optional<double> localisation_rms_mm) {
  const std::size_t n = to_mm.size();
  if (n <= kFewestSound) return cannot_tell(n);
  const Noise noise(localisation_rms_mm);
  const auto all = fit_without(to_mm, from_mm, {});
  OddPoints out;
  out.fre_without_rms_mm = all ? std::sqrt(all->squares_mm2 / static_cast<double>(n)) : 0;
  out.told = "no fiducial stands out";
  if (!all) return out;
  // As few odd points as explain the residuals: more are left out only if that drops the squares beyond chance. Two are
  // tried even where one does not help, for two wrong points can hide each other.
  double squares_mm2 = all->squares_mm2;
  std::size_t left_out = 0;
  const std::size_t most = std::min(kMostOdd, n - kFewestSound);
  for (std::size_t count = 1; count <= most; ++count) {
    const auto ranked = choices(to_mm, from_mm, count);
    if (ranked.empty()) break;
    const double rest_dof = dof_of(n - count);
    const double chance =
        static_cast<double>(ranked.size()) *
        noise.chance(squares_mm2, ranked.front().squares_mm2, 3 * static_cast<double>(count - left_out), rest_dof);
    if (chance > kFalseAlarm / static_cast<double>(most)) continue;
    squares_mm2 = ranked.front().squares_mm2;
    left_out = count;
    const Subset suspects = suspects_among(ranked, noise, rest_dof);
    if (suspects.size() == count) {
      out = name(to_mm, from_mm, ranked.front(), chance);
      continue;
    }
    out.verdict = OddPointsVerdict::suspected;
    out.named.clear();
    out.suspects = suspects;
    out.told = fmt::format("{} of fiducials {} {} wrong, and it cannot be told which: touch them again",
                           count == 1 ? "one" : "two", names_of(suspects, " and "), count == 1 ? "is" : "are");
  }
  return out;
}

}  // namespace birdseye::calibration
