#include "host/volume/labels.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/volume/import.hpp"

namespace birdseye::host {

Result<Volume> import_labels(const std::filesystem::path& path, const Volume& ct, const std::stop_token& stop) {
  auto labels = import_volume(path, stop);
  if (!labels) return labels;
  // Corners, not matrices: what matters is where the voxels lie, however far from the origin the patient is.
  const double allowed_mm = 0.2 * ct.spacing_mm.minCoeff();
  bool same = labels->size == ct.size;
  for (int corner = 0; same && corner < 8; ++corner) {
    const Eigen::Vector3d voxel((corner & 1) != 0 ? ct.size[0] - 1 : 0, (corner & 2) != 0 ? ct.size[1] - 1 : 0,
                                (corner & 4) != 0 ? ct.size[2] - 1 : 0);
    same = (labels->patient_from_voxel * voxel - ct.patient_from_voxel * voxel).norm() <= allowed_mm;
  }
  if (!same) {
    return Error{Errc::bad_value,
                 fmt::format("{}: is not on the grid of the CT; resample the labels to it", path.string())};
  }
  return labels;
}

Result<Volume> keep_labels(const Volume& ct, const Volume& labels, std::span<const int> values) {
  const auto wanted = [&](std::int16_t label) {
    return std::find(values.begin(), values.end(), label) != values.end();
  };
  const Eigen::Array3i size(ct.size[0], ct.size[1], ct.size[2]);
  Eigen::Array3i low = size;
  Eigen::Array3i high(-1, -1, -1);
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i) {
        if (!wanted(labels.at(i, j, k))) continue;
        low = low.min(Eigen::Array3i(i, j, k));
        high = high.max(Eigen::Array3i(i, j, k));
      }
    }
  }
  if (high[0] < 0) {
    return Error{Errc::not_found, fmt::format("the labels hold none of {}", fmt::join(values, ", "))};
  }
  // The kept voxels, their neighbours, and a border of nothing.
  low = (low - 2).max(0);
  high = (high + 2).min(size - 1).max(low);
  const Eigen::Array3i box = high - low + 1;
  Volume out;
  out.size = {box[0], box[1], box[2]};
  out.spacing_mm = ct.spacing_mm;
  out.patient_from_voxel = ct.patient_from_voxel * Eigen::Translation3d(low.cast<double>().matrix());
  out.hu.assign(static_cast<std::size_t>(box[0]) * static_cast<std::size_t>(box[1]) * static_cast<std::size_t>(box[2]),
                std::int16_t{-1024});
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1]; j <= high[1]; ++j) {
      for (int i = low[0]; i <= high[0]; ++i) {
        if (!wanted(labels.at(i, j, k))) continue;
        const Eigen::Array3i from = (Eigen::Array3i(i, j, k) - 1).max(low);
        const Eigen::Array3i to = (Eigen::Array3i(i, j, k) + 1).min(high);
        for (int kk = from[2]; kk <= to[2]; ++kk) {
          for (int jj = from[1]; jj <= to[1]; ++jj) {
            for (int ii = from[0]; ii <= to[0]; ++ii) {
              out.hu[out.index(ii - low[0], jj - low[1], kk - low[2])] = ct.at(ii, jj, kk);
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
