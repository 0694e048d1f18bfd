#include "host/registration/geometry/geometry_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "host/registration/geometry/pose_adjustment.hpp"

namespace birdseye::host {

namespace {

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

/// The view whose outline is much further off than the others' are, where it is off by more than outlines may be.
std::optional<std::size_t> worst_outline(const std::vector<std::optional<double>>& off_mm) {
  constexpr double kLeast_mm = 0.8, kTimes = 4;
  const auto worst = std::ranges::max_element(off_mm);  // none is less than any
  if (worst == off_mm.end() || !*worst) return std::nullopt;
  std::vector<double> others_mm;
  for (auto other = off_mm.begin(); other != off_mm.end(); ++other) {
    if (*other && other != worst) others_mm.push_back(**other);
  }
  if (others_mm.empty() || **worst <= std::max(kLeast_mm, kTimes * median_of(std::move(others_mm))))
    return std::nullopt;
  return static_cast<std::size_t>(worst - off_mm.begin());
}

constexpr double kFocalLeast = 0.02, kFocalSigmas = 5;  // of exact lenses and poses that err, up to 1.5 % were found

/// What a target's error leaves out where a camera's file does not state how well its lens is known.
std::string if_the_lens_is_right(std::size_t views, const std::optional<ViewAgreement>& agreement) {
  constexpr std::size_t kFewest = 3;  // two views fit a wrong lens too, by another organ
  std::string out = ", if the lens is as its camera file says, which states no error";
  if (!agreement || views < kFewest) return out + ": so few views do not tell";
  return out + fmt::format(": the views bear its focal lengths out to {:.0f} %",
                           100 * std::max(kFocalLeast, kFocalSigmas * agreement->focal.sigma));
}

/// Whether the matches between the views speak for other focal lengths, by more than they and the lens's calibration
/// leave open.
bool focal_belied(const ViewAgreement& agreement) {
  const FocalError& focal = agreement.focal;
  return std::abs(focal.share) >
         std::max(kFocalLeast, kFocalSigmas * std::hypot(focal.sigma, agreement.stated_focal_sigma));
}

/// Touches and matched places that the result is not at odds with.
std::size_t others_that_fit(const ViewRegistration& found) {
  const auto fits = [](const PlaceFit& fit) { return !fit.thought_wrong(); };
  return static_cast<std::size_t>(std::count_if(found.touches.begin(), found.touches.end(), fits) +
                                  std::count_if(found.matched.begin(), found.matched.end(), fits));
}

}  // namespace

Verdict geometry_verdict(const std::vector<VideoView>& views, const ViewRegistration& found, JudgedBy by) {
  constexpr double kLost_mm = 15, kFits_mm = 2;
  constexpr double kHeldOut_mm = 0.5, kHeldOutTimes = 3;
  if (found.agreement && focal_belied(*found.agreement)) {
    const double share = found.agreement->focal.share;
    return {
        Grade::fail,
        {fmt::format("the views fit one another better by focal lengths that are {:.1f} % {} than the camera's file "
                     "has them: it is another lens's file, or the lens was zoomed since: calibrate the camera "
                     "again, and give its new file",
                     100 * std::abs(share), share > 0 ? "shorter" : "longer")},
        {}};
  }
  for (std::size_t n = 0; n < found.outline_off_mm.size(); ++n) {
    const std::optional<double>& off_mm = found.outline_off_mm[n];
    if (!off_mm || *off_mm < kFits_mm) continue;
    return {Grade::fail,
            {fmt::format("{}: the organ's outline there is {:.1f} mm off what all views together say: check its "
                         "picture and its pose",
                         views[n].name, *off_mm)},
            {}};
  }
  if (found.agreement && found.agreement->odd) {
    const OddView& odd = *found.agreement->odd;
    return {Grade::fail,
            {fmt::format("{} does not agree with the other views, which put it {:.1f} mm and {:.1f} degrees from where "
                         "its pose has it, while their own poses err by {:.1f} mm and {:.1f} degrees along each axis: "
                         "check its pose and its camera's file, or leave this view out",
                         views[odd.view].name, odd.off.eye_mm, odd.off.turn_rad * kDegPerRad, odd.others.eye_mm,
                         odd.others.angle_rad * kDegPerRad)},
            {}};
  }
  if (found.adjusted && found.adjusted->noise.eye_mm >= kMostPoseNoise.eye_mm) {
    return {Grade::fail,
            {fmt::format("the tracker's poses put the eye {:.0f} mm or more off along each axis, as the views show of "
                         "one another, and poses so far off are not corrected rightly: average more records at each "
                         "view with the scope held still, and check hand-eye",
                         kMostPoseNoise.eye_mm)},
            {}};
  }
  const std::optional<ExpectedErrors>& expected = found.expected;
  const bool named = by == JudgedBy::target;
  if (!expected || (named ? expected->targets.empty() : !expected->inside))
    return {Grade::marginal, {"the error to be expected of the target is not known: it was not asked for"}, {}};
  const ExpectedError target = named ? expected->targets.front() : *expected->inside;
  const char* const what = named ? "the target" : "the organ's inside";
  if (!(target.radius95_mm <= kSure_mm)) {
    return {target.radius95_mm <= kLost_mm ? Grade::marginal : Grade::fail,
            {fmt::format("{} may be {:.1f} mm off (95 %), over {} mm: {}", what, target.radius95_mm, kSure_mm,
                         views_to_add(*expected))},
            {}};
  }
  // A prior may be narrow, and wrong, about a place of which nothing else tells.
  constexpr double kNearlyAll = 0.9;
  if (target.left_of_prior >= kNearlyAll) {
    return {Grade::marginal,
            {fmt::format("nothing that is seen tells of {}, so that its error is a guess: {}", what,
                         views_to_add(*expected))},
            {}};
  }
  // With little stereo nothing says that pictures and poses belong together, for outlines fit wrong poses too; and the
  // prior may be what makes the target look known.
  constexpr std::size_t kFewest = 100, kFewestOthers = 6;
  constexpr double kHalf = 0.5;
  if (*found.stereo_points < kFewest) {
    const std::size_t others = others_that_fit(found);
    std::string lacks;
    if (others < kFewestOthers)
      lacks = fmt::format("{} touches or landmarks fit, under {}", others, kFewestOthers);
    else if (target.left_of_prior >= kHalf)
      lacks = fmt::format("touches and landmarks leave {:.0f} % of what {} may be off, over {:.0f} %",
                          100 * target.left_of_prior, what, 100 * kHalf);
    if (!lacks.empty()) {
      return {Grade::marginal,
              {fmt::format("two views or more see only {} places of the surface, under {}, and {}: {}",
                           *found.stereo_points, kFewest, lacks, views_to_add(*expected))},
              {}};
    }
  }
  if (const auto worst = worst_outline(found.outline_off_mm)) {
    return {Grade::marginal,
            {fmt::format("{} does not agree with the other views: the organ's outline there is {:.1f} mm off what all "
                         "views together say, over four times as much as in the others: check its pose and its "
                         "camera's file, or leave this view out",
                         views[*worst].name, *found.outline_off_mm[*worst])},
            {}};
  }
  if (const auto& held_out = found.held_out;
      held_out && held_out->off_mm > std::max(kHeldOut_mm, kHeldOutTimes * held_out->expected_off_mm)) {
    return {Grade::marginal,
            {fmt::format("{} does not bear out what the other views say: it is {:.1f} mm off, where {:.1f} mm is to be "
                         "expected: check its pose, and hand-eye's error",
                         views[held_out->view].name, held_out->off_mm, held_out->expected_off_mm)},
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
  if (!found.lens_error_counted) reason += if_the_lens_is_right(views.size(), found.agreement);
  if (beyond_mm) reason += fmt::format("; nothing moved beyond {:.1f} mm where the surface is seen", *beyond_mm);
  return {Grade::pass, {reason}, {}};
}

}  // namespace birdseye::host
