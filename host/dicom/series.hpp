#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/dicom/dicom_file.hpp"
#include "host/dicom/slice_stack.hpp"

namespace birdseye::host {

/// What a series, or one of several volumes in it, is to whoever chooses one. Texts are empty where nothing is known.
struct SeriesInfo {
  std::string id;   ///< to choose it by: its number, "3"; "3b" where another has it too; "3.2" of several volumes
  std::string uid;  ///< Series Instance UID (0020,000E)
  std::string description, modality;
  std::string date, time;     ///< YYYYMMDD, HHMMSS
  std::string agent;          ///< contrast medium
  std::string phase;          ///< of the contrast medium, where the file names one: phase_named_in
  std::string part;           ///< what tells it from the other volumes of its series: "acquisition 2"
  std::string syntax;         ///< how its pixels are stored
  std::array<int, 3> size{};  ///< columns, rows, slices; 0 where they are not known
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();  ///< columns: of columns, rows and slices, patient; 0 if not known
  std::string problem;                             ///< why it cannot be read as a volume; empty where it can
  bool passed_over = false;                        ///< a localizer, or no CT: taken only when it is named
};

/// A series, or one of several volumes in it.
struct Series {
  SeriesInfo info;
  SliceStack stack;           ///< no slices where a file has a fault
  std::filesystem::path bad;  ///< the file with the fault; empty where there is none
  std::string fault;
  std::vector<std::filesystem::path> copies;  ///< of other files of the series, which were taken in their place
};

/// Sorts what files hold into series, by number, and a series whose slices lie at the same places, or differ in size or
/// orientation, into its volumes. untilt: whether a tilt is no problem.
std::vector<Series> sort_into_series(const std::vector<DicomFile>& files, bool untilt);

/// Makes a file that cannot be read a fault of all series that have slices in its folder: it may have been one of them.
void blame_neighbours(std::vector<Series>& series, const std::vector<DicomFile>& files,
                      const std::filesystem::path& unreadable, const std::string& why);

}  // namespace birdseye::host
