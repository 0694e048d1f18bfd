#include "host/volume/marker_near.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "host/volume/marker_finder.hpp"
#include "host/volume/post_finder.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

/// Of the CT what lies within reach of a place, at most.
Volume part_of(const Volume& ct, const Vector3d& place, double reach_mm) {
  const Eigen::Array3d middle = (ct.patient_from_voxel.inverse() * place).array();
  const Eigen::Array3d reach = reach_mm / ct.spacing_mm.array();
  const Eigen::Array3i size(ct.size[0], ct.size[1], ct.size[2]);
  const Eigen::Array3i low = (middle - reach).floor().cast<int>().max(0);
  const Eigen::Array3i high = (middle + reach).ceil().cast<int>().min(size - 1);
  Volume part;
  part.spacing_mm = ct.spacing_mm;
  part.patient_from_voxel = ct.patient_from_voxel * Eigen::Translation3d(low.cast<double>().matrix());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    part.size[axis] = high[a] - low[a] + 1;
  }
  part.hu.reserve(grid_count(part.size));
  for (int k = low.z(); k <= high.z(); ++k) {
    for (int j = low.y(); j <= high.y(); ++j) {
      const auto row = ct.hu.begin() + static_cast<std::ptrdiff_t>(ct.index(low.x(), j, k));
      part.hu.insert(part.hu.end(), row, row + part.size[0]);
    }
  }
  return part;
}

/// The voxels of a part that lie within reach of a place.
class Surroundings {
 public:
  Surroundings(const Volume& part, const Vector3d& place, double reach_mm)
      : part_(part), voxel_from_patient_(part.patient_from_voxel.inverse()), place_(place), reach_mm_(reach_mm) {}

  /// Calls use(place, HU) for each voxel within radius_mm of a place, in the volume's order. Looks only at the box
  /// about that ball.
  template <class Use>
  void within(const Vector3d& at, double radius_mm, const Use& use) const {
    const Eigen::Array3d middle = (voxel_from_patient_ * at).array();
    const Eigen::Array3d reach = radius_mm * voxel_from_patient_.linear().rowwise().norm().array() + 0.01;
    const Eigen::Array3d last(part_.size[0] - 1, part_.size[1] - 1, part_.size[2] - 1);
    const Eigen::Array3i low = (middle - reach).ceil().max(0).cast<int>();
    const Eigen::Array3i high = (middle + reach).floor().min(last).cast<int>();
    for (int k = low.z(); k <= high.z(); ++k) {
      for (int j = low.y(); j <= high.y(); ++j) {
        for (int i = low.x(); i <= high.x(); ++i) {
          const Vector3d p = part_.patient_from_voxel * Vector3d(i, j, k);
          if ((p - at).norm() > radius_mm || (p - place_).norm() > reach_mm_) continue;
          use(p, static_cast<double>(part_.at(i, j, k)));
        }
      }
    }
  }

 private:
  const Volume& part_;
  const Eigen::Affine3d voxel_from_patient_;
  const Vector3d place_;
  const double reach_mm_;
};

/// Whether a ball about a place is brighter than what lies as far again round it, by more than noise leaves of a mean.
bool stands_out(const Surroundings& voxels, const Vector3d& at, double radius_mm) {
  constexpr double kLeast_hu = 40;
  double inside = 0, around = 0, inside_count = 1e-9, around_count = 1e-9;
  voxels.within(at, 2 * radius_mm, [&](const Vector3d& p, double hu) {
    const double off_mm = (p - at).norm();
    (off_mm <= radius_mm ? inside : around) += hu;
    (off_mm <= radius_mm ? inside_count : around_count) += 1;
  });
  return inside / inside_count > around / around_count + kLeast_hu;
}

/// The centres of what is bright about a place: each start moves to the middle of what is brightest within a radius.
std::vector<Vector3d> bright_places(const Volume& part, const Vector3d& place, double radius_mm) {
  const double reach_mm = kPickReach_mm + 2 * radius_mm;
  const Surroundings voxels(part, place, reach_mm);
  double low = 1e9;
  voxels.within(place, reach_mm, [&](const Vector3d&, double hu) { low = std::min(low, hu); });
  std::vector<Vector3d> places;
  for (int start = 0; start < 27; ++start) {
    constexpr int kRounds = 12;
    const Eigen::Vector3i from(start % 3 - 1, start / 3 % 3 - 1, start / 9 - 1);
    Vector3d at = place + 0.5 * kPickReach_mm * from.cast<double>();
    for (int round = 0; round < kRounds; ++round) {
      Vector3d sum = Vector3d::Zero();
      double weights = 1e-9;
      voxels.within(at, radius_mm, [&](const Vector3d& p, double hu) {
        const double weight = (hu - low) * (hu - low);
        sum += weight * p;
        weights += weight;
      });
      const Vector3d before = at;
      at = sum.isZero() ? at : Vector3d(sum / weights);
      if ((at - before).norm() < 1e-3) break;
    }
    const auto known = [&](const Vector3d& other) { return (other - at).norm() < 0.25 * radius_mm; };
    if ((at - place).norm() > kPickReach_mm || std::any_of(places.begin(), places.end(), known)) continue;
    // In even tissue each start stays where it is, and a fit to each would take seconds to find nothing.
    if (stands_out(voxels, at, radius_mm)) places.push_back(at);
  }
  return places;
}

std::vector<MarkerShape> usual_shapes() {
  std::vector<MarkerShape> shapes{
      {MarkerKind::post, 0, 0, 0}, {MarkerKind::ring, 15, 5, 0}, {MarkerKind::cylinder, 15, 5, 4}};
  // A size that is off by a tenth is still taken for a ball.
  constexpr double kLeast_mm = 4, kTimes = 1.25;
  constexpr int kSizes = 7;
  for (int n = 0; n < kSizes; ++n) shapes.push_back({MarkerKind::ball, kLeast_mm * std::pow(kTimes, n), 0, 0});
  return shapes;
}

class NearSearch {
 public:
  NearSearch(const Volume& ct, const Vector3d& place) : ct_(ct), place_(place) {}

  /// named: a person has said that markers are so. Else what hangs together with others has to stand out as bone among
  /// cells and pores does not.
  void look_for(const MarkerShape& shape, bool named) {
    constexpr double kLeastUnnamed = 0.95, kLeastAsNamed = 0.8;  // where cells meet, bone comes to 0.91
    constexpr double kLeastShare = 0.35;                         // of its density over air, over what is round it
    const bool post = shape.kind == MarkerKind::post;
    const double widest_mm = post ? kWidestPost_mm : shape.widest_mm();
    // So much beyond the reach that the part's border disturbs no marker within.
    const Volume part = part_of(ct_, place_, kPickReach_mm + 2 * widest_mm + 8);
    FoundMarkers found;
    if (post) {
      PostSearch search = post_search(shape);
      search.pointed_at = true;
      found = find_hollow_posts(part, search);
    } else {
      found = find_markers(part, {shape, std::nullopt});
      for (const Vector3d& start : bright_places(part, place_, 0.5 * shape.widest_mm())) {
        const auto fit = fit_marker(part, shape, start, Eigen::Matrix3d::Identity());
        if (!fit || fit->explained < (named ? kLeastAsNamed : kLeastUnnamed) || !has_size(part, shape, *fit)) continue;
        if (named || fit->contrast_hu > kLeastShare * (fit->hu + 1000)) found.markers.push_back(*fit);
      }
    }
    for (const MarkerFit& fit : found.markers) {
      if (off_mm(fit.centre_in_patient_mm) <= kPickReach_mm) fits_.push_back(fit);
    }
    for (const DoubtfulMarker& doubt : found.doubtful) {
      if (off_mm(doubt.centre_in_patient_mm) <= kPickReach_mm) doubtful_.push_back(doubt);
    }
    passed_over_ = std::max(passed_over_, found.passed_over);
  }

  [[nodiscard]] Result<MarkerFit> nearest() const {
    std::vector<MarkerFit> fits = fits_;
    // What fits a part of a post (its tip, its stalk) is no marker of its own; of several sizes the best one counts.
    std::erase_if(fits, [&](const MarkerFit& fit) {
      return std::any_of(fits_.begin(), fits_.end(), [&](const MarkerFit& other) {
        const double apart_mm = (fit.centre_in_patient_mm - other.centre_in_patient_mm).norm();
        if (other.kind == MarkerKind::post) return fit.kind != MarkerKind::post && apart_mm < other.diameter_mm;
        return fit.kind != MarkerKind::post && other.explained > fit.explained && apart_mm < 0.5 * other.diameter_mm;
      });
    });
    const auto best = std::min_element(fits.begin(), fits.end(), [this](const MarkerFit& a, const MarkerFit& b) {
      return off_mm(a.centre_in_patient_mm) < off_mm(b.centre_in_patient_mm);
    });
    if (best != fits.end()) return *best;
    return Error{Errc::not_found, fmt::format("no marker within {:g} mm of ({:.1f}, {:.1f}, {:.1f}) mm: {}",
                                              kPickReach_mm, place_.x(), place_.y(), place_.z(), why_none())};
  }

 private:
  [[nodiscard]] double off_mm(const Vector3d& at) const { return (at - place_).norm(); }
  [[nodiscard]] std::string why_none() const {
    if (!doubtful_.empty())
      return fmt::format("what looks like one, {:.1f} mm away, {}", off_mm(doubtful_.front().centre_in_patient_mm),
                         doubtful_.front().reason);
    if (passed_over_ > 0)
      return "what is of about the size there has the shape of none; if it is one, give --shape and its sizes";
    return "there is neither a bright thing nor a cavity of a marker's size; is the place in the patient frame (LPS, "
           "mm)?";
  }

  const Volume& ct_;
  const Vector3d place_;
  std::vector<MarkerFit> fits_;
  std::vector<DoubtfulMarker> doubtful_;
  int passed_over_ = 0;
};

}  // namespace

Result<MarkerFit> find_marker_near(const Volume& ct, const Vector3d& place_in_patient_mm,
                                   const std::optional<MarkerShape>& shape) {
  const Eigen::Array3d voxel = (ct.patient_from_voxel.inverse() * place_in_patient_mm).array();
  const Eigen::Array3d size(ct.size[0], ct.size[1], ct.size[2]);
  if (!((voxel >= -0.5) && (voxel <= size - 0.5)).all()) {
    return Error{Errc::bad_value,
                 fmt::format("({:.1f}, {:.1f}, {:.1f}) mm lies outside of the CT; give a place in the patient frame "
                             "(LPS, mm)",
                             place_in_patient_mm.x(), place_in_patient_mm.y(), place_in_patient_mm.z())};
  }
  NearSearch search(ct, place_in_patient_mm);
  if (shape) {
    search.look_for(*shape, true);
  } else {
    for (const MarkerShape& usual : usual_shapes()) search.look_for(usual, false);
  }
  return search.nearest();
}

}  // namespace birdseye::host
