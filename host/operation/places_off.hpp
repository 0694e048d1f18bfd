#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "host/operation/findings.hpp"

namespace birdseye::host {

/// How far places of the CT were off as the pointer was last held there. The same place of the CT as it was taken and
/// of the deformed one are two: either may be off where the other is not.
class PlacesOff {
 public:
  /// In place of what was noted of the same place. Whether it refuses counts of the CT as it was taken and of the
  /// deformed one alike.
  void note(PlaceOff place);
  /// Of another registration nothing of it is known.
  void forget() { places_.clear(); }
  /// The same touches were fitted otherwise: landmarks that were off still speak against them.
  void forget_but_refusing();
  /// The deformation is another, or none. A landmark that was off by it still speaks against the registration.
  void forget_deformed();
  /// Somebody says that there is nothing at this place of the CT.
  void forget_at(const Eigen::Vector3d& place_in_ct_mm);
  void take_up(std::vector<PlaceOff> kept) { places_ = std::move(kept); }

  [[nodiscard]] const std::vector<PlaceOff>& all() const { return places_; }
  /// The most of the CT as it is shown; where a place was not looked at since it was deformed, as it was before.
  [[nodiscard]] std::optional<double> most_mm(bool deformed) const;
  /// A landmark that was off, and has not been found to fit since; null: there is none.
  [[nodiscard]] const PlaceOff* refusing() const;
  [[nodiscard]] bool refuses_at(const Eigen::Vector3d& place_in_ct_mm) const;

 private:
  std::vector<PlaceOff> places_;
};

}  // namespace birdseye::host
