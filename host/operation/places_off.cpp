#include "host/operation/places_off.hpp"

#include <algorithm>
#include <utility>

namespace birdseye::host {

namespace {

bool is_same(const Eigen::Vector3d& one_mm, const Eigen::Vector3d& other_mm) {
  return (one_mm - other_mm).norm() < kSamePlace_mm;
}

}  // namespace

void PlacesOff::note(PlaceOff place) {
  std::erase_if(places_, [&](const PlaceOff& other) {
    return other.deformed == place.deformed && is_same(other.in_ct_mm, place.in_ct_mm);
  });
  for (PlaceOff& other : places_)
    if (is_same(other.in_ct_mm, place.in_ct_mm)) other.refuses = false;  // how it is now was just seen
  places_.push_back(std::move(place));
}

void PlacesOff::forget_but_refusing() {
  std::erase_if(places_, [](const PlaceOff& place) { return !place.refuses; });
}

void PlacesOff::forget_deformed() {
  for (PlaceOff& place : std::exchange(places_, {})) {
    if (place.deformed && !place.refuses) continue;
    place.deformed = false;
    note(std::move(place));
  }
}

void PlacesOff::forget_at(const Eigen::Vector3d& place_in_ct_mm) {
  std::erase_if(places_, [&](const PlaceOff& place) { return is_same(place.in_ct_mm, place_in_ct_mm); });
}

std::optional<double> PlacesOff::most_mm(bool deformed) const {
  std::optional<double> most;
  for (const PlaceOff& place : places_) {
    const auto counts_instead = [&](const PlaceOff& other) {
      return other.deformed == deformed && is_same(other.in_ct_mm, place.in_ct_mm);
    };
    if (place.deformed != deformed && (!deformed || std::ranges::any_of(places_, counts_instead))) continue;
    most = std::max(most.value_or(0), place.off_mm);
  }
  return most;
}

const PlaceOff* PlacesOff::refusing() const {
  const auto found = std::ranges::find_if(places_, &PlaceOff::refuses);
  return found == places_.end() ? nullptr : &*found;
}

bool PlacesOff::refuses_at(const Eigen::Vector3d& place_in_ct_mm) const {
  return std::ranges::any_of(
      places_, [&](const PlaceOff& place) { return place.refuses && is_same(place.in_ct_mm, place_in_ct_mm); });
}

}  // namespace birdseye::host
