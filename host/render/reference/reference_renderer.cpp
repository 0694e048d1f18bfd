#include "host/render/reference/reference_renderer.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

/// What is trilinear between voxels, at x.
template <typename At>
double trilinear(const Volume& v, const Vector3d& x, const At& of_voxel) {
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
    sum += weight * of_voxel(at[0], at[1], at[2]);
  }
  return sum;
}

/// The volume resampled on its own grid.
Volume resampled(const Volume& v, const DisplacementField& deformation) {
  Volume out = v;
  const Vector3d last(v.size[0] - 1, v.size[1] - 1, v.size[2] - 1);
  for (int k = 0; k < v.size[2]; ++k) {
    for (int j = 0; j < v.size[1]; ++j) {
      for (int i = 0; i < v.size[0]; ++i) {
        const Vector3d p = v.patient_from_voxel * Vector3d(i, j, k);
        const Vector3d x = v.patient_from_voxel.inverse() * Vector3d(p + deformation.displacement(p));
        const bool inside = x.minCoeff() >= -1e-9 && (last - x).minCoeff() >= -1e-9;
        out.hu[v.index(i, j, k)] = static_cast<std::int16_t>(
            inside ? std::lround(trilinear(v, x.cwiseMax(0.0).cwiseMin(last),
                                           [&v](int a, int b, int c) { return v.at(a, b, c); }))
                   : -1024);
      }
    }
  }
  return out;
}

struct Light {
  double shade = 0, highlight = 0;
};

std::vector<Light> light_of(const Volume& v, const Vector3d& eye, const RenderSettings& settings) {
  std::vector<Light> lights(v.hu.size());
  for (int k = 0; k < v.size[2]; ++k) {
    for (int j = 0; j < v.size[1]; ++j) {
      for (int i = 0; i < v.size[0]; ++i) {
        const auto at = [&](int a, int b, int c) {
          return v.at(std::clamp(a, 0, v.size[0] - 1), std::clamp(b, 0, v.size[1] - 1),
                      std::clamp(c, 0, v.size[2] - 1));
        };
        const Vector3d g_voxel = 0.5 * Vector3d(at(i + 1, j, k) - at(i - 1, j, k), at(i, j + 1, k) - at(i, j - 1, k),
                                                at(i, j, k + 1) - at(i, j, k - 1));
        const Vector3d g = v.patient_from_voxel.linear().inverse().transpose() * g_voxel;
        const Vector3d d = v.patient_from_voxel * Vector3d(i, j, k) - eye;
        const double facing = g.norm() > 0 ? std::abs(g.normalized().dot(d.normalized())) : 0;
        const double m = std::min(1.0, g.norm() / settings.surface_gradient_hu_per_mm);
        lights[v.index(i, j, k)] = {(1 - m) + m * (settings.ambient + settings.diffuse * facing),
                                    m * settings.specular * std::pow(facing, settings.shininess)};
      }
    }
  }
  return lights;
}

}  // namespace

std::vector<double> render_reference(const Volume& scan, const TransferFunction& transfer, const CameraModel& camera,
                                     const Transform<Camera, Patient>& camera_from_patient,
                                     const RenderSettings& settings, const DisplacementField* deformation, int stride) {
  Volume volume = deformation != nullptr ? resampled(scan, *deformation) : scan;
  for (std::int16_t& hu : volume.hu)
    hu = std::clamp<std::int16_t>(hu, TransferFunction::kLowestHu, TransferFunction::kHighestHu);
  const Transform<Patient, Camera> patient_from_camera = camera_from_patient.inverse();
  const Eigen::Affine3d voxel_from_patient = volume.patient_from_voxel.inverse();
  const Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  const Vector3d o = patient_from_camera.translation();
  const std::vector<Light> lights = light_of(volume, o, settings);
  const double h = settings.step_mm;
  // Further than this no sample can lie in the volume.
  double reach = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d voxel((corner & 1) * last.x(), (corner >> 1 & 1) * last.y(), (corner >> 2) * last.z());
    reach = std::max(reach, (volume.patient_from_voxel * voxel - o).norm());
  }
  const int columns = (camera.width_px + stride - 1) / stride;
  const int rows = (camera.height_px + stride - 1) / stride;
  std::vector<double> out(static_cast<std::size_t>(columns * rows * 4));
  tbb::parallel_for(0, rows, [&](int row) {
    for (int column = 0; column < columns; ++column) {
      const int u = column * stride;
      const int v = row * stride;
      const auto in_camera = unproject(camera, Eigen::Vector2d(u, v));
      if (!in_camera) continue;
      const Vector3d d = patient_from_camera.rotation() * in_camera->normalized();
      Vector3d c = Vector3d::Zero();
      double t = 1;
      for (int n = 0; (n + 0.5) * h <= reach; ++n) {
        const double s = (n + 0.5) * h;
        const Vector3d p = o + s * d;
        const Vector3d x = voxel_from_patient * p;
        if (x.minCoeff() < 0 || (last - x).minCoeff() < 0 || s < settings.near_mm) continue;
        if (settings.clip && settings.clip->normal.dot(p) < settings.clip->offset_mm) continue;
        const double value = trilinear(volume, x, [&](int i, int j, int k) { return volume.at(i, j, k); });
        const auto& entry = transfer.at(static_cast<int>(std::lround(value)));
        const double a = 1 - std::exp(-static_cast<double>(entry.extinction_per_mm) * h);
        const double shade =
            trilinear(volume, x, [&](int i, int j, int k) { return lights[volume.index(i, j, k)].shade; });
        const double highlight =
            trilinear(volume, x, [&](int i, int j, int k) { return lights[volume.index(i, j, k)].highlight; });
        const Vector3d rgb(static_cast<double>(entry.r), static_cast<double>(entry.g), static_cast<double>(entry.b));
        c += t * a * (rgb * shade + Vector3d::Constant(highlight));
        t *= 1 - a;
      }
      if (t < 1.0 / 64) {
        c /= 1 - t;
        t = 0;
      }
      double* const pixel = &out[static_cast<std::size_t>(row * columns + column) * 4];
      for (int channel = 0; channel < 3; ++channel) pixel[channel] = std::min(c[channel], 1 - t);
      pixel[3] = 1 - t;
    }
  });
  return out;
}

}  // namespace birdseye::host
