#include "host/volume/marker_finder.hpp"

#include <itkConnectedComponentImageFilter.h>
#include <itkImage.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

using Eigen::Vector3d;
using Mask = itk::Image<unsigned char, 3>;
using Components = itk::Image<unsigned int, 3>;

constexpr double kExplained = 0.9;         // a marker; bones in real CTs of the abdomen come to 0.86
constexpr double kExplainedInDoubt = 0.8;  // a marker that another one, or the border, disturbs
constexpr double kLeastContrast_hu = 80;

/// Connected voxels over a threshold.
struct Component {
  Eigen::Array3i low{1 << 30, 1 << 30, 1 << 30}, high{-1, -1, -1};
  std::size_t voxels = 0;
  Vector3d sum = Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  [[nodiscard]] Vector3d centre_voxel() const { return sum / static_cast<double>(voxels); }
};

std::vector<Component> bright_components(const Volume& ct, std::int16_t threshold) {
  const auto mask = Mask::New();
  Mask::SizeType size;
  for (unsigned axis = 0; axis < 3; ++axis) size[axis] = static_cast<itk::SizeValueType>(ct.size[axis]);
  mask->SetRegions(size);
  mask->Allocate();
  std::transform(ct.hu.begin(), ct.hu.end(), mask->GetBufferPointer(),
                 [threshold](std::int16_t hu) { return static_cast<unsigned char>(hu >= threshold ? 1 : 0); });
  const auto label = itk::ConnectedComponentImageFilter<Mask, Components>::New();
  label->SetInput(mask);
  label->FullyConnectedOn();
  label->Update();
  std::vector<Component> components(label->GetObjectCount());
  const unsigned* labels = label->GetOutput()->GetBufferPointer();
  for (int k = 0; k < ct.size[2]; ++k) {
    for (int j = 0; j < ct.size[1]; ++j) {
      for (int i = 0; i < ct.size[0]; ++i) {
        const unsigned id = labels[ct.index(i, j, k)];
        if (id == 0) continue;
        Component& c = components[id - 1];
        const Eigen::Array3i here(i, j, k);
        const Vector3d p(i, j, k);
        c.low = c.low.min(here);
        c.high = c.high.max(here);
        c.sum += p;
        c.squares += p * p.transpose();
        ++c.voxels;
      }
    }
  }
  return components;
}

bool at_border(const Volume& ct, const Component& c) {
  for (int axis = 0; axis < 3; ++axis) {
    if (c.low[axis] == 0 || c.high[axis] + 1 == ct.size[static_cast<std::size_t>(axis)]) return true;
  }
  return false;
}

enum class Size { other, one, two };

/// Whether one or two markers may be in it, by its box and volume, blooming and voxels that are filled in part allowed
/// for. At the border a part of one is enough.
Size size_of(const Volume& ct, const Component& c, const MarkerShape& shape) {
  const double volume_mm3 = static_cast<double>(c.voxels) * ct.spacing_mm.prod();
  const bool border = at_border(ct, c);
  if (volume_mm3 < (border ? 0.1 : 0.25) * shape.volume_mm3()) return Size::other;
  const Eigen::Array3d extent_mm = (c.high - c.low + 1).cast<double>() * ct.spacing_mm.array();
  const Eigen::Array3d slack_mm = 2 * ct.spacing_mm.array() + 1.5;
  if (!border && (extent_mm + slack_mm < shape.thinnest_mm()).any()) return Size::other;
  if ((extent_mm <= shape.widest_mm() + slack_mm).all()) return Size::one;
  return (extent_mm <= 2 * shape.widest_mm() + slack_mm).all() && volume_mm3 < 6 * shape.volume_mm3() ? Size::two
                                                                                                      : Size::other;
}

/// The principal directions of a component in the patient frame, columns, the longest last.
Eigen::Matrix3d directions_of(const Volume& ct, const Component& c) {
  const Vector3d mean = c.centre_voxel();
  const Eigen::Matrix3d in_voxels = c.squares / static_cast<double>(c.voxels) - mean * mean.transpose();
  const Eigen::Matrix3d linear = ct.patient_from_voxel.linear();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(Eigen::Matrix3d(linear * in_voxels * linear.transpose()));
  return solver.eigenvectors();
}

class Finder {
 public:
  Finder(const Volume& ct, const MarkerShape& shape) : ct_(ct), shape_(shape) {}

  void look(const Component& c) {
    const Size size = size_of(ct_, c, shape_);
    if (size == Size::other) return;
    const Vector3d centre = ct_.patient_from_voxel * c.centre_voxel();
    if (size == Size::two) return look_at_two(c, centre);
    if (known(centre)) return;
    const auto fit = fit_marker(ct_, shape_, centre, directions_of(ct_, c));
    if (!fit || !is_one(*fit, at_border(ct_, c) ? kExplainedInDoubt : kExplained)) {
      others_.push_back(centre);
    } else if (at_border(ct_, c) || cut(*fit)) {
      doubt(fit->centre_in_patient_mm, "is cut by the border of the CT: scan more of the patient");
    } else if (!known(fit->centre_in_patient_mm)) {
      out_.markers.push_back(*fit);
    }
  }

  FoundMarkers finish() {
    // What one threshold left in doubt another may have resolved.
    std::erase_if(out_.doubtful, [this](const DoubtfulMarker& d) { return known(d.centre_in_patient_mm); });
    std::vector<Vector3d> counted;
    for (const Vector3d& p : others_) {
      if (!known(p) && !near(counted, p)) counted.push_back(p);
    }
    out_.passed_over = static_cast<int>(counted.size());
    std::stable_sort(out_.markers.begin(), out_.markers.end(),
                     [](const MarkerFit& a, const MarkerFit& b) { return a.contrast_hu > b.contrast_hu; });
    return std::move(out_);
  }

 private:
  [[nodiscard]] bool same(const Vector3d& a, const Vector3d& b) const {
    return (a - b).norm() < shape_.widest_mm() / 2;
  }
  [[nodiscard]] bool near(const std::vector<Vector3d>& places, const Vector3d& p) const {
    return std::any_of(places.begin(), places.end(), [&](const Vector3d& other) { return same(other, p); });
  }
  [[nodiscard]] bool known(const Vector3d& p) const {
    return std::any_of(out_.markers.begin(), out_.markers.end(),
                       [&](const MarkerFit& m) { return same(m.centre_in_patient_mm, p); });
  }

  [[nodiscard]] bool is_one(const MarkerFit& fit, double explained) const {
    // A size that is off by a tenth, and by a part of a voxel, is the threshold's and the scanner's doing.
    const double slack = 0.12 + 0.3 * ct_.spacing_mm.minCoeff() / shape_.diameter_mm;
    return fit.explained >= explained && fit.contrast_hu >= kLeastContrast_hu && std::abs(std::log(fit.scale)) < slack;
  }
  /// Whether the border of the CT runs through the marker, or so near that its edge is not seen.
  [[nodiscard]] bool cut(const MarkerFit& fit) const {
    const Vector3d centre = ct_.patient_from_voxel.inverse() * fit.centre_in_patient_mm;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d direction = ct_.patient_from_voxel.linear().col(axis) / ct_.spacing_mm[axis];
      const double reach = shape_.half_extent_mm(direction, fit.axis) / ct_.spacing_mm[axis];
      const double last = ct_.size[static_cast<std::size_t>(axis)] - 1;
      if (centre[axis] - reach < 0 || centre[axis] + reach > last) return true;
    }
    return false;
  }
  void doubt(const Vector3d& centre, const char* reason) {
    if (std::none_of(out_.doubtful.begin(), out_.doubtful.end(),
                     [&](const DoubtfulMarker& d) { return same(d.centre_in_patient_mm, centre); }))
      out_.doubtful.push_back({centre, reason});
  }
  void look_at_two(const Component& c, const Vector3d& centre) {
    const Eigen::Matrix3d directions = directions_of(ct_, c);
    std::vector<MarkerFit> fits;
    for (const double side : {-0.5, 0.5}) {
      const auto fit = fit_marker(ct_, shape_, centre + side * shape_.diameter_mm * directions.col(2), directions);
      if (fit && is_one(*fit, kExplainedInDoubt)) fits.push_back(*fit);
    }
    if (fits.size() < 2 || same(fits[0].centre_in_patient_mm, fits[1].centre_in_patient_mm)) return;
    for (const MarkerFit& fit : fits)
      doubt(fit.centre_in_patient_mm, "touches another marker, which pulls its centre: place them apart");
  }

  const Volume& ct_;
  const MarkerShape& shape_;
  FoundMarkers out_;
  std::vector<Vector3d> others_;
};

}  // namespace

FoundMarkers find_markers(const Volume& ct, const MarkerSearch& search) {
  Finder finder(ct, search.shape);
  std::vector<std::int16_t> thresholds{300, 700, 1500};
  if (search.threshold_hu) thresholds = {*search.threshold_hu};
  for (const std::int16_t threshold : thresholds) {
    for (const Component& component : bright_components(ct, threshold)) finder.look(component);
  }
  return finder.finish();
}

}  // namespace birdseye::host
