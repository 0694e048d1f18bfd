#include "host/volume/labels.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <algorithm>
#include <optional>

#include "host/volume/image_file.hpp"

namespace birdseye::host {

namespace {

/// Which voxel of the CT the labels' first is, and which way its neighbours along each of the labels' axes lie.
struct VoxelWay {
  Eigen::Vector3i first;
  Eigen::Matrix3i steps;  ///< columns: a unit step along an axis of the CT, there or back
};

/// Empty where the voxels of the labels are not voxels of the CT.
std::optional<VoxelWay> way_into(const Volume& ct, const ImageFile& labels) {
  Eigen::Affine3d patient_from_label = Eigen::Affine3d::Identity();
  patient_from_label.linear() = labels.axes * labels.spacing_mm.asDiagonal();
  patient_from_label.translation() = labels.origin_mm;
  const Eigen::Affine3d ct_from_label = ct.patient_from_voxel.inverse() * patient_from_label;
  VoxelWay way;
  way.steps = ct_from_label.linear().array().round().cast<int>();
  way.first = ct_from_label.translation().array().round().cast<int>();
  if ((way.steps.cast<double>() * way.steps.cast<double>().transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-9)
    return std::nullopt;
  // Corners, not matrices: what matters is where the voxels lie, however far from the origin the patient is.
  const double allowed_mm = 0.2 * ct.spacing_mm.minCoeff();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i voxel((corner & 1) != 0 ? labels.size[0] - 1 : 0, (corner & 2) != 0 ? labels.size[1] - 1 : 0,
                                (corner & 4) != 0 ? labels.size[2] - 1 : 0);
    const Eigen::Vector3d there = ct.patient_from_voxel * (way.first + way.steps * voxel).cast<double>();
    if ((patient_from_label * voxel.cast<double>() - there).norm() > allowed_mm) return std::nullopt;
  }
  return way;
}

/// On the CT's grid; empty where no voxel of the CT has a label and some outside of it have.
std::optional<Volume> laid_into(const Volume& ct, const ImageFile& labels, const VoxelWay& way) {
  Volume out;
  out.size = ct.size;
  out.spacing_mm = ct.spacing_mm;
  out.patient_from_voxel = ct.patient_from_voxel;
  out.hu.assign(grid_count(ct.size), 0);
  bool inside = false, outside = false;
  const std::int16_t* label = labels.hu.data();
  for (int k = 0; k < labels.size[2]; ++k) {
    for (int j = 0; j < labels.size[1]; ++j) {
      for (int i = 0; i < labels.size[0]; ++i, ++label) {
        if (*label == 0) continue;
        const Eigen::Vector3i at = way.first + way.steps * Eigen::Vector3i(i, j, k);
        const bool in = (at.array() >= 0).all() && at.x() < ct.size[0] && at.y() < ct.size[1] && at.z() < ct.size[2];
        (in ? inside : outside) = true;
        if (in) out.hu[out.index(at.x(), at.y(), at.z())] = *label;
      }
    }
  }
  if (outside && !inside) return std::nullopt;
  return out;
}

}  // namespace

Result<LabelVolume> import_named_labels(const std::filesystem::path& path, const Volume& ct,
                                        const std::stop_token& stop) {
  auto image = read_labels_file(path, stop);
  if (!image) return image.error();
  const auto way = way_into(ct, *image);
  if (!way) {
    return Error{Errc::bad_value,
                 fmt::format("{}: is not on the grid of the CT; resample the labels to it", path.string())};
  }
  auto volume = laid_into(ct, *image, *way);
  if (!volume)
    return Error{Errc::bad_value, fmt::format("{}: lies outside of the CT; is it of this CT?", path.string())};
  return LabelVolume{*std::move(volume), std::move(image->label_names)};
}

Result<Volume> import_labels(const std::filesystem::path& path, const Volume& ct, const std::stop_token& stop) {
  auto labels = import_named_labels(path, ct, stop);
  if (!labels) return labels.error();
  return std::move(labels->volume);
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

Result<Eigen::Vector3d> label_centroid_mm(const Volume& labels, std::span<const int> values) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  for (int k = 0; k < labels.size[2]; ++k) {
    for (int j = 0; j < labels.size[1]; ++j) {
      for (int i = 0; i < labels.size[0]; ++i) {
        if (std::find(values.begin(), values.end(), labels.at(i, j, k)) == values.end()) continue;
        sum += Eigen::Vector3d(i, j, k);
        ++count;
      }
    }
  }
  if (count == 0)
    return Error{Errc::not_found, fmt::format("the labels hold no voxel of value {}", fmt::join(values, ", "))};
  return Eigen::Vector3d(labels.patient_from_voxel * Eigen::Vector3d(sum / static_cast<double>(count)));
}

Result<Eigen::Vector3d> label_centroid_mm(const Volume& labels, int value) {
  return label_centroid_mm(labels, std::span(&value, 1));
}

}  // namespace birdseye::host
