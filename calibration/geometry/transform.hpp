#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "calibration/geometry/rotations.hpp"

namespace birdseye {

/// Frame tags (design: docs/manual/frames.md). They exist only in types.
struct Patient;      ///< DICOM LPS, mm
struct Tracker;      ///< the transmitter, mm
struct Sensor;       ///< the bird on the scope, mm
struct Pointer;      ///< the bird on the pointer, mm
struct Camera;       ///< OpenCV: x right, y down, z forward, mm; the left one of a stereo scope
struct RightCamera;  ///< the other camera of a stereo scope, as Camera
struct Marker;       ///< a calibration board, mm
struct TrackedBody;  ///< what carries the board, as the tracker knows it; the tracker's own for a board at rest

/// A rigid transform that takes points of frame From to frame To. Names cancel like fractions:
/// camera_from_sensor * sensor_from_tracker is a camera_from_tracker, and a wrong chain does not compile.
template <typename To, typename From>
class Transform {
 public:
  Transform() : rotation_(Eigen::Matrix3d::Identity()), translation_(Eigen::Vector3d::Zero()) {}
  Transform(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation_mm)
      : rotation_(rotation), translation_(translation_mm) {}
  Transform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation_mm)
      : Transform(Eigen::Matrix3d(rotation.normalized().toRotationMatrix()), translation_mm) {}

  /// matrix: 4x4 homogeneous; the caller vouches that its upper left block is a rotation.
  static Transform from_matrix(const Eigen::Matrix4d& matrix) {
    return Transform(Eigen::Matrix3d(matrix.topLeftCorner<3, 3>()), Eigen::Vector3d(matrix.topRightCorner<3, 1>()));
  }

  [[nodiscard]] const Eigen::Matrix3d& rotation() const { return rotation_; }
  [[nodiscard]] const Eigen::Vector3d& translation() const { return translation_; }
  [[nodiscard]] Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(rotation_); }
  [[nodiscard]] Eigen::Matrix4d matrix() const {
    Eigen::Matrix4d out = Eigen::Matrix4d::Identity();
    out.topLeftCorner<3, 3>() = rotation_;
    out.topRightCorner<3, 1>() = translation_;
    return out;
  }

  [[nodiscard]] Transform<From, To> inverse() const {
    const Eigen::Matrix3d transposed = rotation_.transpose();
    return Transform<From, To>(transposed, Eigen::Vector3d(-(transposed * translation_)));
  }

  template <typename Other>
  [[nodiscard]] Transform<To, Other> operator*(const Transform<From, Other>& right) const {
    return Transform<To, Other>(Eigen::Matrix3d(rotation_ * right.rotation()),
                                Eigen::Vector3d(rotation_ * right.translation() + translation_));
  }
  /// point in From -> point in To, mm.
  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& point_mm) const {
    return rotation_ * point_mm + translation_;
  }

 private:
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
};

}  // namespace birdseye
