#include "tests/support/reference_renderer.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace birdseye::testing {

namespace {

using Eigen::Vector3d;

double value(const host::Volume& v, const Vector3d& x) {
  double sum = 0;
  int base[3];
  double part[3];
  for (int axis = 0; axis < 3; ++axis) {
    base[axis] =
        std::clamp(static_cast<int>(std::floor(x[axis])), 0, std::max(0, v.size[static_cast<std::size_t>(axis)] - 2));
    part[axis] = x[axis] - base[axis];
  }
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1;
    int at[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int bit = corner >> axis & 1;
      weight *= bit != 0 ? part[axis] : 1 - part[axis];
      at[axis] = std::min(base[axis] + bit, v.size[static_cast<std::size_t>(axis)] - 1);
    }
    sum += weight * v.at(at[0], at[1], at[2]);
  }
  return sum;
}

}  // namespace

std::vector<double> render_reference(const host::Volume& volume, const host::TransferFunction& transfer,
                                     const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                                     const host::RenderSettings& settings, const host::DisplacementField* deformation) {
  const Transform<Patient, Camera> patient_from_camera = camera_from_patient.inverse();
  const Eigen::Affine3d voxel_from_patient = volume.patient_from_voxel.inverse();
  const Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  const Vector3d o = patient_from_camera.translation();
  const double h = settings.step_mm;
  // Further than this no sample can lie in the volume.
  double reach = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d voxel((corner & 1) * last.x(), (corner >> 1 & 1) * last.y(), (corner >> 2) * last.z());
    reach = std::max(reach, (volume.patient_from_voxel * voxel - o).norm());
  }
  std::vector<double> out(static_cast<std::size_t>(camera.width_px * camera.height_px * 4));
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const auto in_camera = unproject(camera, Eigen::Vector2d(u, v));
      if (!in_camera) continue;
      const Vector3d d = patient_from_camera.rotation() * in_camera->normalized();
      Vector3d c = Vector3d::Zero();
      double t = 1;
      for (int i = 0; (i + 0.5) * h <= reach; ++i) {
        const double s = (i + 0.5) * h;
        const Vector3d p = o + s * d;
        const Vector3d still = voxel_from_patient * p;
        if (still.minCoeff() < 0 || (last - still).minCoeff() < 0) continue;
        const Vector3d moved = deformation != nullptr ? Vector3d(p + deformation->displacement(p)) : p;
        const Vector3d x = voxel_from_patient * moved;
        if (x.minCoeff() < 0 || (last - x).minCoeff() < 0 || s < settings.near_mm) continue;
        if (settings.clip && settings.clip->normal.dot(p) < settings.clip->offset_mm) continue;
        const auto& entry = transfer.at(static_cast<int>(std::lround(value(volume, x))));
        const double a = 1 - std::exp(-static_cast<double>(entry.extinction_per_mm) * h);
        Vector3d g_voxel;
        for (int axis = 0; axis < 3; ++axis) {
          const Vector3d e = Vector3d::Unit(axis);
          g_voxel[axis] = 0.5 * (value(volume, (x + e).cwiseMin(last)) - value(volume, (x - e).cwiseMax(0.0)));
        }
        Vector3d g = voxel_from_patient.linear().transpose() * g_voxel;
        if (deformation != nullptr) g += deformation->gradient(p).transpose() * Vector3d(g);
        const double facing = g.norm() > 0 ? std::abs(g.dot(d)) / g.norm() : 0;
        const double m = std::min(1.0, g.norm() / settings.surface_gradient_hu_per_mm);
        const double shade = (1 - m) + m * (settings.ambient + settings.diffuse * facing);
        const double highlight = m * settings.specular * std::pow(facing, settings.shininess);
        const Vector3d rgb(static_cast<double>(entry.r), static_cast<double>(entry.g), static_cast<double>(entry.b));
        c += t * a * (rgb * shade + Vector3d::Constant(highlight)).cwiseMin(1.0);
        t *= 1 - a;
      }
      double* const pixel = &out[static_cast<std::size_t>(v * camera.width_px + u) * 4];
      for (int channel = 0; channel < 3; ++channel) pixel[channel] = c[channel];
      pixel[3] = 1 - t;
    }
  }
  return out;
}

}  // namespace birdseye::testing
