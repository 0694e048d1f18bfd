#include "host/registration/geometry/geometry_registration.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "calibration/base/median.hpp"
#include "host/registration/geometry/believed_deformation.hpp"
#include "host/registration/geometry/expected_errors.hpp"
#include "host/registration/geometry/gathered_points.hpp"
#include "host/registration/geometry/held_out_view.hpp"
#include "host/registration/geometry/hypotheses.hpp"
#include "host/registration/geometry/motion_evidence.hpp"
#include "host/registration/geometry/outlines.hpp"
#include "host/registration/geometry/pose_adjustment.hpp"
#include "host/registration/geometry/similarity_points.hpp"
#include "host/registration/geometry/stereo.hpp"
#include "host/registration/geometry/view_agreement.hpp"

namespace birdseye::host {

namespace {

/// Where stereo finds fewer places than this, places by similarity are taken too.
constexpr std::size_t kLittleStereo = 100;

Error called_off() {
  return {Errc::disconnected, "the registration was called off; nothing of it is kept"};
}

DisplacementField no_deformation(const Volume& ct, const SignedDistance& organ) {
  return field_over(ct, LatticeField(organ));
}

/// The median of how far a view's outline is from the surface; none where it shows too little of one.
std::optional<double> outline_off_mm(const PinholeView& view, const SeenSurface& surface) {
  constexpr double kFarthest_mm = 12;
  constexpr std::size_t kFewest = 12;
  std::vector<double> off_mm;
  for (const SeenPoint& point : outline_points({view}, surface, kFarthest_mm))
    off_mm.push_back(std::abs(surface.distance().distance_mm(point.place_mm)));
  if (off_mm.size() < kFewest) return std::nullopt;
  return median_of(std::move(off_mm));
}

/// A picture and a mask a view, of its camera's size.
Result<void> check_pictures(const std::vector<VideoView>& views, std::span<const RgbView> pictures) {
  if (views.empty()) return Error{Errc::bad_value, "no views to register to"};
  if (pictures.size() != views.size())
    return Error{Errc::bad_value, fmt::format("{} pictures for {} views", pictures.size(), views.size())};
  for (std::size_t n = 0; n < views.size(); ++n) {
    const CameraModel& camera = views[n].camera;
    if (!pictures[n].whole() || pictures[n].width_px != camera.width_px || pictures[n].height_px != camera.height_px ||
        views[n].mask.size() != pictures[n].area_px()) {
      return Error{Errc::bad_value, fmt::format("{}: its picture or mask is not of the camera's {}x{} pixels",
                                                views[n].name, camera.width_px, camera.height_px)};
    }
  }
  return {};
}

std::vector<CameraModel> cameras_of(const std::vector<VideoView>& views) {
  std::vector<CameraModel> out;
  out.reserve(views.size());
  for (const VideoView& view : views) out.push_back(view.camera);
  return out;
}

/// A covariance a view, each of numbers, and of a variance that is none below zero.
Result<void> check_lenses(std::size_t views, const std::vector<std::optional<CameraMatrix>>& covariances) {
  if (!covariances.empty() && covariances.size() != views)
    return Error{Errc::bad_value, fmt::format("{} covariances of lenses for {} views", covariances.size(), views)};
  for (const auto& covariance : covariances) {
    if (covariance && !(covariance->allFinite() && covariance->diagonal().minCoeff() >= 0))
      return Error{Errc::bad_value, "a lens's covariance is none; calibrate the lens again"};
  }
  return {};
}

/// Of the focal length, as a share of it: the largest that a lens's calibration states, 0 where none does.
double stated_focal_sigma(const std::vector<VideoView>& views,
                          const std::vector<std::optional<CameraMatrix>>& covariances) {
  double most = 0;
  for (std::size_t n = 0; n < covariances.size(); ++n) {
    if (covariances[n]) most = std::max(most, std::sqrt((*covariances[n])(0, 0)) / views[n].camera.fx_px);
  }
  return most;
}

/// Places whose error is none would be believed against everything else.
Result<void> check_places(const GeometrySettings& settings) {
  for (std::size_t i = 0; i < settings.touches.size(); ++i) {
    const SeenPoint& touch = settings.touches[i];
    if (!touch.place_mm.allFinite() ||
        !(touch.sigma_mm >= kLeastGivenSigma_mm && touch.sigma_mm <= kMostGivenSigma_mm) || !(touch.shift_mm >= 0)) {
      return Error{Errc::bad_value, fmt::format("touch {}: give a place and a sigma from {} to {} mm", i + 1,
                                                kLeastGivenSigma_mm, kMostGivenSigma_mm)};
    }
  }
  for (std::size_t i = 0; i < settings.matched.size(); ++i) {
    const MatchedPoint& point = settings.matched[i];
    if (!point.rest_mm.allFinite() || !point.seen_mm.allFinite() || !point.covariance_mm2.allFinite() ||
        point.covariance_mm2.llt().info() != Eigen::Success) {
      return Error{Errc::bad_value,
                   fmt::format("matched place {}: give two places, in mm, and a positive definite covariance", i + 1)};
    }
  }
  return {};
}

/// Refuses a view of one grey, and one that sees nothing of the organ as it was at rest.
Result<void> check_seen(const VideoView& view, const PinholeView& pinhole, const SeenSurface& rest) {
  constexpr int kStep_px = 4;
  std::uint8_t least = 255, most = 0;
  for (std::size_t i = 0; i < view.grey.size(); ++i) {
    if (view.mask[i] == 0) continue;
    least = std::min(least, view.grey[i]);
    most = std::max(most, view.grey[i]);
  }
  if (least >= most) {
    return Error{Errc::degenerate,
                 fmt::format("{}: is of one grey; is the lens covered? Take another view", view.name)};
  }
  const DepthMap depths = depth_map(rest, pinhole, kStep_px);
  if (std::any_of(depths.depth_mm.begin(), depths.depth_mm.end(), [](float mm) { return std::isfinite(mm); }))
    return {};
  return Error{Errc::not_found, fmt::format("{}: sees nothing of the organ; check its pose and the labels", view.name)};
}

/// The views with their poses as they were corrected.
std::vector<VideoView> posed(std::vector<VideoView> views, std::span<const PinholeView> by) {
  for (std::size_t n = 0; n < views.size(); ++n) views[n].camera_from_patient = by[n].camera_from_patient;
  return views;
}

/// Matched places of which no axis is known better than a place of the surface can be: smaller errors make places that
/// contradict one another fold whatever the views say.
std::vector<MatchedPoint> no_surer_than_can_be(std::vector<MatchedPoint> matched) {
  constexpr double kLeastSigma_mm = 0.15;
  for (MatchedPoint& point : matched) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(point.covariance_mm2);
    if (axes.eigenvalues()[0] >= kLeastSigma_mm * kLeastSigma_mm) continue;
    const Eigen::Vector3d variances_mm2 = axes.eigenvalues().cwiseMax(kLeastSigma_mm * kLeastSigma_mm);
    point.covariance_mm2 = axes.eigenvectors() * variances_mm2.asDiagonal() * axes.eigenvectors().transpose();
  }
  return matched;
}

/// How the touches fit the result, each by the weight of its point, and what is matched. Of the deformation's points
/// those of the touches are the last, so many.
void tell_fits(std::span<const SeenPoint> touches, std::span<const std::size_t> point_of_touch, std::size_t points,
               std::span<const MatchedPoint> matched, const BelievedDeformation& found, const SeenSurface& surface,
               ViewRegistration& out) {
  constexpr double kKnown_mm = 10;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    PlaceFit fit{std::abs(surface.distance().distance_mm(touches[i].place_mm)), 0};
    for (std::size_t n = 0; n < found.fits.size(); ++n) {
      const auto weights = found.fits[n].weights();
      fit.weight += found.beliefs[n] * weights[weights.size() - points + point_of_touch[i]];
    }
    out.touches.push_back(fit);
  }
  for (std::size_t i = 0; i < matched.size(); ++i) {
    const MatchedPoint& point = matched[i];
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(point.covariance_mm2);
    const Eigen::Vector3d off_mm =
        axes.eigenvectors().transpose() * (seen_place(found.mean, point.rest_mm) - point.seen_mm);
    PlaceFit fit;
    for (Eigen::Index k = 0; k < 3; ++k) {
      if (axes.eigenvalues()[k] < kKnown_mm * kKnown_mm) fit.off_mm = std::hypot(fit.off_mm, off_mm[k]);
    }
    for (std::size_t n = 0; n < found.fits.size(); ++n)
      fit.weight += found.beliefs[n] * found.fits[n].matched_weights()[i];
    out.matched.push_back(fit);
  }
}

}  // namespace

Result<ViewRegistration> register_geometry(const std::vector<VideoView>& views, std::span<const RgbView> pictures,
                                           const Volume& ct, const OrganAtRest& organ,
                                           const GeometrySettings& settings) {
  if (auto good = check_pictures(views, pictures); !good) return good.error();
  if (auto good = check_places(settings); !good) return good.error();
  if (auto good = check_lenses(views.size(), settings.camera_covariances); !good) return good.error();
  const SignedDistance& distance = organ.distance;
  ViewRegistration out;
  std::vector<PinholeView> seen_by;
  const SeenSurface rest(distance);
  const auto lenses = lens_errors(cameras_of(views), settings.camera_covariances);
  for (std::size_t n = 0; n < views.size(); ++n) {
    seen_by.push_back(pinhole_view(views[n], pictures[n]));
    seen_by.back().lens_error = lenses[n];
    if (auto good = check_seen(views[n], seen_by.back(), rest); !good) return good.error();
  }

  if (settings.watch.cancelled()) return called_off();
  const std::vector<PinholeView> as_given = seen_by;
  std::optional<CommonPoseError> common;
  if (auto adjusted = adjusted_poses(seen_by, rest, settings.watch)) {
    common = adjusted->common;
    for (std::size_t n = 0; n < seen_by.size(); ++n)
      seen_by[n] = moved(std::move(seen_by[n]), adjusted->poses.camera_from_patient[n]);
    out.adjusted = std::move(adjusted->poses);
  }

  GatheredRows gathered;
  if (settings.gather_touches) {
    gathered.points = gathered_points(settings.touches, rest);
    gathered.of_row.resize(gathered.points.size());
    std::iota(gathered.of_row.begin(), gathered.of_row.end(), std::size_t{0});
  } else {
    gathered = gathered_rows(settings.touches, rest);
  }
  const std::vector<SeenPoint>& touches = gathered.points;
  const std::vector<MatchedPoint> matched = no_surer_than_can_be(settings.matched);
  // Each round looks nearer to the surface as the round before left it.
  struct Round {
    double grid_px, span_mm, step_mm, outline_mm;
  };
  constexpr std::array kRounds{Round{18, 12, 0.5, 0}, Round{18, 8, 0.4, 9}, Round{18, 6, 0.3, 8},
                               Round{12, 4, 0.25, 5}};
  std::vector<DisplacementPrior> more = hypotheses_of(ct, organ.modes, settings.control_points);
  BelievedDeformation found(distance);
  // The errors that all views share and the organ's motion share out what the views show, by how large either is
  // thought to be; touches tell them apart. The views are moved by what is found of these errors.
  const std::vector<PinholeView> given = seen_by;
  CommonErrors errors = CommonErrors::Zero();
  const auto move_views = [&] {
    for (std::size_t n = 0; common && n < seen_by.size(); ++n) {
      out.adjusted->camera_from_patient[n] = common->without(errors, given[n]);
      seen_by[n] = moved(std::move(seen_by[n]), out.adjusted->camera_from_patient[n]);
    }
  };
  for (const Round& round : kRounds) {
    if (settings.watch.cancelled()) return called_off();
    const SeenSurface surface(seen_distance(distance, found.mean));
    const std::vector<SeenPoint> by_stereo =
        stereo_points(seen_by, surface, {round.grid_px, round.span_mm, round.step_mm});
    out.stereo_points = by_stereo.size();
    if (settings.watch.cancelled()) return called_off();
    std::vector<SeenPoint> by_outlines;
    if (round.outline_mm > 0) by_outlines = outline_points(seen_by, surface, round.outline_mm);
    std::vector<SeenPoint> points = gathered_points(by_stereo, surface);
    const std::vector<SeenPoint> of_outlines = gathered_points(by_outlines, surface);
    points.insert(points.end(), of_outlines.begin(), of_outlines.end());
    const bool last = &round == &kRounds.back();
    if (last && views.size() > 1 && by_stereo.size() < kLittleStereo && settings.by_similarity) {
      if (const auto field = settings.by_similarity(posed(views, seen_by))) {
        const std::vector<SeenPoint> similar = gathered_points(similarity_points(seen_by, distance, *field), surface);
        points.insert(points.end(), similar.begin(), similar.end());
      } else {
        settings.progress(field.error().what);
      }
    }
    points.insert(points.end(), touches.begin(), touches.end());
    const bool nothing = points.empty() && matched.empty();
    if (nothing && (round.outline_mm == 0 || !found.fits.empty())) continue;  // other rounds may say more
    if (nothing) {
      return Error{Errc::not_found,
                   "no place of the surface is found in two views or as an outline: check that pictures, poses and CT "
                   "belong together, or give views nearer to one another"};
    }
    if (!found.fits.empty()) {
      const auto pushed_mm = pushed_place_mm(distance, points, found.mean);
      more = pushed_mm ? push_hypotheses_of(*pushed_mm, -rest.normal(*pushed_mm)) : std::vector<DisplacementPrior>{};
    }
    // What the views as they were given would tell, for it is their errors that are asked for.
    for (std::size_t i = 0; common && i + touches.size() < points.size(); ++i) {
      points[i].by_common_mm = common->at(points[i].place_mm);
      points[i].place_mm += points[i].by_common_mm * errors;
    }
    auto believed = believe(distance, points, more, found, settings.watch, matched);
    if (!believed && settings.watch.cancelled()) return called_off();
    if (!believed) {
      return Error{Errc::degenerate,
                   "no deformation can be worked out from what is seen: check the sigmas of points and landmarks"};
    }
    found = *std::move(believed);
    errors.setZero();
    for (std::size_t n = 0; n < found.fits.size(); ++n) errors += found.beliefs[n] * found.fits[n].common_errors();
    move_views();
    out.evidence_of_motion_nats = evidence_of_motion_nats(distance, points, found, matched);
    ++out.evaluations;
    settings.progress(fmt::format("round {} of {}: {} places by stereo, {} by outlines; most believed: {}",
                                  out.evaluations, kRounds.size(), *out.stereo_points, by_outlines.size(),
                                  found.fits.front().prior().name));
    settings.round_done(static_cast<std::size_t>(out.evaluations), kRounds.size(), points.size());
  }
  if (settings.watch.cancelled()) return called_off();
  out.field = field_over(ct, found.mean);
  out.min_jacobian = least_determinant(out.field);
  out.folded = !(out.min_jacobian > 0);  // what is not a number folds too
  if (out.folded) {
    out.worse_than_start = true;
    out.field = no_deformation(ct, distance);
    out.min_jacobian = 1;
  }
  const SeenSurface surface(seen_distance(distance, found.mean));
  if (!out.folded)
    tell_fits(settings.gather_touches ? touches : settings.touches, gathered.of_row, touches.size(), matched, found,
              surface, out);
  for (const PinholeView& view : seen_by) out.outline_off_mm.push_back(outline_off_mm(view, surface));
  if (settings.estimate_uncertainty && !out.folded) {
    out.expected = expected_errors(distance, found, seen_by, settings.targets_at_rest_mm);
    if (out.expected->surface) out.uncertainty_mm = out.expected->surface->rms_mm;
    out.held_out = held_out_view(distance, seen_by, found, touches, matched);
    out.agreement = view_agreement(as_given, seen_by, surface);
    const auto& stated = settings.camera_covariances;
    out.lens_error_counted =
        !stated.empty() && std::ranges::all_of(stated, [](const auto& c) { return c.has_value(); });
    if (out.agreement) out.agreement->stated_focal_sigma = stated_focal_sigma(views, settings.camera_covariances);
  }
  return out;
}

}  // namespace birdseye::host
