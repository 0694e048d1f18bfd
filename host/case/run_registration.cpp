#include "host/case/run_registration.hpp"

#include <utility>

#include "host/case/view_pose_check.hpp"
#include "host/registration/geometry/geometry_registration.hpp"
#include "host/registration/views/rendered_registration.hpp"
#include "host/registration/views/tissue.hpp"

namespace birdseye::host {

namespace {
Result<CaseRegistration> alone(Result<ViewRegistration> found) {
  if (!found) return found.error();
  return CaseRegistration{*std::move(found), nullptr};
}
}  // namespace

Result<CaseRegistration> run_registration(const RegistrationCase& c, const TransferFunction& transfer,
                                          bool estimate_uncertainty,
                                          const std::function<void(const std::string&)>& tell) {
  const Volume* const labels = c.labels ? &*c.labels : nullptr;
  if (std::string fault = fault_of_poses(c.views, c.ct, tissue_voxels(c.ct, labels, c.label_values, transfer));
      !fault.empty())
    return Error{Errc::not_found, std::move(fault)};
  if (c.optimiser == "geometry") {
    auto organ = organ_at_rest(c.ct, labels, c.label_values, transfer);
    if (!organ) return organ.error();
    GeometrySettings settings;
    settings.control_points = c.control_points.value_or(settings.control_points);
    settings.estimate_uncertainty = estimate_uncertainty;
    settings.progress = tell;
    if (c.target_mm) settings.targets_at_rest_mm.push_back(*c.target_mm);
    for (const Landmark& landmark : c.landmarks) settings.targets_at_rest_mm.push_back(landmark.rest_mm);
    settings.touches = c.surface_points;
    settings.camera_covariances = c.camera_covariances;
    for (const NamedMatch& match : c.matched) settings.matched.push_back(match.place);
    settings.by_similarity = [&](const std::vector<VideoView>& views) -> Result<DisplacementField> {
      ViewRegistrationSettings by_gradient;
      by_gradient.control_points = settings.control_points;
      by_gradient.estimate_uncertainty = false;
      by_gradient.progress = tell;
      auto found = register_views(views, c.ct, labels, c.label_values, transfer, by_gradient);
      if (!found) return found.error();
      // The field is then the organ at rest, whose places would hold back what geometry finds.
      if (found->worse_than_start || (found->held_out_gain && found->held_out_gain->nothing_moved()))
        return Error{Errc::not_found, "similarity finds no deformation that the views bear out"};
      return std::move(found->field);
    };
    std::vector<RgbView> pictures;
    pictures.reserve(c.pictures.size());
    for (const Picture& picture : c.pictures) pictures.push_back(picture.view());
    auto found = register_geometry(c.views, pictures, c.ct, **organ, settings);
    if (!found) return found.error();
    return CaseRegistration{*std::move(found), *std::move(organ)};
  }
  if (c.optimiser == "gradient") {
    ViewRegistrationSettings settings;
    settings.control_points = c.control_points;
    settings.level = c.level;
    settings.initial = c.initial;
    settings.refine_pose = c.refine_pose;
    settings.prior.pose = c.pose_prior;
    settings.estimate_uncertainty = estimate_uncertainty;
    settings.progress = tell;
    return alone(register_views(c.views, c.ct, labels, c.label_values, transfer, settings));
  }
  RenderedRegistrationSettings settings;
  settings.optimiser = c.optimiser == "powell" ? DirectOptimiser::powell : DirectOptimiser::simplex;
  settings.similarity = c.similarity;
  settings.vertices = c.vertices;
  settings.control_points = c.control_points.value_or(settings.control_points);
  settings.level = c.level;
  settings.initial = c.initial;
  settings.most_evaluations = c.most_evaluations;
  settings.progress = tell;
  return alone(register_rendered(c.views, c.ct, labels, c.label_values, transfer, settings));
}

}  // namespace birdseye::host
