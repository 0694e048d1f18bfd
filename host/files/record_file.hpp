#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "calibration/record/calibration_record.hpp"

namespace birdseye::host {

/// What a calibration writes into a scope's calibration record; the entry is made when its provenance is known.
struct RecordEntry {
  std::string made_from;  ///< the board and how many views, in words
  std::function<void(calibration::CalibrationRecord&, const calibration::Provenance&)> enter;
};

/// Reads a calibration record; an error names the file.
Result<calibration::CalibrationRecord> read_record(const std::filesystem::path& path);
/// The text of the calibration record with the entry in it: of the file at path, or of a new record where there is no
/// file. A file that is no sound calibration record is an error, so that it is not overwritten.
Result<std::string> record_with(const std::filesystem::path& path, const RecordEntry& entry, Grade grade);

/// Enters the lens into the record, and prints a line where a hand-eye entry is removed with the former lens.
void enter_lens(calibration::CalibrationRecord& record, calibration::LensEntry entry);

}  // namespace birdseye::host
