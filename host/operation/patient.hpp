#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/patient_identity.hpp"
#include "host/overlay/margins.hpp"
#include "host/volume/label_names.hpp"
#include "host/volume/volume.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// A point of the CT with a name, patient frame.
struct NamedPoint {
  std::string name;
  Eigen::Vector3d place_mm;
};

/// Where to read what is known of the patient before the operation.
struct PatientFiles {
  VolumeSource ct;
  std::filesystem::path labels;
  std::vector<LabelChoice> shown;    ///< the labels to show; empty: all of the CT
  std::vector<LabelChoice> targets;  ///< labels whose middles are landmarks to check by
  std::vector<LabelChoice> organ;    ///< labels of the organ that the video shows; without labels: all of the CT
  std::filesystem::path fiducials;   ///< points of the CT; empty: found in it
  std::filesystem::path landmarks;   ///< a table name, x, y, z; or empty
  std::vector<double> margins_mm;    ///< shells to draw about the targets; empty: none
};

/// The simulated cart's patient: its liver's vessels and tumour are shown, and the tumour's middle is the landmark.
/// folder: the cart's.
PatientFiles simulated_patient(const std::filesystem::path& folder);

struct PatientPlan {
  Volume ct, shown;
  std::string ct_sha256;
  StatedGeometry ct_stated;
  std::string labels_sha256;  ///< of their files; empty: there are none
  PatientIdentity identity;
  std::vector<std::string> notes;  ///< of the readers of the CT and of the labels, as what was passed over
  std::optional<Volume> labels;
  std::vector<int> organ;  ///< values in labels of what the views show: it is matched with them
  std::optional<std::vector<Eigen::Vector3d>> fiducials_in_patient_mm;  ///< where they are given
  std::vector<NamedPoint> landmarks;
  std::optional<Margins> margins;  ///< about all targets
};

/// What is taken for the target where no landmark is given; patient frame, mm.
Eigen::Vector3d middle_of_ct(const Volume& ct);
/// The first landmark, else the CT's middle; in the CT as it was taken.
Eigen::Vector3d target_in_patient_mm(const PatientPlan& plan);

/// Refuses labels that are named without a file of labels, and a file of labels without those of the organ: nobody else
/// knows which they are.
Result<void> check_labels_named(const PatientFiles& files);
/// An error names the file. Where no fiducials are given, they are left to find_fiducials. Once stop is requested, what
/// is still to be read is not.
Result<PatientPlan> read_patient(const PatientFiles& files, const std::stop_token& stop = {});
/// The markers that the CT shows, the brightest first: balls of 8 mm, or where these are too few to register by, hollow
/// posts, if there are more of them.
std::vector<Eigen::Vector3d> find_fiducials(const Volume& ct, const std::stop_token& stop);

}  // namespace birdseye::host
