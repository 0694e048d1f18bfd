#include "host/registration/views/view_registration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <numeric>

#include "host/registration/views/confidence.hpp"
#include "host/registration/views/patch_field.hpp"

namespace birdseye::host {

namespace {

using Parameters = std::vector<double>;

/// Coarse to fine: pictures about so wide, on a grid of this spacing. An organ that fills little of the pictures, or is
/// small itself, still gets so many pixels and points.
struct Resolution {
  int width_px, least_pixels;
  double spacing_mm;
  int least_points;  ///< along the volume's longest side
  int most_steps;
};
constexpr Resolution kCoarse{96, 2000, 4, 48, 30}, kFine{128, 3500, 3, 64, 15};
constexpr int kFirstSteps = 12, kPoseSteps = 30;
/// What more control points must bring on pixels that were not used, nats.
constexpr double kWorthwhile = 0.004;
constexpr int kMostControlPoints = 7;

double spacing_mm(const Resolution& resolution, const Volume& ct) {
  const Eigen::Vector3d extent_mm = ct.spacing_mm.cwiseProduct(Eigen::Vector3d(ct.size[0], ct.size[1], ct.size[2]));
  return std::min(resolution.spacing_mm, extent_mm.maxCoeff() / resolution.least_points);
}

/// Every so many pixels along each axis.
int reduction_of(const Resolution& resolution, const VideoView& view) {
  const auto counts = view.mask.size() - static_cast<std::size_t>(std::count(view.mask.begin(), view.mask.end(), 0));
  const double most = std::sqrt(static_cast<double>(counts) / resolution.least_pixels);
  return std::max(1, std::min(view.camera.width_px / resolution.width_px, static_cast<int>(most)));
}

/// What a climb may change; the pose only where it is refined at all.
enum class Free { all, pose };

/// The views at one resolution, and how often they were asked. The pose, where it is refined, is the record's.
class Problem {
 public:
  static Result<Problem> make(const std::vector<VideoView>& views, const Tissue& tissue, const ControlGrid& control,
                              const Resolution& resolution, const Prior& prior, ViewRegistration& record,
                              const RegistrationWatch& watch) {
    const int reduction = reduction_of(resolution, views.front());
    auto made = MultiView::make(views, tissue, control, reduction, prior);
    if (!made) return made.error();
    return Problem(control, reduction, *std::move(made), record, watch);
  }

  double similarity(const Parameters& parameters, const Headlight& light) {
    ++record_.evaluations;
    if (record_.pose) views_.set_pose(*record_.pose);
    return views_.similarity(parameters, light);
  }

  /// Climbs from start; steps are taken in even coordinates.
  Parameters climb(const Parameters& start, const Headlight& light, int most_steps, Free free = Free::all) {
    Parameters even = control_.to_even(start);
    const auto inner = static_cast<std::ptrdiff_t>(even.size());
    if (record_.pose) even.insert(even.end(), record_.pose->begin(), record_.pose->end());
    nlopt::opt optimiser(nlopt::LD_LBFGS, static_cast<unsigned>(even.size()));
    const auto objective = [&](const Parameters& x, Parameters& gradient) {
      if (watch_.cancelled()) throw nlopt::forced_stop();
      ++record_.gradient_evaluations;
      PoseUnknowns pose{};
      std::copy(x.begin() + inner, x.end(), pose.begin());
      auto [value, by] = value_and_gradient(control_.from_even({x.begin(), x.begin() + inner}), pose, light);
      if (!gradient.empty()) {
        gradient = control_.gradient_to_even({by.begin(), by.begin() + inner});
        if (free == Free::pose) std::fill(gradient.begin(), gradient.end(), 0.0);
        gradient.insert(gradient.end(), by.begin() + inner, by.end());
      }
      record_.trace.push_back({reduction_, static_cast<std::size_t>(inner), value});
      return value;
    };
    using Objective = decltype(objective);
    optimiser.set_max_objective([](const Parameters& x, Parameters& gradient,
                                   void* data) { return (*static_cast<Objective*>(data))(x, gradient); },
                                const_cast<void*>(static_cast<const void*>(&objective)));
    optimiser.set_maxeval(most_steps);
    optimiser.set_ftol_rel(1e-5);
    double value = 0;
    try {
      optimiser.optimize(even, value);
    } catch (const std::exception&) {
      // It stops so where rounding keeps it from climbing further; what it reached stands.
    }
    if (record_.pose) std::copy(even.begin() + inner, even.end(), record_.pose->begin());
    return control_.from_even({even.begin(), even.begin() + inner});
  }

  /// By the control points, then by the pose's unknowns where it is refined.
  std::pair<double, Parameters> value_and_gradient(const Parameters& parameters, const PoseUnknowns& pose,
                                                   const Headlight& light) {
    views_.set_pose(pose);
    Parameters gradient;
    PoseUnknowns by_pose{};
    const double value = views_.value_and_gradient(parameters, light, gradient, record_.pose ? &by_pose : nullptr);
    if (record_.pose) gradient.insert(gradient.end(), by_pose.begin(), by_pose.end());
    return {value, gradient};
  }

  MultiView& views() { return views_; }

 private:
  Problem(const ControlGrid& control, int reduction, MultiView views, ViewRegistration& record,
          const RegistrationWatch& watch)
      : control_(control), reduction_(reduction), views_(std::move(views)), record_(record), watch_(watch) {}

  const ControlGrid& control_;
  int reduction_;
  MultiView views_;
  ViewRegistration& record_;
  const RegistrationWatch& watch_;
};

/// The lamp under which a deformation explains the views best.
Headlight find_light(Problem& problem, const Parameters& parameters, const Headlight& start, bool& at_limit) {
  const auto light_of = [](const Parameters& x) {
    Headlight light;
    light.offset_in_camera_mm = {10 * x[0], 10 * x[1], 0};
    light.falloff = 2 * x[2];
    light.ambient = 0.1 * x[3];
    light.vignette = x[4];
    return light;
  };
  Parameters x{start.offset_in_camera_mm.x() / 10, start.offset_in_camera_mm.y() / 10, start.falloff / 2,
               std::clamp(start.ambient / 0.1, 0.1, 5.0), start.vignette};
  const auto objective = [&](const Parameters& at, Parameters&) {
    return problem.similarity(parameters, light_of(at));
  };
  using Objective = decltype(objective);
  nlopt::opt optimiser(nlopt::LN_SBPLX, 5);
  optimiser.set_max_objective([](const Parameters& at, Parameters& gradient,
                                 void* data) { return (*static_cast<Objective*>(data))(at, gradient); },
                              const_cast<void*>(static_cast<const void*>(&objective)));
  const Parameters low{-6, -6, 0.5, 0.1, 0}, high{6, 6, 1.5, 5, 0.8};
  optimiser.set_lower_bounds(low);
  optimiser.set_upper_bounds(high);
  optimiser.set_initial_step({0.5, 0.5, 0.2, 0.5, 0.15});
  optimiser.set_maxeval(60);
  double value = 0;
  try {
    optimiser.optimize(x, value);
  } catch (const std::exception&) {
    // As above.
  }
  // Little ambient light and a lens without vignette are no limits but ends of what there is.
  at_limit = false;
  for (const std::size_t i : std::initializer_list<std::size_t>{0, 1, 2, 4}) {
    const double near = 1e-3 * (high[i] - low[i]);
    at_limit = at_limit || x[i] > high[i] - near || (i != 4 && x[i] < low[i] + near);
  }
  return light_of(x);
}

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

Result<void> check_views(const std::vector<VideoView>& views, Problem& problem, const Parameters& start) {
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
double uncertainty_mm(Problem& problem, const Tissue& tissue, const ControlGrid& control,
                      const ViewRegistration& found) {
  constexpr std::size_t kEvery = 5;
  std::vector<std::size_t> surface;
  std::size_t seen = 0;
  for (std::size_t v = 0; v < tissue.occupancy.size(); ++v) {
    constexpr float kInside = 0.7F;
    if (tissue.occupancy[v] > kSurface && tissue.occupancy[v] < kInside && seen++ % kEvery == 0) surface.push_back(v);
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
    auto fit = Problem::make(fitted, tissue, control, kCoarse, settings.prior, record, settings.watch);
    if (!fit) return fit.error();
    found = fit->climb(found, light, kCoarse.most_steps);
    auto judge = Problem::make(held_out, tissue, control, kCoarse, settings.prior, record, settings.watch);
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
  const auto coarse = tissue_of(ct, labels, label_values, transfer, spacing_mm(kCoarse, ct));
  if (!coarse) return coarse.error();
  if (settings.initial && least_determinant(*settings.initial) <= 0)
    return Error{Errc::bad_value, "the initial field folds; start from another or from none"};

  ViewRegistration out;
  if (settings.refine_pose) out.pose.emplace();
  const ControlGrid one({1, 1, 1});
  Parameters start_of_one(3, 0.0);
  if (settings.initial) start_of_one = closest_parameters(*settings.initial, one, *coarse);
  auto few = Problem::make(views, *coarse, one, kCoarse, settings.prior, out, settings.watch);
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
    const auto chosen = choose_control_points(views, *coarse, out.light, settings, out);
    if (!chosen) return chosen.error();
    out.control_points = *chosen;
  }
  if (settings.watch.cancelled()) return called_off();
  const ControlGrid control(out.control_points);
  Parameters start(control.parameters(), 0.0);
  if (settings.initial) {
    start = closest_parameters(*settings.initial, control, *coarse);
    if (least_determinant(driven_field(control, start, *coarse, settings.level)) <= 0)
      return Error{Errc::bad_value, "the initial field folds as these control points give it again; give more of them"};
  }
  Parameters rough = settings.initial ? start : one.refine(of_one, control);
  auto wide = Problem::make(views, *coarse, control, kCoarse, settings.prior, out, settings.watch);
  if (!wide) return wide.error();
  if (!settings.light) {
    // A rough fit first, so that the lamp does not stand in for a deformation.
    out.light = find_light(*wide, wide->climb(rough, out.light, kFirstSteps), out.light, out.lamp_at_limit);
    settings.progress(
        fmt::format("lamp: {:.1f}, {:.1f} mm beside the lens, fall-off {:.1f}, ambient {:.2f}, vignette {:.2f}",
                    out.light.offset_in_camera_mm.x(), out.light.offset_in_camera_mm.y(), out.light.falloff,
                    out.light.ambient, out.light.vignette));
  }

  const auto fine = tissue_of(ct, labels, label_values, transfer, spacing_mm(kFine, ct));
  if (!fine) return fine.error();
  Prior prior = settings.prior;
  auto judged = Problem::make(views, *fine, control, kFine, prior, out, settings.watch);
  if (!judged) return judged.error();
  Problem& judge = *judged;
  const std::optional<PoseUnknowns> rough_pose = out.pose;
  if (out.pose) out.pose.emplace();
  out.similarity_before = judge.similarity(start, out.light);
  out.per_view_before = judge.views().per_view();
  out.pose = rough_pose;
  constexpr int kTries = 3;
  for (int attempt = 0; attempt < kTries; ++attempt) {
    auto close = Problem::make(views, *fine, control, kFine, prior, out, settings.watch);
    auto broad = Problem::make(views, *coarse, control, kCoarse, prior, out, settings.watch);
    if (!close || !broad) return (close ? broad : close).error();
    rough = broad->climb(rough, out.light, kCoarse.most_steps);
    out.parameters = close->climb(rough, out.light, kFine.most_steps);
    if (settings.watch.cancelled()) return called_off();
    out.field = driven_field(control, out.parameters, *fine, settings.level);
    out.min_jacobian = least_determinant(out.field);
    if (out.min_jacobian > 0) break;
    constexpr double kStiffer = 10;
    prior.strain *= kStiffer;
    settings.progress("the result folds: again, stiffer");
  }
  out.similarity_after = judge.similarity(out.parameters, out.light);
  out.per_view_after = judge.views().per_view();
  out.folded = out.min_jacobian <= 0;
  out.worse_than_start = out.similarity_after < out.similarity_before || out.folded;
  if (out.worse_than_start) {
    out.parameters = start;
    if (out.pose) out.pose.emplace();
    out.field = settings.initial ? *settings.initial : driven_field(control, start, *fine, settings.level);
    out.min_jacobian = least_determinant(out.field);
    out.similarity_after = out.similarity_before;
    out.per_view_after = out.per_view_before;
  }
  out.centre_mm = judge.views().motion().centre_mm();
  if (out.pose) out.patient_from_model = judge.views().motion().patient_from_model(*out.pose);
  if (settings.estimate_uncertainty && !out.worse_than_start) {
    // By the usual prior: a stiffer one, against folds, knows no more of the organ.
    auto summit = Problem::make(views, *coarse, control, kCoarse, settings.prior, out, settings.watch);
    if (!summit) return summit.error();
    out.uncertainty_mm = uncertainty_mm(*summit, *coarse, control, out);
  }
  return out;
}

}  // namespace birdseye::host
