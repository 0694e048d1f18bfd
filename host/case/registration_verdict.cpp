#include "host/case/registration_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

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
  return std::acos(std::max(-1.0, least_cosine)) * 180 / std::numbers::pi;
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
  if (found.uncertainty_mm && *found.uncertainty_mm > kSure_mm) {
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
  if (gain < kGain) return {Grade::marginal, {fmt::format("similarity rose by only {:.3f}{}", gain, unit)}, {}};
  std::string reason = fmt::format("similarity rose by {:.3f}{}", gain, unit);
  if (found.uncertainty_mm)
    reason += fmt::format("; the surface is to be expected within {:.1f} mm", *found.uncertainty_mm);
  return {Grade::pass, {reason}, {}};
}

constexpr double kSure_mm = 5;

/// What to do about a target of which too little is known.
std::string views_to_add(const ExpectedErrors& expected) {
  constexpr std::size_t kMost = 3;
  if (expected.open.empty()) return "add views, nearer to the organ or from further aside";
  std::string out = "add views of the organ's ";
  const std::size_t sides = std::min(kMost, expected.open.size());
  for (std::size_t n = 0; n < sides; ++n) {
    if (n > 0) out += n + 1 == sides ? " and " : ", ";
    out += fmt::format("{} ({:.0f} % of it known mostly by the prior, {:.1f} mm rms)", expected.open[n].side,
                       100 * expected.open[n].share, expected.open[n].rms_mm);
  }
  return out;
}

/// Beyond how many mm nothing moved where the surface is seen. Empty: something did.
std::optional<double> nothing_moved_beyond_mm(const ViewRegistration& found) {
  constexpr double kGain_nats = 3, kDeviations = 2;
  const ExpectedErrors& expected = *found.expected;
  if (!expected.seen || !expected.seen_moved_mm) return std::nullopt;
  const bool gains_nothing = found.evidence_of_motion_nats && *found.evidence_of_motion_nats < kGain_nats;
  if (!gains_nothing && *expected.seen_moved_mm >= kDeviations * expected.seen->rms_mm) return std::nullopt;
  return *expected.seen_moved_mm + expected.seen->radius95_mm;
}

/// Touches and matched places that the result is not at odds with.
std::size_t others_that_fit(const ViewRegistration& found) {
  const auto fits = [](const PlaceFit& fit) { return !fit.thought_wrong(); };
  return static_cast<std::size_t>(std::count_if(found.touches.begin(), found.touches.end(), fits) +
                                  std::count_if(found.matched.begin(), found.matched.end(), fits));
}

/// By where the surface is seen.
Verdict by_geometry(const RegistrationCase& c, const ViewRegistration& found) {
  constexpr double kLost_mm = 15, kFits_mm = 2;
  for (std::size_t n = 0; n < found.outline_off_mm.size(); ++n) {
    const std::optional<double>& off_mm = found.outline_off_mm[n];
    if (!off_mm || *off_mm < kFits_mm) continue;
    return {Grade::fail,
            {fmt::format("{}: the organ's outline there is {:.1f} mm off what all views together say: check its "
                         "picture and its pose",
                         c.views[n].name, *off_mm)},
            {}};
  }
  const std::optional<ExpectedErrors>& expected = found.expected;
  const bool known = expected && (c.target_mm ? !expected->targets.empty() : expected->inside.has_value());
  if (!known)
    return {Grade::marginal, {"the error to be expected of the target is not known: it was not asked for"}, {}};
  const ExpectedError target = c.target_mm ? expected->targets.front() : *expected->inside;
  const char* const what = c.target_mm ? "the target" : "the organ's inside";
  if (target.radius95_mm > kSure_mm) {
    return {target.radius95_mm > kLost_mm ? Grade::fail : Grade::marginal,
            {fmt::format("{} may be {:.1f} mm off (95 %), over {} mm: {}", what, target.radius95_mm, kSure_mm,
                         views_to_add(*expected))},
            {}};
  }
  // With little stereo nothing says that pictures and poses belong together, for outlines fit wrong poses too; and the
  // prior may be what makes the target look known.
  constexpr std::size_t kFewest = 100, kFewestOthers = 6;
  constexpr double kHalf = 0.5;
  if (*found.stereo_points < kFewest && (others_that_fit(found) < kFewestOthers || target.left_of_prior >= kHalf)) {
    return {Grade::marginal,
            {fmt::format("only {} places of the surface are seen by two views or more, under {}, and {} touches or "
                         "landmarks fit, under {}, or leave over {:.0f} % of what {} may be off: {}",
                         *found.stereo_points, kFewest, others_that_fit(found), kFewestOthers, 100 * kHalf, what,
                         views_to_add(*expected))},
            {}};
  }
  const auto beyond_mm = nothing_moved_beyond_mm(found);
  if (beyond_mm && *beyond_mm > kSure_mm) {
    return {Grade::marginal,
            {fmt::format("nothing moved beyond {:.1f} mm where the surface is seen, and no more is known of it, over "
                         "{} mm: {}",
                         *beyond_mm, kSure_mm, views_to_add(*expected))},
            {}};
  }
  std::string reason = fmt::format("{} is known within {:.1f} mm (95 %), by {} places of the surface", what,
                                   target.radius95_mm, *found.stereo_points);
  if (beyond_mm) reason += fmt::format("; nothing moved beyond {:.1f} mm where the surface is seen", *beyond_mm);
  return {Grade::pass, {reason}, {}};
}

}  // namespace

Verdict verdict_of(const RegistrationCase& c, const ViewRegistration& found) {
  if (found.folded)
    return {Grade::fail, {"every deformation that was found folds: check the poses; the start is written"}, {}};
  if (found.worse_than_start)
    return {Grade::fail, {"no deformation explains the views better than the start, which is what is written"}, {}};
  return found.stereo_points ? by_geometry(c, found) : by_similarity(c, found);
}

}  // namespace birdseye::host
