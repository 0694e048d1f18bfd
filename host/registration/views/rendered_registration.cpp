#include "host/registration/views/rendered_registration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlopt.hpp>
#include <stdexcept>

#include "host/registration/views/direction_set.hpp"
#include "host/registration/views/patch_field.hpp"

namespace birdseye::host {

namespace {

using Parameters = std::vector<double>;

/// Finer than the gradient's grids, for it is drawn at the pictures' full size.
constexpr double kSpacing_mm = 2;

/// What the optimiser moves, and the field that it makes. The optimiser's own coordinates are even: a step of 1 mm
/// moves the box's points by about 1 mm, root mean square, whichever way it goes.
class Unknowns {
 public:
  Unknowns(const RenderedRegistrationSettings& settings, const Tissue& tissue)
      : tissue_(tissue), control_(settings.control_points), tree_(*PatchOctree::uniform(settings.level)) {
    vertices_ = settings.vertices;
    // The integral of a vertex's squared hat over the unit cube is (2 h / 3)^3, h the side of a patch.
    even_per_mm_ = std::pow(2.0 / 3 / (1 << settings.level), 1.5);
  }

  [[nodiscard]] Parameters closest_to(const DisplacementField& field) const {
    if (!vertices_) return closest_parameters(field, control_, tissue_);
    Parameters out;
    const Eigen::Affine3d place = patient_from_cube(tissue_);
    for (std::size_t i = 0; i < tree_.free_vertices(); ++i) {
      const Eigen::Vector3d u =
          tissue_.patient_from_grid.linear().transpose() * field.displacement(place * tree_.vertex(i));
      out.insert(out.end(), {u.x(), u.y(), u.z()});
    }
    return out;
  }
  [[nodiscard]] std::size_t count() const { return vertices_ ? 3 * tree_.free_vertices() : control_.parameters(); }
  [[nodiscard]] Parameters to_even(Parameters parameters) const {
    if (!vertices_) return control_.to_even(parameters);
    for (double& p : parameters) p *= even_per_mm_;
    return parameters;
  }
  [[nodiscard]] Parameters from_even(Parameters even) const {
    if (!vertices_) return control_.from_even(even);
    for (double& p : even) p /= even_per_mm_;
    return even;
  }
  DisplacementField field(const Parameters& parameters) {
    if (!vertices_) {
      control_.patch(parameters, tissue_.box_mm()).drive(tree_);
    } else {
      std::vector<Eigen::Vector3d> moves;
      for (std::size_t i = 0; i + 2 < parameters.size(); i += 3) {
        const Eigen::Vector3d move_mm(parameters[i], parameters[i + 1], parameters[i + 2]);
        moves.emplace_back(move_mm.cwiseQuotient(tissue_.box_mm()));
      }
      tree_.set_displacements(moves);
    }
    return field_of(tree_, patient_from_cube(tissue_));
  }

 private:
  const Tissue& tissue_;
  ControlGrid control_;
  PatchOctree tree_;
  bool vertices_ = false;
  double even_per_mm_ = 1;
};

/// The best of all that an optimiser asked for, which is not always where it ends.
struct Best {
  double value = -std::numeric_limits<double>::max();
  Parameters parameters;
};

class ParameterSearch {
 public:
  ParameterSearch(Unknowns& unknowns, RenderedViews& views, ViewRegistration& record)
      : unknowns_(unknowns), views_(views), record_(record) {}

  /// Deformations that fold are worth -2 and less: every measure is -1 or more.
  double value(const Parameters& parameters) {
    const DisplacementField field = unknowns_.field(parameters);
    const double least = least_determinant(field);
    ++record_.evaluations;
    const double value = least > 0 ? views_.similarity(field) : std::max(least, -1.0) - 2;
    record_.trace.push_back({1, parameters.size(), value});
    if (value > best_.value) best_ = {value, parameters};
    return value;
  }

  /// After value(start), which is not asked for again.
  const Best& climb(const Parameters& start, const RenderedRegistrationSettings& settings) {
    constexpr double kClose_mm = 0.02;
    const Parameters first = unknowns_.to_even(start);
    const double first_value = best_.value;
    const std::function<double(const Parameters&)> objective = [&](const Parameters& even) {
      if (even == first) return first_value;
      if (record_.evaluations >= settings.most_evaluations) throw nlopt::forced_stop();
      return value(unknowns_.from_even(even));
    };
    try {
      if (settings.optimiser == DirectOptimiser::powell) {
        climb_by_direction_set(objective, first, settings.first_step_mm, kClose_mm);
      } else {
        nlopt::opt optimiser(nlopt::LN_NELDERMEAD, static_cast<unsigned>(first.size()));
        optimiser.set_max_objective(
            [](const Parameters& even, Parameters&, void* asked) {
              return (*static_cast<const std::function<double(const Parameters&)>*>(asked))(even);
            },
            const_cast<void*>(static_cast<const void*>(&objective)));
        optimiser.set_initial_step(settings.first_step_mm);
        optimiser.set_xtol_abs(kClose_mm);
        Parameters even = first;
        double ignored = 0;
        optimiser.optimize(even, ignored);
      }
    } catch (const std::runtime_error&) {
      // It ends so at the limit, or where rounding keeps it from climbing further; the best that it met stands.
    }
    return best_;
  }

 private:
  Unknowns& unknowns_;
  RenderedViews& views_;
  ViewRegistration& record_;
  Best best_;
};

Result<void> check(const std::vector<VideoView>& views, const RenderedRegistrationSettings& settings) {
  if (views.empty()) return Error{Errc::bad_value, "no views to register to"};
  if (settings.initial && least_determinant(*settings.initial) <= 0)
    return Error{Errc::bad_value, "the initial field folds; start from another or from none"};
  if (settings.level < 1 || settings.level > PatchOctree::kDeepest)
    return Error{Errc::bad_value, fmt::format("level {}: give 1 to {}", settings.level, PatchOctree::kDeepest)};
  if (settings.most_evaluations < 1) return Error{Errc::bad_value, "most_evaluations: give 1 or more"};
  return {};
}

}  // namespace

Result<ViewRegistration> register_rendered(const std::vector<VideoView>& views, const Volume& ct, const Volume* labels,
                                           std::span<const int> label_values, const TransferFunction& transfer,
                                           const RenderedRegistrationSettings& settings) {
  if (auto sound = check(views, settings); !sound) return sound.error();
  const auto tissue = tissue_of(ct, labels, label_values, transfer, kSpacing_mm);
  if (!tissue) return tissue.error();
  auto rendered = RenderedViews::make(views, *tissue, settings.similarity);
  if (!rendered) return rendered.error();

  ViewRegistration out;
  Unknowns unknowns(settings, *tissue);
  if (settings.vertices) {
    out.control_points = {0, 0, 0};
    out.why_so_many_points = fmt::format("the {} free vertices of level {}", unknowns.count() / 3, settings.level);
  } else {
    out.control_points = settings.control_points;
    out.why_so_many_points = fmt::format("{}x{}x{} control points, as asked", settings.control_points[0],
                                         settings.control_points[1], settings.control_points[2]);
  }
  Parameters start(unknowns.count(), 0.0);
  if (settings.initial) {
    start = unknowns.closest_to(*settings.initial);
    if (least_determinant(unknowns.field(start)) <= 0)
      return Error{Errc::bad_value, "the initial field folds as these unknowns give it again; give more of them"};
  }

  ParameterSearch search(unknowns, *rendered, out);
  out.similarity_before = search.value(start);
  out.per_view_before = rendered->per_view();
  for (std::size_t n = 0; n < views.size(); ++n) {
    if (out.similarity_before > -2 && rendered->tissue_pixels(n) == 0) {
      return Error{Errc::not_found,
                   fmt::format("{}: sees nothing of the organ; check its pose and the labels", views[n].name)};
    }
  }
  const Best& best = search.climb(start, settings);
  settings.progress(
      fmt::format("{} evaluations: {:.4f} to {:.4f}", out.evaluations, out.similarity_before, best.value));
  out.worse_than_start = best.value <= out.similarity_before;
  out.parameters = best.parameters;
  out.field = out.worse_than_start && settings.initial ? *settings.initial : unknowns.field(out.parameters);
  out.min_jacobian = least_determinant(out.field);
  out.similarity_after = best.value;
  rendered->similarity(out.field);
  out.per_view_after = rendered->per_view();
  return out;
}

}  // namespace birdseye::host
