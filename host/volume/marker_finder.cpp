#include "host/volume/marker_finder.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "host/volume/components.hpp"
#include "host/volume/post_finder.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

constexpr double kExplained = 0.9;         // a marker; bones in real CTs of the abdomen come to 0.86
constexpr double kExplainedInDoubt = 0.8;  // a marker that another one, or the border, disturbs

std::vector<Component> bright_components(const Volume& ct, std::int16_t threshold) {
  return components_of(ct, [&ct, threshold](unsigned char* mask) {
    std::transform(ct.hu.begin(), ct.hu.end(), mask,
                   [threshold](std::int16_t hu) { return static_cast<unsigned char>(hu >= threshold ? 1 : 0); });
  });
}

bool at_border(const Volume& ct, const Component& c) {
  for (int axis = 0; axis < 3; ++axis) {
    if (c.low[axis] == 0 || c.high[axis] + 1 == ct.size[static_cast<std::size_t>(axis)]) return true;
  }
  return false;
}

enum class Size { other, one, two };

/// Whether one or two markers may be in it, by its box and volume, blooming and voxels that are filled in part allowed
/// for. At the border a part of one is enough.
Size size_of(const Volume& ct, const Component& c, const MarkerShape& shape) {
  const double volume_mm3 = static_cast<double>(c.voxels) * ct.spacing_mm.prod();
  const bool border = at_border(ct, c);
  if (volume_mm3 < (border ? 0.1 : 0.25) * shape.volume_mm3()) return Size::other;
  const Eigen::Array3d extent_mm = (c.high - c.low + 1).cast<double>() * ct.spacing_mm.array();
  const Eigen::Array3d slack_mm = 2 * ct.spacing_mm.array() + 1.5;
  if (!border && (extent_mm + slack_mm < shape.thinnest_mm()).any()) return Size::other;
  if ((extent_mm <= shape.widest_mm() + slack_mm).all()) return Size::one;
  return (extent_mm <= 2 * shape.widest_mm() + slack_mm).all() && volume_mm3 < 6 * shape.volume_mm3() ? Size::two
                                                                                                      : Size::other;
}

/// The principal directions of a component in the patient frame, columns, the longest last.
Eigen::Matrix3d directions_of(const Volume& ct, const Component& c) {
  const Vector3d mean = c.centre_voxel();
  const Eigen::Matrix3d in_voxels = c.squares / static_cast<double>(c.voxels) - mean * mean.transpose();
  const Eigen::Matrix3d linear = ct.patient_from_voxel.linear();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(Eigen::Matrix3d(linear * in_voxels * linear.transpose()));
  return solver.eigenvectors();
}

class Finder {
 public:
  Finder(const Volume& ct, const MarkerShape& shape, std::stop_token stop)
      : ct_(ct), shape_(shape), stop_(std::move(stop)) {}

  void look(const std::vector<Component>& components) {
    std::vector<Candidate> candidates;
    for (const Component& c : components) {
      const Size size = size_of(ct_, c, shape_);
      const Vector3d centre = ct_.patient_from_voxel * c.centre_voxel();
      if (size == Size::two || (size == Size::one && !known(centre))) candidates.push_back({&c, size, centre, {}});
    }
    // What is a marker depends on what was found before, so that only the fits are made side by side.
    tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t n) {
      if (!stop_.stop_requested()) fit(candidates[n]);
    });
    if (stop_.stop_requested()) return;
    for (const Candidate& candidate : candidates) {
      if (candidate.size == Size::two) {
        judge_two(candidate);
      } else {
        judge_one(candidate);
      }
    }
  }

  FoundMarkers finish() {
    // What one threshold left in doubt another may have resolved.
    std::erase_if(out_.doubtful, [this](const DoubtfulMarker& d) { return known(d.centre_in_patient_mm); });
    std::vector<Vector3d> counted;
    for (const Vector3d& p : others_) {
      if (!known(p) && !near(counted, p)) counted.push_back(p);
    }
    out_.passed_over = static_cast<int>(counted.size());
    std::stable_sort(out_.markers.begin(), out_.markers.end(),
                     [](const MarkerFit& a, const MarkerFit& b) { return a.contrast_hu > b.contrast_hu; });
    return std::move(out_);
  }

 private:
  struct Candidate {
    const Component* component;
    Size size;
    Vector3d centre;
    std::vector<std::optional<MarkerFit>> fits;  // one for each marker that it may be
  };

  void fit(Candidate& candidate) const {
    const Eigen::Matrix3d directions = directions_of(ct_, *candidate.component);
    if (candidate.size == Size::one) {
      candidate.fits = {fit_marker(ct_, shape_, candidate.centre, directions)};
      return;
    }
    for (const double side : {-0.5, 0.5}) {
      const Vector3d centre = candidate.centre + side * shape_.diameter_mm * directions.col(2);
      candidate.fits.push_back(fit_marker(ct_, shape_, centre, directions));
    }
  }
  void judge_one(const Candidate& candidate) {
    if (known(candidate.centre)) return;
    const auto& fit = candidate.fits.front();
    const bool border = at_border(ct_, *candidate.component);
    if (!fit || !is_one(*fit, border ? kExplainedInDoubt : kExplained)) {
      others_.push_back(candidate.centre);
    } else if (border || cut(*fit)) {
      doubt(fit->centre_in_patient_mm, "is cut by the border of the CT: scan more of the patient");
    } else if (!known(fit->centre_in_patient_mm)) {
      out_.markers.push_back(*fit);
    }
  }

  [[nodiscard]] bool same(const Vector3d& a, const Vector3d& b) const {
    return (a - b).norm() < shape_.widest_mm() / 2;
  }
  [[nodiscard]] bool near(const std::vector<Vector3d>& places, const Vector3d& p) const {
    return std::any_of(places.begin(), places.end(), [&](const Vector3d& other) { return same(other, p); });
  }
  [[nodiscard]] bool known(const Vector3d& p) const {
    return std::any_of(out_.markers.begin(), out_.markers.end(),
                       [&](const MarkerFit& m) { return same(m.centre_in_patient_mm, p); });
  }

  [[nodiscard]] bool is_one(const MarkerFit& fit, double explained) const {
    return fit.explained >= explained && has_size(ct_, shape_, fit);
  }
  /// Whether the border of the CT runs through the marker, or so near that its edge is not seen.
  [[nodiscard]] bool cut(const MarkerFit& fit) const {
    const Vector3d centre = ct_.patient_from_voxel.inverse() * fit.centre_in_patient_mm;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d direction = ct_.patient_from_voxel.linear().col(axis) / ct_.spacing_mm[axis];
      const double reach = shape_.half_extent_mm(direction, fit.axis) / ct_.spacing_mm[axis];
      const double last = ct_.size[static_cast<std::size_t>(axis)] - 1;
      if (centre[axis] - reach < 0 || centre[axis] + reach > last) return true;
    }
    return false;
  }
  void doubt(const Vector3d& centre, const char* reason) {
    if (std::none_of(out_.doubtful.begin(), out_.doubtful.end(),
                     [&](const DoubtfulMarker& d) { return same(d.centre_in_patient_mm, centre); }))
      out_.doubtful.push_back({centre, reason});
  }
  void judge_two(const Candidate& candidate) {
    const auto& a = candidate.fits[0];
    const auto& b = candidate.fits[1];
    if (!a || !b || !is_one(*a, kExplainedInDoubt) || !is_one(*b, kExplainedInDoubt)) return;
    if (same(a->centre_in_patient_mm, b->centre_in_patient_mm)) return;
    for (const auto& fit : candidate.fits)
      doubt(fit->centre_in_patient_mm, "touches another marker, which pulls its centre: place them apart");
  }

  const Volume& ct_;
  const MarkerShape& shape_;
  const std::stop_token stop_;
  FoundMarkers out_;
  std::vector<Vector3d> others_;
};

std::vector<std::int16_t> thresholds_of(const MarkerSearch& search) {
  if (search.threshold_hu) return {*search.threshold_hu};
  return {300, 700, 1500};
}

/// The shape by so much larger.
MarkerShape scaled(MarkerShape shape, double by) {
  shape.diameter_mm *= by;
  shape.hole_mm *= by;
  shape.height_mm *= by;
  return shape;
}

/// The marker that a component may be, of whatever size its volume tells.
std::optional<MarkerFit> fit_of_any_size(const Volume& ct, const Component& c, const MarkerShape& asked) {
  constexpr double kMost = 5;
  const double by = std::cbrt(static_cast<double>(c.voxels) * ct.spacing_mm.prod() / asked.volume_mm3());
  if (by > kMost || by < 1 / kMost || at_border(ct, c)) return std::nullopt;
  const MarkerShape shape = scaled(asked, by);
  if (!check(shape) || size_of(ct, c, shape) != Size::one) return std::nullopt;
  auto fit = fit_marker(ct, shape, ct.patient_from_voxel * c.centre_voxel(), directions_of(ct, c));
  // The volume over a threshold tells a size poorly: the fit may be of another one.
  constexpr double kNear = 2, kLeastContrast_hu = 80;
  if (!fit || fit->explained < kExplained || std::max(fit->scale, 1 / fit->scale) > kNear ||
      fit->contrast_hu < kLeastContrast_hu) {
    return std::nullopt;
  }
  return fit;
}

/// The size of the most markers, those of one place counted once.
std::optional<OtherSize> commonest_size(const std::vector<MarkerFit>& fits) {
  constexpr double kAlike = 1.2;
  constexpr int kFewest = 3;
  OtherSize best;
  for (const MarkerFit& of : fits) {
    double sum_mm = 0;
    int count = 0;
    for (const MarkerFit& fit : fits) {
      if (fit.diameter_mm > kAlike * of.diameter_mm || of.diameter_mm > kAlike * fit.diameter_mm) continue;
      sum_mm += fit.diameter_mm;
      ++count;
    }
    if (count > best.count) best = {sum_mm / count, count};
  }
  return best.count >= kFewest ? std::optional(best) : std::nullopt;
}

}  // namespace

std::optional<OtherSize> other_size(const Volume& ct, const MarkerSearch& search, const std::stop_token& stop) {
  if (search.shape.kind == MarkerKind::post) return std::nullopt;
  std::vector<MarkerFit> fits;
  for (const std::int16_t threshold : thresholds_of(search)) {
    const std::vector<Component> components = bright_components(ct, threshold);
    std::vector<std::optional<MarkerFit>> found(components.size());
    tbb::parallel_for(std::size_t{0}, components.size(), [&](std::size_t n) {
      if (!stop.stop_requested()) found[n] = fit_of_any_size(ct, components[n], search.shape);
    });
    for (const auto& fit : found) {
      if (fit && std::ranges::none_of(fits, [&](const MarkerFit& other) {
            return (other.centre_in_patient_mm - fit->centre_in_patient_mm).norm() < other.diameter_mm / 2;
          }))
        fits.push_back(*fit);
    }
  }
  std::erase_if(fits, [&](MarkerFit fit) {
    fit.scale = fit.diameter_mm / search.shape.diameter_mm;
    return has_size(ct, search.shape, fit);
  });
  return commonest_size(fits);
}

FoundMarkers find_markers(const Volume& ct, const MarkerSearch& search, const std::stop_token& stop) {
  if (search.shape.kind == MarkerKind::post) return find_hollow_posts(ct, post_search(search.shape), stop);
  Finder finder(ct, search.shape, stop);
  for (const std::int16_t threshold : thresholds_of(search)) {
    if (!stop.stop_requested()) finder.look(bright_components(ct, threshold));
  }
  return finder.finish();
}

}  // namespace birdseye::host
