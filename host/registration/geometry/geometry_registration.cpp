#include "host/registration/geometry/geometry_registration.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <random>

#include "host/registration/geometry/displacement_fit.hpp"
#include "host/registration/geometry/outlines.hpp"
#include "host/registration/geometry/stereo.hpp"
#include "host/registration/views/rendered_views.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

namespace {

constexpr double kDistanceSpacing_mm = 2, kMargin_mm = 24;
constexpr double kRenderSpacing_mm = 3;

/// What may move an organ: long parts bend it, short ones follow what pushes it; and Bezier patches, which hold still
/// at the faces of the CT's box.
std::vector<DisplacementPrior> priors(const Volume& ct, const std::array<int, 3>& control_points) {
  constexpr double kUsual_mm = 2, kUsualNearby_mm = 0.4, kNearby_mm = 20;
  struct Gaussian {
    double length_mm, sigma_mm, nearby_sigma_mm;
  };
  std::vector<DisplacementPrior> out;
  for (const auto& [length, sigma, nearby] : {Gaussian{65, 4, 0},
                                              {85, 4, 0},
                                              {120, 4, 0},
                                              {85, 2.5, 0},
                                              {120, 1, 0},
                                              {85, 1.2, 0.8},
                                              {85, 0.6, 1.6},
                                              {65, 4, 0.8},
                                              {50, 3, 0}}) {
    DisplacementPrior prior;
    prior.name = fmt::format("{:g} mm over {:g} mm", sigma, length);
    prior.parts.push_back({length, sigma});
    if (nearby > 0) {
      prior.name += fmt::format(" and {:g} mm over {:g} mm", nearby, kNearby_mm);
      prior.parts.push_back({kNearby_mm, nearby});
    }
    prior.log_belief =
        -0.5 * std::pow(std::log(sigma / kUsual_mm), 2) - 0.5 * std::pow(std::log((nearby + 0.1) / kUsualNearby_mm), 2);
    out.push_back(std::move(prior));
  }
  const Eigen::Vector3d last_voxel(ct.size[0] - 1, ct.size[1] - 1, ct.size[2] - 1);
  const Eigen::Affine3d patient_from_cube = ct.patient_from_voxel * Eigen::Scaling(last_voxel);
  for (const double sigma_mm : {20.0, 40.0}) {
    DisplacementPrior prior;
    prior.name = fmt::format("{}x{}x{} control points of {:g} mm", control_points[0], control_points[1],
                             control_points[2], sigma_mm);
    prior.basis = std::make_shared<BezierBasis>(patient_from_cube, control_points, sigma_mm);
    prior.of_seen = true;
    out.push_back(std::move(prior));
  }
  return out;
}

/// Deformations by several hypotheses, how far each is believed, and their mean.
struct Believed {
  explicit Believed(const SignedDistance& organ) : mean(organ) {}

  std::vector<DisplacementFit> fits;
  std::vector<LatticeField> fields;
  std::vector<double> beliefs;  ///< sum to 1
  LatticeField mean;

  /// Of where tissue is seen that lay at rest_mm, mm^2: of each hypothesis, and between them.
  [[nodiscard]] Eigen::Matrix3d covariance(const Eigen::Vector3d& rest_mm) const {
    const Eigen::Vector3d seen_mm = seen_place(mean, rest_mm);
    Eigen::Matrix3d out = Eigen::Matrix3d::Zero();
    std::vector<Eigen::Vector3d> each;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < fits.size(); ++i) {
      each.push_back(seen_place(fields[i], rest_mm));
      middle += beliefs[i] * each.back();
    }
    for (std::size_t i = 0; i < fits.size(); ++i) {
      out += beliefs[i] * (fits[i].covariance(rest_mm, seen_mm) + (each[i] - middle) * (each[i] - middle).transpose());
    }
    return out;
  }
};

/// Tries every prior on some of the points, and those with the most evidence on all of them.
Believed believe(const SignedDistance& organ, std::span<const SeenPoint> points,
                 const std::vector<DisplacementPrior>& priors) {
  constexpr std::array kAnneal_mm{8.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.5, 2.0, 1.6, 1.3, 1.1, 1.0, 1.0, 1.0};
  constexpr std::array kSettle_mm{1.3, 1.0, 1.0, 1.0};
  constexpr std::size_t kFew = 400, kKept = 4;
  /// Residuals are not as independent as the evidence has them (see docs/manual/registration.md).
  constexpr double kTemper = 4;
  const std::span<const SeenPoint> few = points.first(std::min(points.size(), kFew));
  std::vector<std::optional<DisplacementFit>> tried(priors.size());
  tbb::parallel_for(std::size_t{0}, priors.size(), [&](std::size_t i) {
    tried[i] = DisplacementFit::solve(organ, few, priors[i], nullptr, kAnneal_mm);
  });
  std::vector<std::size_t> order(priors.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return tried[a]->log_evidence() > tried[b]->log_evidence(); });
  order.resize(std::min(order.size(), kKept));
  std::vector<std::optional<DisplacementFit>> full(order.size());
  tbb::parallel_for(std::size_t{0}, order.size(), [&](std::size_t i) {
    full[i] = DisplacementFit::solve(organ, points, priors[order[i]], &*tried[order[i]], kSettle_mm);
  });
  Believed out(organ);
  for (std::size_t i = 0; i < order.size(); ++i) {
    out.beliefs.push_back(std::exp((tried[order[i]]->log_evidence() - tried[order.front()]->log_evidence()) / kTemper));
    out.fields.push_back(full[i]->seen_field(organ));
    out.fits.push_back(*std::move(full[i]));
  }
  const double sum = std::accumulate(out.beliefs.begin(), out.beliefs.end(), 0.0);
  for (double& belief : out.beliefs) belief /= sum;
  for (std::size_t n = 0; n < out.mean.size(); ++n) {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < out.fields.size(); ++i) u += out.beliefs[i] * out.fields[i].displacement_mm(n);
    out.mean.set(n, u);
  }
  return out;
}

/// In an order of chance that is the same each time; no more than so many.
void draw(std::vector<SeenPoint>& points, std::size_t most, std::mt19937& random) {
  std::shuffle(points.begin(), points.end(), random);
  if (points.size() > most) points.resize(most);
}

/// The error to be expected of the organ's surface, all of it, root mean square.
double surface_error_mm(const SignedDistance& organ, const Believed& found) {
  constexpr std::size_t kPlaces = 300;
  std::vector<Eigen::Vector3d> places;
  for (int k = 0; k < organ.points()[2]; ++k) {
    for (int j = 0; j < organ.points()[1]; ++j) {
      for (int i = 0; i < organ.points()[0]; ++i) {
        const Eigen::Vector3d place = organ.patient_from_box() * (organ.spacing_mm() * Eigen::Vector3d(i, j, k));
        if (std::abs(organ.distance_mm(place)) < 0.5 * organ.spacing_mm()) places.push_back(place);
      }
    }
  }
  const std::size_t every = std::max<std::size_t>(1, places.size() / kPlaces);
  std::vector<double> variances_mm2((places.size() + every - 1) / every);
  tbb::parallel_for(std::size_t{0}, variances_mm2.size(),
                    [&](std::size_t n) { variances_mm2[n] = found.covariance(places[n * every]).trace(); });
  return std::sqrt(std::accumulate(variances_mm2.begin(), variances_mm2.end(), 0.0) /
                   static_cast<double>(std::max<std::size_t>(1, variances_mm2.size())));
}

Error called_off() {
  return {Errc::disconnected, "the registration was called off; nothing of it is kept"};
}

DisplacementField no_deformation(const Volume& ct, const SignedDistance& organ) {
  return field_over(ct, LatticeField(organ));
}

}  // namespace

Result<ViewRegistration> register_geometry(const std::vector<VideoView>& views, std::span<const RgbView> pictures,
                                           const Volume& ct, const Volume* labels, std::span<const int> label_values,
                                           const TransferFunction& transfer, const GeometrySettings& settings) {
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
  const auto organ =
      signed_distance_of(ct, tissue_voxels(ct, labels, label_values, transfer), kDistanceSpacing_mm, kMargin_mm);
  if (!organ) return organ.error();
  const auto tissue = tissue_of(ct, labels, label_values, transfer, kRenderSpacing_mm);
  if (!tissue) return tissue.error();
  auto rendered = RenderedViews::make(views, *tissue, "mi");
  if (!rendered) return rendered.error();
  ViewRegistration out;
  out.why_so_many_points = "as the evidence weighs the hypotheses";
  out.similarity_before = rendered->similarity(no_deformation(ct, *organ));
  out.per_view_before = rendered->per_view();
  for (std::size_t n = 0; n < views.size(); ++n) {
    if (rendered->tissue_pixels(n) > 0) continue;
    return Error{Errc::not_found,
                 fmt::format("{}: sees nothing of the organ; check its pose and the labels", views[n].name)};
  }
  std::vector<PinholeView> seen_by;
  for (std::size_t n = 0; n < views.size(); ++n) seen_by.push_back(pinhole_view(views[n], pictures[n]));

  // Each round looks nearer to the surface as the round before left it.
  struct Round {
    double span_mm, step_mm, outline_mm;
  };
  constexpr std::array kRounds{Round{12, 0.5, 0}, Round{8, 0.4, 9}, Round{6, 0.3, 8}, Round{4, 0.25, 5}};
  constexpr double kGrid_px = 12;
  constexpr std::size_t kStereo = 700, kOutlines = 300;
  std::mt19937 random(1);
  const std::vector<DisplacementPrior> hypotheses = priors(ct, settings.control_points);
  Believed found(*organ);
  for (const Round& round : kRounds) {
    if (settings.watch.cancelled()) return called_off();
    const SeenSurface surface(seen_distance(*organ, found.mean));
    std::vector<SeenPoint> points = stereo_points(seen_by, surface, {kGrid_px, round.span_mm, round.step_mm});
    out.stereo_points = points.size();
    draw(points, kStereo, random);
    std::vector<SeenPoint> outlines;
    if (round.outline_mm > 0) outlines = outline_points(seen_by, surface, round.outline_mm);
    const std::size_t outlined = outlines.size();
    draw(outlines, kOutlines, random);
    points.insert(points.end(), outlines.begin(), outlines.end());
    draw(points, points.size(), random);
    if (points.empty() && (round.outline_mm == 0 || !found.fits.empty())) continue;  // other rounds may say more
    if (points.empty()) {
      return Error{Errc::not_found,
                   "no place of the surface is found in two views or as an outline: check that pictures, poses and CT "
                   "belong together, or give views nearer to one another"};
    }
    found = believe(*organ, points, hypotheses);
    ++out.evaluations;
    settings.progress(fmt::format("{} places by stereo, {} by outlines; most believed: {}", *out.stereo_points,
                                  outlined, found.fits.front().prior().name));
  }
  if (settings.watch.cancelled()) return called_off();
  out.field = field_over(ct, found.mean);
  out.min_jacobian = least_determinant(out.field);
  out.folded = out.min_jacobian <= 0;
  if (out.folded) {
    out.worse_than_start = true;
    out.field = no_deformation(ct, *organ);
    out.min_jacobian = 1;
  }
  out.similarity_after = rendered->similarity(out.field);
  out.per_view_after = rendered->per_view();
  if (settings.estimate_uncertainty && !out.folded) out.uncertainty_mm = surface_error_mm(*organ, found);
  return out;
}

}  // namespace birdseye::host
