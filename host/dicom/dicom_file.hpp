#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/patient_identity.hpp"

namespace birdseye::host {

/// What may tell slices at one place from one another, in the order in which it is asked: the phases of a contrast
/// medium, the times of a perfusion, kernels.
enum class SliceKey {
  temporal_position,
  contrast_phase,
  description,
  stack,
  acquisition,
  trigger_time_ms,
  cardiac_phase_percent,
  comments,
  image_type,
  kernel,
  kvp,
  acquisition_time,
  content_time
};
inline constexpr std::size_t kSliceKeys = static_cast<std::size_t>(SliceKey::content_time) + 1;
/// "trigger time 350 ms".
std::string slice_key_words(SliceKey key, const std::string& value);

/// One slice of a CT, a frame of a file, as the file's header has it. Patient frame (LPS), mm.
struct DicomSlice {
  std::size_t file = 0;  ///< whose place among the files that were read it is in
  int frame = 0;         ///< within its file, from 0
  int instance = 0;      ///< number of its image; 0 where the file has none
  int columns = 0, rows = 0;
  Eigen::Vector3d position_mm;  ///< of the centre of the first pixel
  Eigen::Vector3d row, column;  ///< which way the pixels of a row and those of a column follow one another, unit length
  Eigen::Vector2d spacing_mm;   ///< of pixels along a row, and along a column
  double thickness_mm = 0;      ///< 0 where the file has none
  double between_mm = 0;        ///< Spacing Between Slices, which positions may contradict; 0 where the file has none
  double slope = 1, intercept = 0;           ///< HU = slope * stored + intercept
  std::string unit;                          ///< Rescale Type, as HU; empty where the file has none
  std::array<std::string, kSliceKeys> keys;  ///< empty where the file has none
  bool scaled = true;                        ///< whether the file says both slope and intercept

  [[nodiscard]] const std::string& key(SliceKey k) const { return keys[static_cast<std::size_t>(k)]; }
};

/// What a DICOM file says of itself. Texts are UTF-8 in one line, and empty where the file has none.
struct DicomFile {
  enum class Kind {
    slices,     ///< of a CT, or what would be one but for its fault
    directory,  ///< of a medium, as DICOMDIR is
    labels,     ///< a segmentation
    no_image,   ///< a report, a presentation state, an encapsulated document
  };
  std::filesystem::path path;
  Kind kind = Kind::no_image;
  std::string what;  ///< its kind in words: the SOP class
  std::string instance_uid, series_uid, frame_of_reference_uid, modality, description, date, time, agent, syntax;
  std::optional<int> series_number;
  PatientIdentity patient;
  int columns = 0, rows = 0, frames = 0;  ///< as it says; 0 where it does not
  bool localizer = false;
  bool of_ct_class = false;  ///< CT Image Storage, one of its enhanced kinds, or not said; no picture of a screen
  bool compressed = false;
  bool named_syntax = true;        ///< whether DCMTK knows how the pixels are stored
  std::string fault;               ///< why its pixels are no slices of a CT; empty where they are
  std::vector<DicomSlice> slices;  ///< none where it has a fault
};

/// Whether the file begins as DICOM does.
bool begins_as_dicom(const std::filesystem::path& path);

/// Reads a header, and of the pixels only whether the file holds them. Errc::bad_format where the file is none of
/// DICOM's, or is cut short. Only a copy of the process may call this (docs/decisions/0012-isolated-import.md).
Result<DicomFile> read_dicom_file(const std::filesystem::path& path);

}  // namespace birdseye::host
