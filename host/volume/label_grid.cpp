#include "host/volume/label_grid.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <optional>
#include <utility>

#include "host/dicom/refused.hpp"

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

/// The labels on the CT's grid, and which share of their voxels lies outside of the CT.
std::pair<Volume, double> laid_into(const Volume& ct, const ImageFile& labels, const VoxelWay& way) {
  Volume out;
  out.size = ct.size;
  out.spacing_mm = ct.spacing_mm;
  out.patient_from_voxel = ct.patient_from_voxel;
  out.hu.assign(grid_count(ct.size), 0);
  std::size_t inside = 0, outside = 0;
  const std::int16_t* label = labels.hu.data();
  for (int k = 0; k < labels.size[2]; ++k) {
    for (int j = 0; j < labels.size[1]; ++j) {
      for (int i = 0; i < labels.size[0]; ++i, ++label) {
        if (*label == 0) continue;
        const Eigen::Vector3i at = way.first + way.steps * Eigen::Vector3i(i, j, k);
        const bool in = (at.array() >= 0).all() && at.x() < ct.size[0] && at.y() < ct.size[1] && at.z() < ct.size[2];
        ++(in ? inside : outside);
        if (in) out.hu[out.index(at.x(), at.y(), at.z())] = *label;
      }
    }
  }
  const auto all = static_cast<double>(std::max<std::size_t>(1, inside + outside));
  return {std::move(out), static_cast<double>(outside) / all};
}

/// Whether both say a name, and not the same.
bool named_apart(const PatientFrame& ct, const ImageFile& labels) {
  return !ct.patient_name.empty() && !labels.patient.name.empty() && !same_name(ct.patient_name, labels.patient.name);
}

/// Labels that say whose they are must be the CT's: two patients' CTs of one size may lie on one grid.
Result<void> check_same_patient(const PatientFrame& ct, const ImageFile& labels, const std::filesystem::path& path) {
  const std::string& id = labels.patient.id;
  const bool by_id = !id.empty() && !ct.patient_id.empty();
  if (by_id ? id != ct.patient_id : named_apart(ct, labels)) {
    return refused(Errc::bad_value, path,
                   fmt::format("is of patient {}, and the CT of patient {}; give the segmentation of this CT",
                               by_id ? id : labels.patient.name, by_id ? ct.patient_id : ct.patient_name));
  }
  const std::string& uid = labels.frame_of_reference_uid;
  if (!uid.empty() && !ct.uid.empty() && uid != ct.uid) {
    return refused(Errc::bad_value, path,
                   fmt::format("is of another scan than the CT: its frame of reference is {}, the CT's {}; give the "
                               "segmentation of this CT",
                               uid, ct.uid));
  }
  // Of two phases of one examination even the frame of reference is the same, and the patient has breathed between
  // them.
  const auto& series = labels.series_labelled;
  if (!series.empty() && !ct.series_uid.empty() &&
      std::find(series.begin(), series.end(), ct.series_uid) == series.end()) {
    return refused(Errc::bad_value, path,
                   fmt::format("is of another series than the CT: it says it is of {}{}, and the CT is {}; give the "
                               "segmentation of this CT, or the CT of that series",
                               series.front(), series.size() > 1 ? fmt::format(" and {} more", series.size() - 1) : "",
                               ct.series_uid));
  }
  return {};
}

}  // namespace

Result<LabelsOnGrid> labels_on_grid(const Volume& ct, const ImageFile& labels, const std::filesystem::path& path) {
  constexpr double kMostOutside = 0.5;
  if (auto same = check_same_patient(ct.frame, labels, path); !same) return same.error();
  const auto way = way_into(ct, labels);
  if (!way) {
    return refused(Errc::bad_value, path, "is not on the grid of the CT; resample the labels to it");
  }
  auto [volume, outside] = laid_into(ct, labels, *way);
  LabelsOnGrid out{std::move(volume), {}};
  if (outside > 0) {
    const std::string share =
        fmt::format("{:.1f} % of its voxels that have a label lie outside of the CT", 100 * outside);
    if (outside > kMostOutside) return refused(Errc::bad_value, path, share + "; is it of this CT?");
    out.notes.push_back(
        fmt::format("{}: {}, and are left out: what it labels ends where the CT ends", path.string(), share));
  }
  // Hospitals correct names, and people marry: with the same ID it is no reason to refuse. The note may be written
  // where the patient is not to be named.
  if (named_apart(ct.frame, labels)) {
    out.notes.push_back(fmt::format(
        "{}: has the CT's patient ID, and another patient name; see that both are of one patient", path.string()));
  }
  return out;
}

}  // namespace birdseye::host
