#include "host/report/slice_picture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calibration/picture/picture_mat.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

cv::Mat view_of(Picture& picture) {
  return {picture.height_px, picture.width_px, CV_8UC3, picture.rgb.data()};
}

Picture black(int width_px, int height_px) {
  Picture picture{width_px, height_px, {}};
  picture.rgb.resize(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3);
  return picture;
}

/// Between the voxels; below all tissue outside of them.
double sample(const Volume& ct, const Vector3d& voxel) {
  constexpr double kNothing_hu = -2000;
  const Eigen::Array3i low = voxel.array().floor().cast<int>();
  const Vector3d part = voxel - low.cast<double>().matrix();
  if ((low < 0).any() || (low + 1 >= Eigen::Array3i(ct.size[0], ct.size[1], ct.size[2])).any()) return kNothing_hu;
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3i step(corner & 1, (corner >> 1) & 1, corner >> 2);
    const double weight = (step > 0).select(part.array(), 1 - part.array()).prod();
    sum += weight * ct.at(low.x() + step.x(), low.y() + step.y(), low.z() + step.z());
  }
  return sum;
}

template <typename Value>
Picture draw(const SlicePlane& plane, double low_hu, double high_hu, const Value& hu_at) {
  Picture picture = black(plane.width_px, plane.height_px);
  std::size_t at = 0;
  for (int y = 0; y < plane.height_px; ++y) {
    for (int x = 0; x < plane.width_px; ++x, at += 3) {
      const double grey = 255 * std::clamp((hu_at(plane.at(x + 0.5, y + 0.5)) - low_hu) / (high_hu - low_hu), 0.0, 1.0);
      std::fill_n(picture.rgb.begin() + static_cast<std::ptrdiff_t>(at), 3, static_cast<std::uint8_t>(grey));
    }
  }
  return picture;
}

}  // namespace

SlicePlane slice_plane(SliceKind kind, const Vector3d& centre_in_patient_mm, double width_mm, int width_px,
                       int height_px) {
  const Vector3d left = Vector3d::UnitX(), back = Vector3d::UnitY(), feet = -Vector3d::UnitZ();
  return {centre_in_patient_mm,
          kind == SliceKind::sagittal ? back : left,
          kind == SliceKind::axial ? back : feet,
          width_mm / width_px,
          width_px,
          height_px};
}

Picture draw_slice(const Volume& ct, const SlicePlane& plane, double low_hu, double high_hu) {
  const Eigen::Affine3d voxel_from_patient = ct.patient_from_voxel.inverse();
  return draw(plane, low_hu, high_hu, [&](const Vector3d& p) { return sample(ct, voxel_from_patient * p); });
}

Picture draw_brightest(const Volume& ct, const SlicePlane& plane, double depth_mm, double low_hu, double high_hu) {
  const Eigen::Affine3d voxel_from_patient = ct.patient_from_voxel.inverse();
  const Vector3d away = plane.right.cross(plane.down);
  const Vector3d step = voxel_from_patient.linear() * away * ct.spacing_mm.minCoeff();
  const int steps = static_cast<int>(depth_mm / ct.spacing_mm.minCoeff());
  const Eigen::Array3i last(ct.size[0] - 1, ct.size[1] - 1, ct.size[2] - 1);
  return draw(plane, low_hu, high_hu, [&](const Vector3d& p) {
    double brightest = -2000;
    Vector3d voxel = voxel_from_patient * p - steps * step;
    for (int i = -steps; i <= steps; ++i, voxel += step) {
      const Eigen::Array3i at = (voxel.array() + 0.5).floor().cast<int>();
      if ((at < 0).any() || (at > last).any()) continue;
      brightest = std::max<double>(brightest, ct.at(at.x(), at.y(), at.z()));
    }
    return brightest;
  });
}

void draw_text(Picture& picture, const Eigen::Vector2d& at_px, const std::string& text, const Colour& colour) {
  cv::Mat image = view_of(picture);
  const cv::Point at(static_cast<int>(std::lround(at_px.x())), static_cast<int>(std::lround(at_px.y())));
  constexpr double kSize = 0.45;
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, kSize, cv::Scalar(0, 0, 0), 3, cv::LINE_AA);
  cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, kSize, cv::Scalar(colour[0], colour[1], colour[2]), 1,
              cv::LINE_AA);
}

void draw_cross_hair(Picture& picture, const Eigen::Vector2d& centre_px, int radius_px, const Colour& colour,
                     double open) {
  cv::Mat image = view_of(picture);
  const cv::Scalar ink(colour[0], colour[1], colour[2]);
  constexpr int kFractionBits = 4;  // a centre is known to a part of a pixel
  const auto fixed = [](double px) { return static_cast<int>(std::lround((px - 0.5) * (1 << kFractionBits))); };
  for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
    const double open_px = open * radius_px;
    cv::line(image, cv::Point(fixed(centre_px.x() + dx * open_px), fixed(centre_px.y() + dy * open_px)),
             cv::Point(fixed(centre_px.x() + dx * radius_px), fixed(centre_px.y() + dy * radius_px)), ink, 1,
             cv::LINE_AA, kFractionBits);
  }
}

ThreePlanes::ThreePlanes(const Vector3d& centre_in_patient_mm, double width_mm, int side_px) : side_px_(side_px) {
  std::ranges::transform(
      std::array{SliceKind::axial, SliceKind::coronal, SliceKind::sagittal}, planes_.begin(),
      [&](SliceKind kind) { return slice_plane(kind, centre_in_patient_mm, width_mm, side_px, side_px); });
}

Picture ThreePlanes::draw(const Volume& ct, double low_hu, double high_hu) const {
  static constexpr const char* kNames[] = {"axial", "coronal", "sagittal"};
  constexpr Colour kWhite{255, 255, 255};
  Picture out = black(3 * side_px_, side_px_);
  for (std::size_t n = 0; n < planes_.size(); ++n) {
    Picture slice = draw_slice(ct, planes_[n], low_hu, high_hu);
    draw_text(slice, {6, side_px_ - 8.0}, kNames[n], kWhite);
    paste(out, slice, static_cast<int>(n) * side_px_, 0);
  }
  return out;
}

void ThreePlanes::mark(Picture& picture, const Vector3d& place_in_patient_mm, const Colour& colour) const {
  for (std::size_t n = 0; n < planes_.size(); ++n) {
    const Eigen::Vector2d at_px = planes_[n].px_of(place_in_patient_mm);
    const bool inside = at_px.minCoeff() >= 0 && at_px.maxCoeff() <= side_px_;
    if (inside)
      draw_cross_hair(picture, at_px + Eigen::Vector2d(static_cast<double>(n) * side_px_, 0), side_px_ / 4, colour);
  }
}

void paste(Picture& onto, const Picture& what, int x_px, int y_px) {
  mat_of(what.view()).copyTo(view_of(onto)(cv::Rect(x_px, y_px, what.width_px, what.height_px)));
}

}  // namespace birdseye::host
