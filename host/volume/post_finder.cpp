#include "host/volume/post_finder.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "calibration/base/median.hpp"
#include "host/volume/components.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

constexpr double kNarrowestCavity_mm = 3, kNarrowestPost_mm = 4;
// Of the walls, how many have open air behind them. Posts have 0.75 and more, cavities of the body hardly any.
constexpr double kFree = 0.6, kFreeInDoubt = 0.5, kFreeAsPointedAt = 0.25;
constexpr double kAlike = 0.12;  // in size, of the posts of one set
constexpr double kMostOpen = 0.35;
constexpr double kMostUneven = 0.25;

/// Air that has something within a cavity's length on both sides along at least two of the three voxel axes. So a
/// cavity is found that is open at one end or at two, which connectedness alone would take for the air outside.
void mark_enclosed(const Volume& ct, double longest_mm, std::int16_t air_below_hu, unsigned char* mask) {
  const std::size_t nx = static_cast<std::size_t>(ct.size[0]), ny = static_cast<std::size_t>(ct.size[1]);
  const std::array<std::size_t, 3> stride{1, nx, nx * ny};
  std::fill_n(mask, ct.hu.size(), static_cast<unsigned char>(0));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto length = static_cast<std::size_t>(ct.size[axis]);
    const auto longest = static_cast<std::size_t>(longest_mm / ct.spacing_mm[static_cast<Eigen::Index>(axis)]);
    // A row of neighbouring lines at a time, so that memory is read in its order.
    const std::size_t row = axis == 0 ? 1 : nx;
    const std::size_t across = axis == 2 ? 1 : 2;
    const std::size_t rows_in_plane = axis == 0 ? ny : 1;
    tbb::parallel_for(0, ct.size[across], [&](int plane) {
      std::vector<std::size_t> air_from;
      for (std::size_t r = 0; r < rows_in_plane; ++r) {
        const std::size_t first = static_cast<std::size_t>(plane) * stride[across] + r * nx;
        air_from.assign(row, length);  // length: the air began at the border, or there is none
        for (std::size_t n = 0; n < length; ++n) {
          for (std::size_t i = 0; i < row; ++i) {
            const std::size_t line = first + i;
            if (ct.hu[line + n * stride[axis]] < air_below_hu) continue;
            if (air_from[i] < n && n - air_from[i] <= longest) {
              for (std::size_t m = air_from[i]; m < n; ++m) ++mask[line + m * stride[axis]];
            }
            air_from[i] = n + 1;
          }
        }
      }
    });
  }
  std::transform(mask, mask + ct.hu.size(), mask,
                 [](unsigned char axes) { return static_cast<unsigned char>(axes >= 2 ? 1 : 0); });
}

class PostFinder {
 public:
  PostFinder(const Volume& ct, const PostSearch& search, std::stop_token stop)
      : ct_(ct), search_(search), widest_mm_(search.diameter_mm.value_or(kWidestPost_mm)), stop_(std::move(stop)) {}

  void look(std::int16_t air_below_hu) {
    const auto components =
        components_of(ct_, [&](unsigned char* mask) { mark_enclosed(ct_, widest_mm_, air_below_hu, mask); });
    std::vector<Vector3d> places;
    for (const Component& c : components) {
      const Vector3d place = ct_.patient_from_voxel * c.centre_voxel();
      if (!is_cavity(c) || known(place)) continue;
      seems_free(place) ? places.push_back(place) : pass_over(place);
    }
    std::vector<std::optional<HollowPost>> posts(places.size());
    tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t n) {
      if (!stop_.stop_requested()) posts[n] = fit_hollow_post(ct_, places[n], 1.25 * widest_mm_);
    });
    if (stop_.stop_requested()) return;
    for (std::size_t n = 0; n < places.size(); ++n) posts[n] ? judge(*posts[n]) : pass_over(places[n]);
  }

  FoundMarkers finish() {
    doubt_unlike();
    for (const HollowPost& post : posts_) {
      MarkerFit fit;
      fit.kind = MarkerKind::post;
      fit.centre_in_patient_mm = post.centre_in_patient_mm;
      fit.sigma_mm = post.sigma_mm;
      fit.diameter_mm = post.outer_mm;
      fit.hu = post.wall_hu;
      fit.contrast_hu = post.contrast_hu;
      out_.markers.push_back(fit);
    }
    std::erase_if(out_.doubtful, [this](const DoubtfulMarker& d) { return known(d.centre_in_patient_mm); });
    std::erase_if(others_, [this](const Vector3d& p) { return known(p); });
    out_.passed_over = static_cast<int>(others_.size());
    std::stable_sort(out_.markers.begin(), out_.markers.end(),
                     [](const MarkerFit& a, const MarkerFit& b) { return a.contrast_hu > b.contrast_hu; });
    return std::move(out_);
  }

 private:
  [[nodiscard]] bool is_cavity(const Component& c) const {
    const double volume_mm3 = static_cast<double>(c.voxels) * ct_.spacing_mm.prod();
    const Eigen::Array3d extent_mm = (c.high - c.low + 1).cast<double>() * ct_.spacing_mm.array();
    // At a low threshold the blur leaves little of a small cavity.
    return volume_mm3 > 0.3 * std::numbers::pi / 6 * std::pow(kNarrowestCavity_mm, 3) &&
           (extent_mm <= widest_mm_ + 2 * ct_.spacing_mm.array()).all();
  }
  /// Whether, as coarse rays have it, open air lies round it: what holds for few cavities of a body, and saves their
  /// fits.
  [[nodiscard]] bool seems_free(const Vector3d& place) const {
    constexpr double kAir_hu = -450, kRing_mm = 8;
    const Eigen::Affine3d voxel_from_patient = ct_.patient_from_voxel.inverse();
    const double step_mm = 0.5 * ct_.spacing_mm.minCoeff();
    int free = 0;
    for (int n = 0; n < 27; ++n) {
      const Eigen::Vector3i direction(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      if (direction.isZero()) continue;
      const Vector3d step = voxel_from_patient.linear() * direction.cast<double>().normalized() * step_mm;
      Vector3d voxel = voxel_from_patient * place;
      double last_wall_mm = 0;
      double length_mm = 0;
      while (length_mm < 2 * widest_mm_ + kRing_mm) {
        const Eigen::Array3i at = voxel.array().round().cast<int>();
        if ((at < 0).any() || (at >= Eigen::Array3i(ct_.size[0], ct_.size[1], ct_.size[2])).any()) break;
        if (ct_.at(at.x(), at.y(), at.z()) >= kAir_hu) last_wall_mm = length_mm;
        if (length_mm - last_wall_mm > kRing_mm && length_mm > widest_mm_) break;
        length_mm += step_mm;
        voxel += step;
      }
      free += last_wall_mm < widest_mm_ && length_mm - last_wall_mm > 3 ? 1 : 0;
    }
    return free >= 5;  // of 26
  }

  void judge(const HollowPost& post) {
    const Vector3d& at = post.centre_in_patient_mm;
    if (known(at)) return;
    const double diameter = search_.diameter_mm.value_or(post.outer_mm);
    const bool sized = post.outer_mm >= kNarrowestPost_mm && post.outer_mm <= 1.25 * kWidestPost_mm &&
                       std::abs(std::log(post.outer_mm / diameter)) < 0.3;
    const bool hollow = post.cavity_mm >= kNarrowestCavity_mm && post.cavity_mm < 1.1 * post.outer_mm &&
                        !post.endless && post.open <= kMostOpen && post.uneven <= kMostUneven;
    const double free = post.free / (1 - std::min(post.open, kMostOpen));
    if (!sized || !hollow || free < (search_.pointed_at ? kFreeAsPointedAt : kFreeInDoubt)) {
      pass_over(at);
    } else if (post.cut) {
      doubt(at, "is cut by the border of the CT: scan more of the patient");
    } else if (free < kFree && !search_.pointed_at) {
      doubt(at, fmt::format("has open air behind {:.0f} % of its walls, too little to tell a post from a cavity of the "
                            "body: if it is one, point at it by --near",
                            100 * free));
    } else {
      posts_.push_back(post);
    }
  }
  /// Posts of one set are alike. A blister of a phantom's skin may look like one, and not like the others.
  void doubt_unlike() {
    if (posts_.size() < 4 || search_.pointed_at) return;
    const auto median = [this](double HollowPost::*size) {
      std::vector<double> sizes;
      for (const HollowPost& post : posts_) sizes.push_back(post.*size);
      return median_of(std::move(sizes));
    };
    const double outer_mm = median(&HollowPost::outer_mm);
    const double cavity_mm = median(&HollowPost::cavity_mm);
    std::erase_if(posts_, [&](const HollowPost& post) {
      const bool alike =
          std::abs(post.outer_mm / outer_mm - 1) < kAlike && std::abs(post.cavity_mm / cavity_mm - 1) < kAlike;
      if (!alike)
        doubt(post.centre_in_patient_mm,
              fmt::format(
                  "is unlike the others: {:.1f} mm across with a cavity as a ball of {:.1f} mm, the others {:.1f} "
                  "and {:.1f} mm; if it is one, point at it by --near",
                  post.outer_mm, post.cavity_mm, outer_mm, cavity_mm));
      return !alike;
    });
  }

  [[nodiscard]] bool same(const Vector3d& a, const Vector3d& b) const { return (a - b).norm() < 0.5 * widest_mm_; }
  [[nodiscard]] bool known(const Vector3d& p) const {
    return std::any_of(posts_.begin(), posts_.end(),
                       [&](const HollowPost& post) { return same(post.centre_in_patient_mm, p); });
  }
  void pass_over(const Vector3d& place) {
    if (std::none_of(others_.begin(), others_.end(), [&](const Vector3d& other) { return same(other, place); }))
      others_.push_back(place);
  }
  void doubt(const Vector3d& place, std::string reason) {
    if (std::none_of(out_.doubtful.begin(), out_.doubtful.end(),
                     [&](const DoubtfulMarker& d) { return same(d.centre_in_patient_mm, place); }))
      out_.doubtful.push_back({place, std::move(reason)});
  }

  const Volume& ct_;
  const PostSearch search_;
  const double widest_mm_;
  const std::stop_token stop_;
  FoundMarkers out_;
  std::vector<HollowPost> posts_;
  std::vector<Vector3d> others_;
};

}  // namespace

FoundMarkers find_hollow_posts(const Volume& ct, const PostSearch& search, const std::stop_token& stop) {
  PostFinder finder(ct, search, stop);
  // A thin wall of light plastic fills its voxels so little that they stay far below its density.
  for (const std::int16_t air_below_hu : std::array<std::int16_t, 3>{-700, -450, -250}) {
    if (!stop.stop_requested()) finder.look(air_below_hu);
  }
  return finder.finish();
}

}  // namespace birdseye::host
