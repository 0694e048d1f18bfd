#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/dicom_labels.hpp"
#include "host/dicom/patient_identity.hpp"
#include "host/volume/volume.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// Reads a CT: a series of a folder of DICOM files and of the folders below it, a DICOM file (of one slice, or of many
/// frames), or a NIfTI, NRRD, MHA or MHD file. Localizers, other modalities and files that are no image are passed
/// over. Refuses, with the reason and the remedy in one line that names the path: what is missing, unreadable, cut
/// short or no image; folders of several series of which none is named; a file that cannot be read beside the slices;
/// slices that are doubled, missing or unevenly spaced, or sheared by a tilted gantry where resampling is not asked
/// for; voxels that are not finite or beyond 16 bits; images that are not three-dimensional. Ends by itself once stop
/// is requested (read_image).
Result<Volume> import_volume(const VolumeSource& source, const std::stop_token& stop = {});

/// A CT, and what its reader should know.
struct ImportedVolume {
  Volume volume;
  PatientIdentity patient;              ///< whose it is, where the files say
  std::vector<std::string> notes;       ///< what was passed over, and what resampling cost, a line each
  std::vector<NamedLabel> label_names;  ///< where the file says that its values are labels
};
Result<ImportedVolume> import_with_notes(const VolumeSource& source, const std::stop_token& stop = {});
/// Of a CT that is to be registered or drawn. Refuses too what is no body by its size: one slice, nothing but air, one
/// value throughout, or tissue that reaches over less than 20 mm or more than 3 m, as where the file's lengths are in
/// another unit.
Result<ImportedVolume> import_body(const VolumeSource& source, const std::stop_token& stop = {});

}  // namespace birdseye::host
