#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/case/bezier_map.hpp"
#include "hw-sim/case/shaped_moves.hpp"
#include "hw-sim/case/subject.hpp"

namespace birdseye::hw_sim {

/// The kinds of deformation that a registration case may have.
enum class DeformationKind { elastic, bezier, bend, push, compression, twist, breathing, pneumoperitoneum };

/// The name that the enumerator has.
std::string name_of(DeformationKind kind);

struct DeformationSettings {
  DeformationKind kind = DeformationKind::elastic;
  std::array<int, 3> inner = {1, 1, 1};  ///< of bezier: inner control points, those that move, along each axis
  double amplitude_mm = 10;              ///< how far that point of the organ's surface moves that moves most; 0: still
  double push_width_mm = 40;             ///< of push: of the dent, at half its depth
};

/// "3", "24", "81".. degrees of freedom, or "3x2x1" inner control points an axis.
Result<std::array<int, 3>> parse_dof(const std::string& text);
/// Takes what --deformation and --dof say, each empty where it is not given, into settings. Degrees of freedom imply
/// bezier and are refused for another kind.
Result<void> parse_deformation(const std::string& kind, const std::string& dof, DeformationSettings& settings);

struct DrawnDeformation {
  std::unique_ptr<const TissueMap> map;
  const BezierMap* patch = nullptr;  ///< the map, where it is one: of bezier, and of an organ that lies still
  std::vector<DrawnNumber> numbers;
};

/// Draws a deformation over the organ's CT by the seed. Refused where every draw folds the tissue or takes the organ
/// out of its CT.
Result<DrawnDeformation> draw_deformation(const OrganShape& organ, const DeformationSettings& settings,
                                          std::uint64_t seed);

}  // namespace birdseye::hw_sim
