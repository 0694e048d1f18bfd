#include "host/registration/views/view_registration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/registration/views/confidence.hpp"
#include "host/registration/views/held_out_gain.hpp"
#include "host/registration/views/patch_field.hpp"
#include "host/registration/views/view_problem.hpp"

namespace birdseye::host {

namespace {

using Parameters = std::vector<double>;

constexpr int kFirstSteps = 12, kPoseSteps = 30;
constexpr int kMostControlPoints = 7;

/// Tiles of every view, a quarter of them: left out of the fit to judge it, or all that is left in.
std::vector<VideoView> tiles_of(const std::vector<VideoView>& views, bool held_out) {
  std::vector<VideoView> out = views;
  for (VideoView& view : out) {
    const int tile = std::max(1, view.camera.width_px / 12);
    for (int y = 0; y < view.camera.height_px; ++y) {
      for (int x = 0; x < view.camera.width_px; ++x) {
        const bool mine = (x / tile % 2 == 0) && (y / tile % 2 == 0);
        if (mine != held_out)
          view.mask[static_cast<std::size_t>(y) * static_cast<std::size_t>(view.camera.width_px) +
                    static_cast<std::size_t>(x)] = 0;
      }
    }
  }
  return out;
}

Result<void> check_views(const std::vector<VideoView>& views, ViewProblem& problem, const Parameters& start) {
  problem.similarity(start, {});
  for (std::size_t n = 0; n < views.size(); ++n) {
    if (problem.views().tissue_pixels(n) == 0) {
      return Error{Errc::not_found,
                   fmt::format("{}: sees nothing of the organ; check its pose and the labels", views[n].name)};
    }
  }
  return {};
}

/// How far the surface may be from where it is said to be, root mean square.
double uncertainty_mm(ViewProblem& problem, const Tissue& tissue, const ControlGrid& control,
                      const ViewRegistration& found) {
  constexpr std::size_t kEvery = 5;
  std::vector<std::size_t> surface;
  std::size_t seen = 0;
  const auto half_step_mm = static_cast<float>(0.5 * tissue.spacing_mm.mean());
  for (std::size_t v = 0; v < tissue.depth_mm.size(); ++v) {
    if (std::abs(tissue.depth_mm[v]) < half_step_mm && seen++ % kEvery == 0) surface.push_back(v);
  }
  // Directions: what few control points can change, and the pose.
  constexpr int kFew = 3;
  std::array<int, 3> inner = control.inner_points();
  for (int& n : inner) n = std::min(n, kFew);
  const ControlGrid few(inner);
  const std::size_t deformations = few.parameters();
  std::vector<Parameters> directions;
  for (std::size_t n = 0; n < deformations; ++n) {
    Parameters unit(deformations, 0.0);
    unit[n] = 1;
    directions.push_back(few.refine(few.from_even(unit), control));
  }
  const auto parameters_at = [&](const Parameters& x) {
    Parameters at = found.parameters;
    for (std::size_t n = 0; n < deformations; ++n) {
      for (std::size_t i = 0; i < at.size(); ++i) at[i] += x[n] * directions[n][i];
    }
    return at;
  };
  const auto pose_at = [&](const Parameters& x) {
    PoseUnknowns pose = found.pose.value_or(PoseUnknowns{});
    for (std::size_t n = deformations; n < x.size(); ++n) pose[n - deformations] += x[n];
    return pose;
  };
  const ControlledGrid grid(control, tissue.points);
  Summit summit;
  summit.coordinates = deformations + (found.pose ? found.pose->size() : 0);
  summit.gradient = [&](const Parameters& x) {
    const Parameters by = problem.value_and_gradient(parameters_at(x), pose_at(x), found.light).second;
    Parameters out;
    for (const Parameters& direction : directions)
      out.push_back(std::inner_product(direction.begin(), direction.end(), by.begin(), 0.0));
    out.insert(out.end(), by.begin() + static_cast<std::ptrdiff_t>(found.parameters.size()), by.end());
    return out;
  };
  summit.surface_moves = [&](const Parameters& x) {
    std::vector<float> moves, out;
    grid.displacements(parameters_at(x), moves);
    if (found.pose) problem.views().motion().add_to(tissue, pose_at(x), moves);
    for (const std::size_t v : surface) out.insert(out.end(), {moves[3 * v], moves[3 * v + 1], moves[3 * v + 2]});
    return out;
  };
  return expected_error_mm(summit);
}

std::string times(const std::array<int, 3>& n) {
  return fmt::format("{}x{}x{}", n[0], n[1], n[2]);
}

/// As many control points as bring something on pixels that were not fitted.
Result<std::array<int, 3>> choose_control_points(const std::vector<VideoView>& views, const Tissue& tissue,
                                                 const Headlight& light, const ViewRegistrationSettings& settings,
                                                 ViewRegistration& record) {
  const std::vector<VideoView> fitted = tiles_of(views, false), held_out = tiles_of(views, true);
  std::array<int, 3> best{1, 1, 1};
  double best_value = -1;
  Parameters found(3, 0.0);
  std::array<int, 3> before = best;
  for (int n = 1; n <= kMostControlPoints; n += 2) {
    const std::array<int, 3> now{n, n, n};
    const ControlGrid control(now);
    found = ControlGrid(before).refine(found, control);
    auto fit = ViewProblem::make(fitted, tissue, control, kCoarse, settings.prior, record, settings.watch);
    if (!fit) return fit.error();
    found = fit->climb(found, light, kCoarse.most_steps);
    auto judge = ViewProblem::make(held_out, tissue, control, kCoarse, settings.prior, record, settings.watch);
    if (!judge) return judge.error();
    const double value = judge->similarity(found, light);
    settings.progress(fmt::format("{} control points: {:.4f} nats on held-out pixels", times(now), value));
    if (value < best_value + kWorthwhile) {
      record.why_so_many_points = fmt::format("{} control points: {} bring {:+.4f} nats on held-out pixels, under {}",
                                              times(best), times(now), value - best_value, kWorthwhile);
      return best;
    }
    best = before = now;
    best_value = value;
  }
  record.why_so_many_points = fmt::format("{} control points, the most that are tried", times(best));
  return best;
}

Error called_off() {
  return {Errc::disconnected, "the registration was called off; nothing of it is kept"};
}

}  // namespace

Result<ViewRegistration> register_views(const std::vector<VideoView>& views, const Volume& ct, const Volume* labels,
                                        std::span<const int> label_values, const TransferFunction& transfer,
                                        const ViewRegistrationSettings& settings) {
  if (views.empty()) return Error{Errc::bad_value, "no views to register to"};
  const auto organ = organ_distance(ct, labels, label_values, transfer);
  if (!organ) return organ.error();
  const Tissue coarse = tissue_of(*organ, ct, spacing_mm(kCoarse, ct));
  if (std::none_of(coarse.depth_mm.begin(), coarse.depth_mm.end(), [](float mm) { return mm > 0; })) {
    return Error{Errc::not_found,
                 fmt::format("the organ is thinner than the {:g} mm on which it is looked for by similarity; give "
                             "optimiser = \"geometry\"",
                             spacing_mm(kCoarse, ct))};
  }
  if (settings.initial && least_determinant(*settings.initial) <= 0)
    return Error{Errc::bad_value, "the initial field folds; start from another or from none"};

  ViewRegistration out;
  if (settings.refine_pose) out.pose.emplace();
  const ControlGrid one({1, 1, 1});
  Parameters start_of_one(3, 0.0);
  if (settings.initial) start_of_one = closest_parameters(*settings.initial, one, coarse);
  auto few = ViewProblem::make(views, coarse, one, kCoarse, settings.prior, out, settings.watch);
  if (!few) return few.error();
  if (auto sound = check_views(views, *few, start_of_one); !sound) return sound.error();
  out.light = settings.light.value_or(Headlight{});
  // Rigidly first: a deformation would take a wrong pose for its own.
  if (out.pose) few->climb(start_of_one, out.light, kPoseSteps, Free::pose);
  // What few control points can do, they do without straying.
  const Parameters of_one = few->climb(start_of_one, out.light, kFirstSteps);

  if (settings.control_points) {
    out.control_points = *settings.control_points;
    out.why_so_many_points = fmt::format("{} control points, as asked", times(out.control_points));
  } else {
    const auto chosen = choose_control_points(views, coarse, out.light, settings, out);
    if (!chosen) return chosen.error();
    out.control_points = *chosen;
  }
  if (settings.watch.cancelled()) return called_off();
  const ControlGrid control(out.control_points);
  Parameters start(control.parameters(), 0.0);
  if (settings.initial) {
    start = closest_parameters(*settings.initial, control, coarse);
    if (least_determinant(driven_field(control, start, coarse, settings.level)) <= 0)
      return Error{Errc::bad_value, "the initial field folds as these control points give it again; give more of them"};
  }
  Parameters rough = settings.initial ? start : one.refine(of_one, control);
  auto wide = ViewProblem::make(views, coarse, control, kCoarse, settings.prior, out, settings.watch);
  if (!wide) return wide.error();
  if (!settings.light) {
    // A rough fit first, so that the lamp does not stand in for a deformation.
    out.light = find_light(*wide, wide->climb(rough, out.light, kFirstSteps), out.light, out.lamp_at_limit);
    settings.progress(
        fmt::format("lamp: {:.1f}, {:.1f} mm beside the lens, fall-off {:.1f}, ambient {:.2f}, vignette {:.2f}",
                    out.light.offset_in_camera_mm.x(), out.light.offset_in_camera_mm.y(), out.light.falloff,
                    out.light.ambient, out.light.vignette));
  }

  const Tissue fine = tissue_of(*organ, ct, spacing_mm(kFine, ct));
  if (views.size() >= kFewestToHoldOut && !settings.initial && !out.pose) {
    bool none_at_limit = false;
    const Headlight light_of_none =
        settings.light ? *settings.light : find_light(*wide, start, out.light, none_at_limit);
    const auto gain = gain_on_held_out_views(views, coarse, control, out.light, light_of_none, settings, out);
    if (settings.watch.cancelled()) return called_off();
    if (!gain) return gain.error();
    out.held_out_gain = *gain;
    settings.progress(fmt::format("{:+.4f} nats in views that were not fitted, give or take {:.4f}", gain->nats,
                                  gain->standard_error_nats));
    if (gain->nothing_moved()) {
      out.light = light_of_none;
      out.lamp_at_limit = none_at_limit;
    }
  }
  const bool nothing_moved = out.held_out_gain && out.held_out_gain->nothing_moved();
  Prior prior = settings.prior;
  auto judged = ViewProblem::make(views, fine, control, kFine, prior, out, settings.watch);
  if (!judged) return judged.error();
  ViewProblem& judge = *judged;
  const std::optional<PoseUnknowns> rough_pose = out.pose;
  if (out.pose) out.pose.emplace();
  out.similarity_before = judge.similarity(start, out.light);
  out.per_view_before = judge.views().per_view();
  out.pose = rough_pose;
  constexpr int kTries = 3;
  out.parameters = start;
  for (int attempt = 0; attempt < kTries && !nothing_moved; ++attempt) {
    auto close = ViewProblem::make(views, fine, control, kFine, prior, out, settings.watch);
    auto broad = ViewProblem::make(views, coarse, control, kCoarse, prior, out, settings.watch);
    if (!close || !broad) return (close ? broad : close).error();
    rough = broad->climb(rough, out.light, kCoarse.most_steps);
    out.parameters = close->climb(rough, out.light, kFine.most_steps);
    if (settings.watch.cancelled()) return called_off();
    out.field = driven_field(control, out.parameters, fine, settings.level);
    out.min_jacobian = least_determinant(out.field);
    if (out.min_jacobian > 0) break;
    constexpr double kStiffer = 10;
    prior.strain *= kStiffer;
    settings.progress("the result folds: again, stiffer");
  }
  if (nothing_moved) out.field = driven_field(control, start, fine, settings.level);
  out.similarity_after = judge.similarity(out.parameters, out.light);
  out.per_view_after = judge.views().per_view();
  out.folded = out.min_jacobian <= 0;
  out.worse_than_start = out.similarity_after < out.similarity_before || out.folded;
  if (out.worse_than_start) {
    out.parameters = start;
    if (out.pose) out.pose.emplace();
    out.field = settings.initial ? *settings.initial : driven_field(control, start, fine, settings.level);
    out.min_jacobian = least_determinant(out.field);
    out.similarity_after = out.similarity_before;
    out.per_view_after = out.per_view_before;
  }
  out.centre_mm = judge.views().motion().centre_mm();
  if (out.pose) out.patient_from_model = judge.views().motion().patient_from_model(*out.pose);
  if (settings.estimate_uncertainty && !out.worse_than_start) {
    // By the usual prior: a stiffer one, against folds, knows no more of the organ.
    auto summit = ViewProblem::make(views, coarse, control, kCoarse, settings.prior, out, settings.watch);
    if (!summit) return summit.error();
    out.uncertainty_mm = uncertainty_mm(*summit, coarse, control, out);
  }
  return out;
}

}  // namespace birdseye::host
