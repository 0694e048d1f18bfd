#include "host/volume/labels.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/volume/import.hpp"

namespace birdseye::host {

Result<Volume> import_labels(const std::filesystem::path& path, const Volume& ct) {
  auto labels = import_volume(path);
  if (!labels) return labels;
  if (labels->size != ct.size || !labels->patient_from_voxel.matrix().isApprox(ct.patient_from_voxel.matrix(), 1e-4)) {
    return Error{Errc::bad_value,
                 fmt::format("{}: is not on the grid of the CT; resample the labels to it", path.string())};
  }
  return labels;
}

Volume keep_labels(const Volume& ct, const Volume& labels, std::span<const int> values) {
  Volume out = ct;
  std::fill(out.hu.begin(), out.hu.end(), std::int16_t{-1024});
  const auto wanted = [&](std::int16_t label) {
    return std::find(values.begin(), values.end(), label) != values.end();
  };
  const auto [nx, ny, nz] = ct.size;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        if (!wanted(labels.at(i, j, k))) continue;
        for (int kk = std::max(0, k - 1); kk <= std::min(nz - 1, k + 1); ++kk) {
          for (int jj = std::max(0, j - 1); jj <= std::min(ny - 1, j + 1); ++jj) {
            for (int ii = std::max(0, i - 1); ii <= std::min(nx - 1, i + 1); ++ii) {
              out.hu[ct.index(ii, jj, kk)] = ct.at(ii, jj, kk);
            }
          }
        }
      }
    }
  }
  return out;
}

Result<Eigen::Vector3d> label_centroid_mm(const Volume& labels, int value) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  for (int k = 0; k < labels.size[2]; ++k) {
    for (int j = 0; j < labels.size[1]; ++j) {
      for (int i = 0; i < labels.size[0]; ++i) {
        if (labels.at(i, j, k) != value) continue;
        sum += Eigen::Vector3d(i, j, k);
        ++count;
      }
    }
  }
  if (count == 0) return Error{Errc::not_found, fmt::format("the labels hold no voxel of value {}", value)};
  return Eigen::Vector3d(labels.patient_from_voxel * Eigen::Vector3d(sum / static_cast<double>(count)));
}

}  // namespace birdseye::host
