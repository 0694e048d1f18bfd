#include "host/volume/labels.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/volume/image_file.hpp"
#include "host/volume/label_grid.hpp"
#include "host/volume/mask_folder.hpp"

namespace birdseye::host {

namespace {

/// Which labels there are, in words.
std::string labels_in(const Volume& labels) {
  constexpr std::size_t kNamed = 20;
  const std::vector<std::int16_t> found = values_in(labels);
  if (found.empty()) return "no label covers any of the CT";
  const auto some = std::span(found).first(std::min(found.size(), kNamed));
  return fmt::format("those there are {}{}; `birdseye volume info` of the labels' file names them",
                     fmt::join(some, ", "),
                     found.size() > kNamed ? fmt::format(" and {} more", found.size() - kNamed) : "");
}

}  // namespace

std::vector<std::int16_t> values_in(const Volume& labels) {
  std::vector<bool> seen(1U << 16U);
  for (const std::int16_t value : labels.hu) seen[static_cast<std::uint16_t>(value)] = true;
  std::vector<std::int16_t> found;
  for (int value = -32768; value < 32768; ++value) {
    if (value != 0 && seen[static_cast<std::uint16_t>(value)]) found.push_back(static_cast<std::int16_t>(value));
  }
  return found;
}

Result<LabelVolume> import_named_labels(const std::filesystem::path& path, const Volume& ct,
                                        std::span<const LabelChoice> wanted, const std::stop_token& stop) {
  if (is_mask_folder(path)) return import_masks(path, ct, wanted, stop);
  auto image = read_labels_file(path, stop);
  if (!image) return image.error();
  auto laid = labels_on_grid(ct, *image, path);
  if (!laid) return laid.error();
  LabelVolume labels{std::move(laid->volume), std::move(image->label_names), std::move(laid->notes)};
  for (const std::string& note : image->notes) labels.notes.push_back(fmt::format("{}: {}", path.string(), note));
  if (!image->frame_of_reference_uid.empty() && ct.frame.uid.empty()) {
    labels.notes.push_back(fmt::format(
        "{}: the CT has no frame of reference: only the grid tells that the labels are of this CT", path.string()));
  }
  return labels;
}

Result<Volume> import_labels(const std::filesystem::path& path, const Volume& ct, const std::stop_token& stop) {
  auto labels = import_named_labels(path, ct, {}, stop);
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
    return Error{Errc::not_found,
                 fmt::format("the labels hold no voxel of {}: {}", fmt::join(values, ", "), labels_in(labels))};
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
    return Error{Errc::not_found,
                 fmt::format("the labels hold no voxel of {}: {}", fmt::join(values, ", "), labels_in(labels))};
  return Eigen::Vector3d(labels.patient_from_voxel * Eigen::Vector3d(sum / static_cast<double>(count)));
}

Result<Eigen::Vector3d> label_centroid_mm(const Volume& labels, int value) {
  return label_centroid_mm(labels, std::span(&value, 1));
}

}  // namespace birdseye::host
