#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace birdseye::host {

/// What a person states of where a CT's voxels lie: where its file does not say it, or says two.
struct StatedGeometry {
  std::optional<Eigen::Vector3d> spacing_mm;
  std::string orientation;  ///< as orientation_letters gives it; empty: not stated
  bool in_case = false;     ///< by a case's file, which has keys where commands have options
};

/// Where a CT is, and which of several it is.
struct VolumeSource {
  std::filesystem::path path;  ///< a folder of DICOM files with what lies below it, or a file
  std::string series;          ///< of several series: which, as choose_series takes it; empty for the only one
  bool untilt = false;         ///< whether slices that a tilted gantry shifted are resampled
  StatedGeometry stated;

  VolumeSource() = default;
  VolumeSource(std::filesystem::path p)
      : path(std::move(p)) {}                      // NOLINT(google-explicit-constructor): most have but one
  VolumeSource(const char* p) : path(p) {}         // NOLINT(google-explicit-constructor)
  VolumeSource(const std::string& p) : path(p) {}  // NOLINT(google-explicit-constructor)
};

}  // namespace birdseye::host
