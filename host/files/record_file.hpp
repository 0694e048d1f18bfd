#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "calibration/record/calibration_record.hpp"
#include "host/files/authors.hpp"

namespace birdseye::host {

/// What a calibration writes into a scope's calibration record; the entry is made when its provenance is known.
struct RecordEntry {
  std::string made_from;  ///< the board and how many views, in words
  std::function<void(calibration::CalibrationRecord&, const calibration::Provenance&)> enter;
  std::string doubt{};  ///< that it rests on what no known machine signed; empty: on nothing such
};

/// Reads a calibration record; an error names the file. Who signed it is for the caller to judge.
Result<calibration::SignedRecord> read_signed_record(const std::filesystem::path& path);
/// One that reports and conversions read, whoever wrote it: what is not signed by a known machine has a line on stderr.
Result<calibration::CalibrationRecord> read_record(const std::filesystem::path& path);

struct AdmittedRecord {
  calibration::CalibrationRecord record;
  std::string doubt;  ///< that its author, or that of what it rests on, is not known; empty: all are
};
/// One to draw by, or to go on from.
Result<AdmittedRecord> read_record(const std::filesystem::path& path, const Authors& authors);
Result<AdmittedRecord> admit_record(const std::string& text, const Authors& authors);

/// The record's text, signed by this machine.
std::string record_text(const calibration::CalibrationRecord& record, const ThisMachine& machine);
/// The text of the calibration record with the entry in it, signed by this machine: of the file at path, or of a new
/// record where there is no file. A file that is no sound calibration record, or of an author who is not admitted, is
/// an error, so that it is not overwritten.
Result<std::string> record_with(const std::filesystem::path& path, const RecordEntry& entry, Grade grade,
                                const Authors& authors);

/// Enters the lens into the record, and prints a line where a hand-eye entry is removed with the former lens.
void enter_lens(calibration::CalibrationRecord& record, calibration::LensEntry entry);

}  // namespace birdseye::host
