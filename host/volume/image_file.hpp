#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/dicom_labels.hpp"
#include "host/dicom/patient_identity.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// A three-dimensional image as its file has it: values on a regular grid, x fastest, in the patient frame (LPS, mm).
struct ImageFile {
  std::array<int, 3> size{};
  int components = 1;                     ///< values a voxel
  std::vector<std::int16_t> hu;           ///< with one value a voxel: rounded, halves away from 0
  std::vector<float> values;              ///< with more values a voxel: those of a voxel side by side
  Eigen::Vector3d spacing_mm, origin_mm;  ///< origin: the centre of the first voxel
  Eigen::Matrix3d axes;                   ///< columns: which way the voxel axes point, unit length
  std::vector<NamedLabel> label_names;    ///< of a segmentation
  PatientIdentity patient;
  std::string frame_of_reference_uid;        ///< empty where no DICOM file says it
  std::string series_uid;                    ///< of a DICOM series
  std::vector<std::string> series_labelled;  ///< of a segmentation: the series that it says it is of
  std::vector<std::string> notes;            ///< what was passed over, and what resampling cost, a line each
};

/// Reads one of the series of a folder of DICOM files and of those below it, a DICOM file, or a NIfTI, NRRD, MHA or MHD
/// file, with `components` values a voxel. The decoders run in processes of their own
/// (docs/decisions/0012-isolated-import.md), for no longer than five minutes on one file. Refuses, in one line that
/// names the path, a file that is missing, unreadable or cut short, one without a sound geometry, and (with one value a
/// voxel) values that are not finite or beyond 16 bits. Once stop is requested, the decoders are ended before the next
/// of their files, and nothing is read.
Result<ImageFile> read_image(const VolumeSource& source, int components, const std::stop_token& stop = {});

/// Reads a segmentation as read_image reads a CT, with the names of its labels: a DICOM segmentation, or a folder that
/// holds one, on the least grid that holds its frames; or what read_image reads.
Result<ImageFile> read_labels_file(const std::filesystem::path& path, const std::stop_token& stop = {});

enum class StoredAs { uint8, int16, float32 };
/// Writes, compressed, what read_image reads back: .nii.gz, .nrrd or .mha. Into its place comes only what is whole and
/// on the disk, for it is read back first. Refuses, naming it, a place where there is something that is no file.
Result<void> write_image(const std::filesystem::path& path, const ImageFile& image, StoredAs stored);

}  // namespace birdseye::host
