#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/registration/views/rendered_views.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

enum class DirectOptimiser {
  simplex,  ///< Nelder and Mead's downhill simplex, of NLopt
  powell,   ///< Powell's direction set: direction_set.hpp
};

struct RenderedRegistrationSettings {
  DirectOptimiser optimiser = DirectOptimiser::simplex;
  std::string similarity = "mi";  ///< one of similarity_names()
  /// The unknowns: the free vertices of an octree of this level, or the inner control points of a Bezier patch that
  /// drives them.
  bool vertices = false;
  std::array<int, 3> control_points{1, 1, 1};
  int level = 5;
  /// Where to start; must not fold. The deformation of the chosen kind that comes closest to it is taken.
  std::optional<DisplacementField> initial;
  int most_evaluations = 400;
  /// Size of the first steps, root mean square over the organ's box: about a third of how far the organ's surface may
  /// have moved.
  double first_step_mm = 2;
  std::function<void(const std::string&)> progress = [](const std::string&) {};
};

/// The paper's registration: an optimiser that asks for values alone, of pictures at their full size. Deformations that
/// fold are worth less than any that does not. Gives what register_views() gives, but no uncertainty and no lamp;
/// similarity in the measure's own unit. Parameters are mm along the box's axes, three a control point or free vertex;
/// control_points is zero for vertices. Refuses what register_views() refuses, and an unknown similarity.
Result<ViewRegistration> register_rendered(const std::vector<VideoView>& views, const Volume& ct, const Volume* labels,
                                           std::span<const int> label_values, const TransferFunction& transfer,
                                           const RenderedRegistrationSettings& settings);

}  // namespace birdseye::host
