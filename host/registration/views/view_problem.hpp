#pragma once

#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/registration/views/control_grid.hpp"
#include "host/registration/views/multi_view.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// Coarse to fine: pictures about so wide, on a grid of this spacing. An organ that fills little of the pictures, or is
/// small itself, still gets so many pixels and points.
struct Resolution {
  int width_px, least_pixels;
  double spacing_mm;
  int least_points;  ///< along the volume's longest side
  int most_steps;
};
inline constexpr Resolution kCoarse{96, 2000, 4, 48, 30}, kFine{128, 3500, 3, 64, 15};
/// What more control points, or any at all, must bring on pixels that were not fitted, nats.
inline constexpr double kWorthwhile = 0.004;

double spacing_mm(const Resolution& resolution, const Volume& ct);

/// What a climb may change; the pose only where it is refined at all.
enum class Free { all, pose };

/// The views at one resolution, and how often they were asked. The pose, where it is refined, is the record's.
class ViewProblem {
 public:
  static Result<ViewProblem> make(const std::vector<VideoView>& views, const Tissue& tissue, const ControlGrid& control,
                                  const Resolution& resolution, const Prior& prior, ViewRegistration& record,
                                  const RegistrationWatch& watch);

  double similarity(const std::vector<double>& parameters, const Headlight& light);

  /// Climbs from start; steps are taken in even coordinates.
  std::vector<double> climb(const std::vector<double>& start, const Headlight& light, int most_steps,
                            Free free = Free::all);

  /// By the control points, then by the pose's unknowns where it is refined.
  std::pair<double, std::vector<double>> value_and_gradient(const std::vector<double>& parameters,
                                                            const PoseUnknowns& pose, const Headlight& light);

  MultiView& views() { return views_; }

 private:
  ViewProblem(const ControlGrid& control, int reduction, MultiView views, ViewRegistration& record,
              const RegistrationWatch& watch)
      : control_(control), reduction_(reduction), views_(std::move(views)), record_(record), watch_(watch) {}

  const ControlGrid& control_;
  int reduction_;
  MultiView views_;
  ViewRegistration& record_;
  const RegistrationWatch& watch_;
};

/// The lamp under which a deformation explains the views best.
Headlight find_light(ViewProblem& problem, const std::vector<double>& parameters, const Headlight& start,
                     bool& at_limit);

}  // namespace birdseye::host
