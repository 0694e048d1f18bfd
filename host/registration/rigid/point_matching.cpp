#include "host/registration/rigid/point_matching.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calibration/base/units.hpp"
#include "calibration/points/point_error.hpp"

namespace birdseye::host {

namespace {

using Points = std::span<const Eigen::Vector3d>;

// Another assignment must fit worse by this factor, and by this much.
constexpr double kClearlyBetter = 3, kClearlyWorse_mm = 2;
constexpr double kWorstFre_mm = 15;
constexpr std::size_t kMostLooks = 30'000'000;  // a second or so
constexpr std::size_t kLooksOfAFit = 100;       // as long as one fit takes

Eigen::MatrixXd distances(Points points) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd out(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j)
      out(i, j) = (points[static_cast<std::size_t>(i)] - points[static_cast<std::size_t>(j)]).norm();
  }
  return out;
}

/// Depth first over assignments, touched point by touched point, cutting what cannot matter any more.
class AssignmentSearch {
 public:
  AssignmentSearch(Points ct_mm, Points touched_mm)
      : ct_mm_(ct_mm),
        touched_mm_(touched_mm),
        ct_distances_(distances(ct_mm)),
        touched_distances_(distances(touched_mm)) {}

  void run() {
    order_.clear();
    taken_.assign(ct_mm_.size(), false);
    descend();
  }
  [[nodiscard]] bool gave_up() const { return looks_ > kMostLooks; }
  [[nodiscard]] bool found() const { return !best_order_.empty(); }
  [[nodiscard]] bool ambiguous() const { return second_mm_ < not_clearly_worse_mm(); }
  [[nodiscard]] double best_mm() const { return best_mm_; }
  [[nodiscard]] double second_mm() const { return second_mm_; }
  [[nodiscard]] const std::vector<std::size_t>& best_order() const { return best_order_; }
  [[nodiscard]] std::vector<Eigen::Vector3d> ct_in_order(const std::vector<std::size_t>& order) const {
    std::vector<Eigen::Vector3d> ct;
    ct.reserve(order.size());
    for (const std::size_t i : order) ct.push_back(ct_mm_[i]);
    return ct;
  }

 private:
  [[nodiscard]] double not_clearly_worse_mm() const {
    return std::max(kClearlyBetter * best_mm_, best_mm_ + kClearlyWorse_mm);
  }
  /// The FRE from which on an assignment is neither the best nor a rival of it.
  [[nodiscard]] double limit_mm() const {
    return std::min({second_mm_, kWorstFre_mm, found() ? not_clearly_worse_mm() : kWorstFre_mm});
  }

  [[nodiscard]] bool fits_so_far(std::size_t ct) const {
    const double most_mm = limit_mm() * std::sqrt(2 * static_cast<double>(touched_mm_.size()));
    const auto here = static_cast<Eigen::Index>(order_.size());
    for (Eigen::Index i = 0; i < here; ++i) {
      const auto other = static_cast<Eigen::Index>(order_[static_cast<std::size_t>(i)]);
      if (std::abs(touched_distances_(here, i) - ct_distances_(static_cast<Eigen::Index>(ct), other)) >= most_mm)
        return false;
    }
    return true;
  }

  void weigh() {
    looks_ += kLooksOfAFit;
    const auto fit = calibration::detail::fit_rigid(ct_in_order(order_), touched_mm_);
    if (!fit) return;
    double squares = 0;
    for (std::size_t i = 0; i < order_.size(); ++i)
      squares += (ct_mm_[order_[i]] - fit->rotation * touched_mm_[i] - fit->translation_mm).squaredNorm();
    const double fre_mm = std::sqrt(squares / static_cast<double>(order_.size()));
    if (fre_mm >= kWorstFre_mm) return;
    if (fre_mm < best_mm_) {
      second_mm_ = std::exchange(best_mm_, fre_mm);
      best_order_ = order_;
    } else {
      second_mm_ = std::min(second_mm_, fre_mm);
    }
  }

  void descend() {
    if (order_.size() == touched_mm_.size()) return weigh();
    for (std::size_t ct = 0; ct < ct_mm_.size() && !gave_up(); ++ct) {
      if (taken_[ct]) continue;
      ++looks_;
      if (!fits_so_far(ct)) continue;
      taken_[ct] = true;
      order_.push_back(ct);
      descend();
      order_.pop_back();
      taken_[ct] = false;
    }
  }

  Points ct_mm_, touched_mm_;
  Eigen::MatrixXd ct_distances_, touched_distances_;
  std::vector<std::size_t> order_, best_order_;
  std::vector<bool> taken_;
  double best_mm_ = std::numeric_limits<double>::infinity(), second_mm_ = best_mm_;
  std::size_t looks_ = 0;
};

/// All orders weighed; one was found.
Result<AssignmentSearch> searched(Points ct_in_patient_mm, Points touched_in_tracker_mm) {
  const std::size_t touched = touched_in_tracker_mm.size();
  if (touched > ct_in_patient_mm.size()) {
    return Error{Errc::bad_value,
                 fmt::format("{} markers found in the CT, {} touched on the patient: leave out touches that are on no "
                             "marker, or find the missing markers",
                             ct_in_patient_mm.size(), touched)};
  }
  // What no order makes good: too few points, points on a line, no numbers.
  if (auto fit = calibration::detail::fit_rigid(touched_in_tracker_mm, touched_in_tracker_mm); !fit) return fit.error();
  for (const Eigen::Vector3d& p : ct_in_patient_mm) {
    if (!p.allFinite()) return Error{Errc::bad_value, "a CT point has a coordinate that is not a finite number"};
  }
  AssignmentSearch search(ct_in_patient_mm, touched_in_tracker_mm);
  search.run();
  if (search.gave_up()) {
    return Error{Errc::degenerate,
                 fmt::format("{} touched and {} CT points can be matched in too many ways: give the files the same "
                             "order, or remove CT points that are no markers",
                             touched, ct_in_patient_mm.size())};
  }
  if (!search.found()) {
    return Error{
        Errc::degenerate,
        fmt::format("no choice of markers in the CT fits the touched points to {} mm: were they all touched on "
                    "markers, and are both files in mm?",
                    kWorstFre_mm)};
  }
  return search;
}

/// Of the best assignment, whether another fits nearly as well or not; infinite where there is none.
double least_fre_mm(Points ct_in_patient_mm, Points touched_in_tracker_mm) {
  const auto search = searched(ct_in_patient_mm, touched_in_tracker_mm);
  return search ? search->best_mm() : std::numeric_limits<double>::infinity();
}

/// Why no order fits, where a mirrored file or another unit explains it; else the error as it is.
Error explained(const Error& error, Points ct_in_patient_mm, Points touched_in_tracker_mm) {
  constexpr double kGoodFre_mm = 5;
  if (error.code != Errc::degenerate) return error;
  std::vector<Eigen::Vector3d> other(touched_in_tracker_mm.begin(), touched_in_tracker_mm.end());
  for (Eigen::Vector3d& point : other) point.x() *= -1;
  if (const double fre_mm = least_fre_mm(ct_in_patient_mm, other); fre_mm < kGoodFre_mm) {
    return {Errc::degenerate,
            fmt::format("the touched points fit markers of the CT to {:.2f} mm only if they are mirrored: one of the "
                        "two files has one axis with the wrong sign, or two axes exchanged",
                        fre_mm)};
  }
  struct Unit {
    double mm;
    const char* name;
  };
  for (const Unit& unit : {Unit{10, "cm"}, {kMmPerInch, "inches"}, {1000, "metres"}}) {
    for (std::size_t i = 0; i < other.size(); ++i) other[i] = unit.mm * touched_in_tracker_mm[i];
    if (const double fre_mm = least_fre_mm(ct_in_patient_mm, other); fre_mm < kGoodFre_mm) {
      return {Errc::degenerate, fmt::format("the touched points fit markers of the CT to {:.2f} mm if they are in {}: "
                                            "give mm",
                                            fre_mm, unit.name)};
    }
    std::vector<Eigen::Vector3d> ct(ct_in_patient_mm.begin(), ct_in_patient_mm.end());
    for (Eigen::Vector3d& point : ct) point *= unit.mm;
    if (const double fre_mm = least_fre_mm(ct, touched_in_tracker_mm); fre_mm < kGoodFre_mm) {
      return {Errc::degenerate,
              fmt::format("the touched points fit the CT's to {:.2f} mm if the CT's are in {}: give mm", fre_mm,
                          unit.name)};
    }
  }
  return error;
}

std::vector<Eigen::Vector3d> without(Points points, std::size_t left_out) {
  std::vector<Eigen::Vector3d> out(points.begin(), points.end());
  out.erase(out.begin() + static_cast<std::ptrdiff_t>(left_out));
  return out;
}

}  // namespace

std::optional<double> rival_order_fre_mm(Points ct_in_patient_mm, Points touched_in_tracker_mm) {
  constexpr double kClearOdds = 100;
  const auto n = static_cast<double>(touched_in_tracker_mm.size());
  const auto given = calibration::fit_points<Patient, Tracker>(ct_in_patient_mm, touched_in_tracker_mm);
  if (!given) return std::nullopt;
  AssignmentSearch search(ct_in_patient_mm, touched_in_tracker_mm);
  search.run();  // of one that gave up, what it found counts all the same
  const bool given_is_best = std::ranges::is_sorted(search.best_order());
  const double rival_mm = given_is_best ? search.second_mm() : search.best_mm();
  if (!search.found() || !std::isfinite(rival_mm)) return std::nullopt;
  // By the likelihood of the residuals' variance, of which three coordinates a point less six are free.
  const double freedom = 3 * n - 6;
  const double finest_mm2 = freedom * calibration::kFinestLocalisation_mm * calibration::kFinestLocalisation_mm / 3;
  const double odds = std::pow(
      (n * rival_mm * rival_mm + finest_mm2) / (n * given->fre_rms_mm * given->fre_rms_mm + finest_mm2), 0.5 * freedom);
  if (odds > kClearOdds) return std::nullopt;
  return rival_mm;
}

std::optional<std::size_t> odd_touch(Points ct_in_patient_mm, Points touched_in_tracker_mm,
                                     Points ct_of_touches_in_patient_mm, double good_fit_mm) {
  // A touch's own noise makes differences of some tenths of a millimetre.
  constexpr double kTellsApart_mm = 1, kTellsApartTimes = 3;
  std::optional<std::size_t> odd;
  double best_mm = std::numeric_limits<double>::infinity(), second_mm = best_mm;
  for (std::size_t left_out = 0; left_out < touched_in_tracker_mm.size(); ++left_out) {
    const auto others = without(touched_in_tracker_mm, left_out);
    double fre_mm = std::numeric_limits<double>::infinity();
    if (ct_of_touches_in_patient_mm.empty()) {
      fre_mm = least_fre_mm(ct_in_patient_mm, others);
    } else if (const auto fit =
                   calibration::fit_points<Patient, Tracker>(without(ct_of_touches_in_patient_mm, left_out), others)) {
      fre_mm = fit->fre_rms_mm;
    }
    second_mm = std::min(second_mm, std::max(fre_mm, best_mm));
    if (fre_mm >= best_mm) continue;
    best_mm = fre_mm;
    odd = left_out;
  }
  if (best_mm > good_fit_mm || second_mm < std::max(kTellsApart_mm, kTellsApartTimes * best_mm)) return std::nullopt;
  return odd;
}

Result<MatchedFit> match_and_fit(Points ct_in_patient_mm, Points touched_in_tracker_mm) {
  const auto found = searched(ct_in_patient_mm, touched_in_tracker_mm);
  if (!found) return explained(found.error(), ct_in_patient_mm, touched_in_tracker_mm);
  const AssignmentSearch& search = *found;
  if (search.ambiguous()) {
    return Error{Errc::degenerate,
                 fmt::format("the markers cannot be told apart by their distances (FRE {:.1f} mm, and {:.1f} mm in "
                             "another order): place them less evenly, or touch more",
                             search.best_mm(), search.second_mm())};
  }
  auto fit = calibration::fit_points<Patient, Tracker>(search.ct_in_order(search.best_order()), touched_in_tracker_mm);
  if (!fit) return fit.error();
  return MatchedFit{*std::move(fit), search.best_order()};
}

}  // namespace birdseye::host
