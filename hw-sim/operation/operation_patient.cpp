#include "hw-sim/operation/operation_patient.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "host/files/write_files.hpp"
#include "hw-sim/phantom/dicom_series.hpp"
#include "hw-sim/phantom/grid.hpp"
#include "hw-sim/phantom/image_files.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kTissue_hu = 40, kOrgan_hu = 110, kMarker_hu = 1500, kMarkerRadius_mm = 4;
constexpr std::uint8_t kOrganLabel = 1;

Grid grid_of_patient() {
  Grid grid;
  grid.size = {50, 55, 45};
  grid.spacing_mm = {2, 2, 2};
  grid.origin_mm = {-20, -20, -20};
  return grid;
}

/// 1 at the voxels that the organ has.
std::vector<std::uint8_t> organ_on(const Grid& grid) {
  std::vector<std::uint8_t> labels;
  labels.reserve(grid.voxels());
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i)
        labels.push_back(OperationTruth::organ_mm(grid.point(i, j, k)) < 0 ? kOrganLabel : 0);
    }
  }
  return labels;
}

std::string row_of(const Eigen::Vector3d& place_mm, const char* separator) {
  return fmt::format("{1}{0}{2}{0}{3}\n", separator, place_mm.x(), place_mm.y(), place_mm.z());
}

}  // namespace

Result<host::PatientFiles> write_patient(const std::filesystem::path& folder, const OperationTruth& truth,
                                         PatientHas has) {
  const Grid grid = grid_of_patient();
  std::vector<std::int16_t> hu(grid.voxels(), static_cast<std::int16_t>(kTissue_hu));
  host::PatientFiles files;
  if (has == PatientHas::markers_and_organ) {
    const std::vector<std::uint8_t> labels = organ_on(grid);
    for (std::size_t at = 0; at < hu.size(); ++at)
      if (labels[at] == kOrganLabel) hu[at] = static_cast<std::int16_t>(kOrgan_hu);
    files.labels = folder / "organ.nii.gz";
    files.organ = {kOrganLabel};
    if (auto written = write_labels(files.labels, grid, labels); !written) return written.error();
  }
  for (const Eigen::Vector3d& marker : truth.fiducials_mm()) {
    for (int k = 0; k < grid.size[2]; ++k) {
      for (int j = 0; j < grid.size[1]; ++j) {
        for (int i = 0; i < grid.size[0]; ++i) {
          const double outside_mm = (grid.point(i, j, k) - marker).norm() - kMarkerRadius_mm;
          const double share = std::clamp(0.5 - outside_mm / grid.spacing_mm.x(), 0.0, 1.0);
          auto& voxel = hu[grid.index(i, j, k)];
          voxel = std::max(voxel, static_cast<std::int16_t>(kTissue_hu + share * (kMarker_hu - kTissue_hu)));
        }
      }
    }
  }
  if (auto written = write_dicom_series(folder / "ct", grid, hu, 1); !written) return written.error();
  std::string fiducials;
  for (const Eigen::Vector3d& marker : truth.fiducials_mm()) fiducials += row_of(marker, " ");
  files.ct = (folder / "ct").string();
  files.fiducials = folder / "fiducials.txt";
  files.landmarks = folder / "landmarks.csv";
  const std::string landmarks = "name,x,y,z\ntumour," + row_of(truth.target_mm(), ",");
  if (auto written = host::write_files({{files.fiducials, fiducials}, {files.landmarks, landmarks}}); !written)
    return written.error();
  return files;
}

}  // namespace birdseye::hw_sim
