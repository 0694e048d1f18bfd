#include "host/case/registration_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"
#include "host/registration/geometry/geometry_verdict.hpp"

namespace birdseye::host {

namespace {

/// The widest angle between two views, seen from the middle of the CT.
double widest_deg(const RegistrationCase& c, const ViewRegistration& found) {
  const Eigen::Vector3d middle(c.ct.size[0] - 1, c.ct.size[1] - 1, c.ct.size[2] - 1);
  const Eigen::Vector3d centre_mm = c.ct.patient_from_voxel * Eigen::Vector3d(0.5 * middle);
  std::vector<Eigen::Vector3d> towards;
  for (const VideoView& view : c.views) {
    const Eigen::Vector3d eye_mm = (view.camera_from_patient * found.patient_from_model).inverse().translation();
    towards.push_back((eye_mm - centre_mm).normalized());
  }
  double least_cosine = 1;
  for (const Eigen::Vector3d& a : towards) {
    for (const Eigen::Vector3d& b : towards) least_cosine = std::min(least_cosine, a.dot(b));
  }
  return std::acos(std::max(-1.0, least_cosine)) * kDegPerRad;
}

/// No deformation explains views that it was not fitted to better than none does.
Verdict nothing_moved_verdict(const ViewRegistration& found) {
  constexpr double kSure_mm = 5;  // as by geometry
  // The radius within which a place is in 95 of 100 cases, of an error that is alike along three axes: the root of the
  // 95 % quantile of chi squared of three degrees of freedom over three.
  constexpr double kRadius95 = 1.614;
  const std::string gain =
      fmt::format("a deformation brings {:+.4f} nats, give or take {:.4f}, in views that it was not fitted to",
                  found.held_out_gain->nats, found.held_out_gain->standard_error_nats);
  if (!found.uncertainty_mm)
    return {Grade::marginal, {fmt::format("nothing moved, but beyond how many mm was not asked: {}", gain)}, {}};
  const double beyond_mm = kRadius95 * *found.uncertainty_mm;
  if (beyond_mm > kSure_mm) {
    return {Grade::marginal,
            {fmt::format("nothing moved beyond {:.1f} mm, and no more is known, over {} mm: add views, or give fewer "
                         "control points; {}",
                         beyond_mm, kSure_mm, gain)},
            {}};
  }
  return {Grade::pass, {fmt::format("nothing moved beyond {:.1f} mm: {}", beyond_mm, gain)}, {}};
}

/// By optimisers that compare renderings with the views.
Verdict by_similarity(const RegistrationCase& c, const ViewRegistration& found) {
  constexpr double kSure_mm = 3, kGain = 0.01, kApart_deg = 10, kNoise = 0.002;
  const char* const unit = c.similarity == "mi" ? " nats" : "";
  for (std::size_t n = 0; n < c.views.size(); ++n) {
    const double gain = found.per_view_after[n] - found.per_view_before[n];
    if (gain < -kNoise) {
      return {Grade::fail,
              {fmt::format("{} is explained worse than before, by {:.3f}{}, for others' sake: check its picture "
                           "and its pose",
                           c.views[n].name, -gain, unit)},
              {}};
    }
  }
  const double gain = found.similarity_after - found.similarity_before;
  if (c.views.size() == 1) return {Grade::marginal, {"a single view says little about depth: add others"}, {}};
  if (const double deg = widest_deg(c, found); deg < kApart_deg) {
    return {Grade::marginal,
            {fmt::format("the views are at most {:.1f} degrees apart, under {}, and so say little about "
                         "depth: add one from the side",
                         deg, kApart_deg)},
            {}};
  }
  const bool nothing_moved = found.held_out_gain && found.held_out_gain->nothing_moved();
  if (!nothing_moved && found.uncertainty_mm && *found.uncertainty_mm > kSure_mm) {
    return {Grade::marginal,
            {fmt::format("the surface may be {:.1f} mm off, over {} mm: add views, or fewer control points",
                         *found.uncertainty_mm, kSure_mm)},
            {}};
  }
  if (found.lamp_at_limit) {
    return {Grade::marginal,
            {"the lamp that explains the views best is no laparoscope's: check that pictures, poses and CT "
             "belong together"},
            {}};
  }
  if (nothing_moved) return nothing_moved_verdict(found);
  if (found.held_out_gain && found.held_out_gain->nats < 2 * found.held_out_gain->standard_error_nats) {
    return {Grade::marginal,
            {fmt::format("the views do not agree that anything moved: a deformation brings {:+.3f} nats, give or take "
                         "{:.3f}, in views that it was not fitted to: add views",
                         found.held_out_gain->nats, found.held_out_gain->standard_error_nats)},
            {}};
  }
  if (gain < kGain) return {Grade::marginal, {fmt::format("similarity rose by only {:.3f}{}", gain, unit)}, {}};
  std::string reason = fmt::format("similarity rose by {:.3f}{}", gain, unit);
  if (found.uncertainty_mm)
    reason += fmt::format("; the surface is to be expected within {:.1f} mm", *found.uncertainty_mm);
  return {Grade::pass, {reason}, {}};
}

}  // namespace

Verdict verdict_of(const RegistrationCase& c, const ViewRegistration& found) {
  if (found.folded)
    return {Grade::fail, {"every deformation that was found folds: check the poses; the start is written"}, {}};
  if (found.worse_than_start)
    return {Grade::fail, {"no deformation explains the views better than the start, which is what is written"}, {}};
  if (!found.stereo_points) return by_similarity(c, found);
  return geometry_verdict(c.views, found, c.target_mm ? JudgedBy::target : JudgedBy::inside);
}

}  // namespace birdseye::host
