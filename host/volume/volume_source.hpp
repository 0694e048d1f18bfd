#pragma once

#include <filesystem>
#include <string>
#include <utility>

namespace birdseye::host {

/// Where a CT is, and which of several it is.
struct VolumeSource {
  std::filesystem::path path;  ///< a folder of DICOM files with what lies below it, or a file
  std::string series;          ///< of several series: which, as choose_series takes it; empty for the only one
  bool untilt = false;         ///< whether slices that a tilted gantry shifted are resampled

  VolumeSource() = default;
  VolumeSource(std::filesystem::path p)
      : path(std::move(p)) {}                      // NOLINT(google-explicit-constructor): most have but one
  VolumeSource(const char* p) : path(p) {}         // NOLINT(google-explicit-constructor)
  VolumeSource(const std::string& p) : path(p) {}  // NOLINT(google-explicit-constructor)
};

}  // namespace birdseye::host
