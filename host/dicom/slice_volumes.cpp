#include "host/dicom/slice_volumes.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdlib>
#include <map>

#include "host/dicom/slice_stack.hpp"

namespace birdseye::host {

namespace {

using Slices = std::vector<DicomSlice>;

bool of_one_shape(const DicomSlice& a, const DicomSlice& b) {
  return a.columns == b.columns && a.rows == b.rows && (a.spacing_mm - b.spacing_mm).norm() <= 1e-4 &&
         (a.row - b.row).norm() <= 1e-3 && (a.column - b.column).norm() <= 1e-3;
}

std::vector<Slices> by_shape(const Slices& slices) {
  std::vector<Slices> shapes;
  for (const DicomSlice& slice : slices) {
    const auto same = std::find_if(shapes.begin(), shapes.end(),
                                   [&slice](const Slices& shape) { return of_one_shape(shape.front(), slice); });
    if (same == shapes.end()) {
      shapes.push_back({slice});
    } else {
      same->push_back(slice);
    }
  }
  return shapes;
}

/// The slices at each place along the normal, from its beginning to its end.
std::vector<Slices> by_place(Slices slices) {
  const Eigen::Vector3d normal = slices.front().row.cross(slices.front().column).normalized();
  const auto along = [&normal](const DicomSlice& slice) { return slice.position_mm.dot(normal); };
  std::stable_sort(slices.begin(), slices.end(),
                   [&along](const DicomSlice& a, const DicomSlice& b) { return along(a) < along(b); });
  std::vector<Slices> places;
  for (const DicomSlice& slice : slices) {
    if (places.empty() || along(slice) - along(places.back().back()) >= 0.01) places.emplace_back();
    places.back().push_back(slice);
  }
  return places;
}

std::size_t most_at_a_place(const Slices& slices) {
  std::size_t most = 0;
  for (const Slices& place : by_place(slices)) most = std::max(most, place.size());
  return most;
}

/// How far a stack reaches along its normal, patient frame, mm.
std::pair<double, double> reach(const Slices& slices) {
  const auto places = by_place(slices);
  const Eigen::Vector3d normal = slices.front().row.cross(slices.front().column).normalized();
  return {places.front().front().position_mm.dot(normal), places.back().front().position_mm.dot(normal)};
}

/// Whether volumes that pass through one another have each an even step: two phases at places of their own. Not two
/// that follow one another, with a hole between.
bool are_interleaved(const std::vector<Slices>& groups) {
  const auto first = reach(groups.front());
  return std::all_of(groups.begin(), groups.end(), [&first](const Slices& group) {
    const auto [low, high] = reach(group);
    const double shared = std::min(high, first.second) - std::max(low, first.first);
    return group.size() > 2 && shared > 0.5 * std::min(high - low, first.second - first.first) &&
           stack_slices(group, [](const DicomSlice&) { return std::string(); }).problem.empty();
  });
}

/// Numbers by their value, "2" before "10".
bool comes_before(const std::string& a, const std::string& b) {
  char* a_end = nullptr;
  char* b_end = nullptr;
  const double a_number = std::strtod(a.c_str(), &a_end), b_number = std::strtod(b.c_str(), &b_end);
  if (a_end != a.c_str() && b_end != b.c_str() && a_number != b_number) return a_number < b_number;
  return a < b;
}

std::vector<SliceVolume> by_key(const Slices& slices, SliceKey key) {
  std::map<std::string, Slices, decltype(&comes_before)> groups(&comes_before);
  for (const DicomSlice& slice : slices) groups[slice.key(key)].push_back(slice);
  std::vector<SliceVolume> volumes;
  volumes.reserve(groups.size());
  for (auto& [value, group] : groups) volumes.push_back({std::move(group), slice_key_words(key, value)});
  return volumes;
}

/// The first, second, ... image at each place, by number; only where all places have as many.
std::vector<SliceVolume> by_instance(const Slices& slices) {
  auto places = by_place(slices);
  std::vector<SliceVolume> volumes(places.front().size());
  for (Slices& place : places) {
    if (place.size() != volumes.size()) return {};
    std::stable_sort(place.begin(), place.end(),
                     [](const DicomSlice& a, const DicomSlice& b) { return a.instance < b.instance; });
    for (std::size_t i = 0; i < place.size(); ++i) {
      if (i > 0 && place[i].instance == place[i - 1].instance) return {};
      volumes[i].slices.push_back(place[i]);
      volumes[i].part = fmt::format("image {} of {} at each place", i + 1, place.size());
    }
  }
  return volumes;
}

std::vector<SliceVolume> part_repeats(const Slices& slices);

/// By the first key that leaves fewer at a place, and what is left by further ones: two phases with two kernels each.
std::vector<SliceVolume> by_several_keys(const Slices& slices, std::size_t most) {
  for (std::size_t k = 0; k < kSliceKeys; ++k) {
    const auto volumes = by_key(slices, static_cast<SliceKey>(k));
    const bool fewer = std::all_of(volumes.begin(), volumes.end(),
                                   [most](const SliceVolume& volume) { return most_at_a_place(volume.slices) < most; });
    if (volumes.size() < 2 || volumes.size() > 2 * most || !fewer) continue;
    std::vector<SliceVolume> all;
    for (const SliceVolume& volume : volumes) {
      for (SliceVolume& part : part_repeats(volume.slices)) {
        part.part = part.part.empty() ? volume.part : fmt::format("{}, {}", volume.part, part.part);
        all.push_back(std::move(part));
      }
    }
    return all;
  }
  return {};
}

/// Slices of one shape.
std::vector<SliceVolume> part_repeats(const Slices& slices) {
  const std::size_t most = most_at_a_place(slices);
  std::vector<SliceVolume> whole{{slices, ""}};
  const bool even = most == 1 && stack_slices(slices, [](const DicomSlice&) { return std::string(); }).problem.empty();
  // A bolus is watched at one place: many pictures, and no volume.
  if (even || most == slices.size()) return whole;
  for (std::size_t k = 0; k < kSliceKeys; ++k) {
    auto volumes = by_key(slices, static_cast<SliceKey>(k));
    // A key that changes from slice to slice, as a time does, tells no volumes apart.
    if (volumes.size() < 2 || volumes.size() > std::max<std::size_t>(2 * most, 4)) continue;
    std::vector<Slices> groups;
    groups.reserve(volumes.size());
    for (const SliceVolume& volume : volumes) groups.push_back(volume.slices);
    const bool parted =
        std::all_of(groups.begin(), groups.end(), [](const Slices& group) { return most_at_a_place(group) == 1; });
    if (parted && (most > 1 ? volumes.size() <= 2 * most : are_interleaved(groups))) return volumes;
  }
  if (most == 1) return whole;
  auto volumes = by_several_keys(slices, most);
  if (volumes.empty()) volumes = by_instance(slices);
  return volumes.empty() ? whole : volumes;
}

}  // namespace

std::vector<SliceVolume> part_into_volumes(const std::vector<DicomSlice>& slices) {
  std::vector<SliceVolume> volumes;
  for (const Slices& shape : by_shape(slices)) {
    for (SliceVolume& volume : part_repeats(shape)) volumes.push_back(std::move(volume));
  }
  return volumes;
}

}  // namespace birdseye::host
