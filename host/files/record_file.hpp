#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "calibration/record/calibration_record.hpp"

namespace birdseye::host {

/// What a calibration has to write into a scope's record: the entry is made from the provenance that it is given.
struct RecordEntry {
  std::string made_from;  ///< the board and how many views, in words
  std::function<void(calibration::CalibrationRecord&, const calibration::Provenance&)> enter;
};

/// An error names the file.
Result<calibration::CalibrationRecord> read_record(const std::filesystem::path& path);
/// The record's text with the entry in it: of the file that is there, or of a new one where there is none. A file that
/// is there and is no sound record is an error: it is not overwritten.
Result<std::string> record_with(const std::filesystem::path& path, const RecordEntry& entry, Grade grade);

/// The record's lens from now on. Says so where a hand-eye goes with the lens before.
void enter_lens(calibration::CalibrationRecord& record, calibration::LensEntry entry);

}  // namespace birdseye::host
