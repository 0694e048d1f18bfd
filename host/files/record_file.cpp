#include "host/files/record_file.hpp"

#include <fmt/format.h>

#include "drivers/system/clock.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye::host {

Result<calibration::SignedRecord> read_signed_record(const std::filesystem::path& path) {
  const auto text = read_whole_file(path, kMostTextBytes);
  if (!text) {
    return Error{text.error().code,
                 text.error().what + "; give a record that birdseye calibrate has written (--record)"};
  }
  auto record = calibration::parse_signed_record(*text);
  if (!record) return record.error().with_context(path.string());
  return record;
}

namespace {

Result<AdmittedRecord> admit(calibration::SignedRecord read, const Authors& authors) {
  auto doubt = authors.admit_with_rest(calibration::kRecordFormat, read.sha256, read.signature, doubt_of(read.record));
  if (!doubt) return Error{doubt.error().code, "the calibration record " + doubt.error().what};
  return AdmittedRecord{std::move(read.record), *std::move(doubt)};
}

}  // namespace

Result<calibration::CalibrationRecord> read_record(const std::filesystem::path& path) {
  auto read = read_signed_record(path);
  if (!read) return read.error();
  if (auto noted = note_author(path.string(), calibration::kRecordFormat, read->sha256, read->signature); !noted)
    return noted.error();
  note_resting_on(path.string(), doubt_of(read->record));
  return std::move(read->record);
}

Result<AdmittedRecord> read_record(const std::filesystem::path& path, const Authors& authors) {
  auto read = read_signed_record(path);
  if (!read) return read.error();
  return admit(*std::move(read), authors).with_context(path.string());
}

Result<AdmittedRecord> admit_record(const std::string& text, const Authors& authors) {
  auto read = calibration::parse_signed_record(text);
  if (!read) return read.error();
  return admit(*std::move(read), authors);
}

std::string record_text(const calibration::CalibrationRecord& record, const ThisMachine& machine) {
  return record_text(record, machine.sign(calibration::kRecordFormat, signed_sha256(record)));
}

Result<std::string> record_with(const std::filesystem::path& path, const RecordEntry& entry, Grade grade,
                                const Authors& authors) {
  calibration::CalibrationRecord record;
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored)) {
    auto read = read_record(path, authors);
    if (!read) return read.error();
    record = std::move(read->record);
  }
  entry.enter(record, {utc_now(), "birdseye " BIRDSEYE_VERSION, entry.made_from, grade, entry.doubt});
  std::string text = record_text(record, *authors.machine);
  // What no reader takes would be written over a record that is sound.
  if (const auto sound = calibration::parse_record(text); !sound)
    return sound.error().with_context(fmt::format("{} is left as it was, for with this entry", path.string()));
  return text;
}

void enter_lens(calibration::CalibrationRecord& record, calibration::LensEntry entry) {
  if (record.set_lens(std::move(entry)))
    fmt::print("the record's hand-eye is removed: it was made with another lens; calibrate it again\n");
}

}  // namespace birdseye::host
