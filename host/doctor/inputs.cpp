#include "host/doctor/inputs.hpp"

#include <fmt/format.h>

#include "host/doctor/appliance.hpp"
#include "host/files/record_file.hpp"
#include "host/volume/import.hpp"

namespace birdseye::host {

namespace {

constexpr const char* kInputs = "files";
constexpr Duration kCtWithin = Duration::from_ms(320'000);  // the decoder's own deadline is five minutes

std::vector<Check> check_ct(const VolumeSource& ct) {
  Check check{kInputs, "CT", CheckState::good, "", ""};
  const auto imported = import_body(ct);
  if (!imported) {
    check.state = CheckState::bad;
    check.found = imported.error().what;
    check.remedy = "docs/manual/volumes.md says what is read; \"birdseye volume info PATH\" lists a folder's series";
    return {check};
  }
  const Volume& volume = imported->volume;
  check.found = fmt::format("{}: can be read, {} x {} x {} voxels of {:.2f} x {:.2f} x {:.2f} mm", ct.path.string(),
                            volume.size[0], volume.size[1], volume.size[2], volume.spacing_mm.x(),
                            volume.spacing_mm.y(), volume.spacing_mm.z());
  std::vector<Check> checks{check};
  for (const std::string& note : imported->notes)
    checks.push_back({kInputs, "CT", CheckState::good, "note: " + note, ""});
  return checks;
}

Check check_author(const calibration::SignedRecord& read) {
  Check check{kInputs, "record's signature", CheckState::good, "", ""};
  const auto authors = Authors::of_this_machine(true);
  const auto author = authors ? authors->machine->author_of(calibration::kRecordFormat, read.sha256, read.signature)
                              : Result<Author>(authors.error());
  if (!author) {
    check.state = CheckState::bad;
    check.found = author.error().what;
    return check;
  }
  check.found = author->words();
  const std::string doubt = doubt_of(read.record);
  if (!doubt.empty()) check.found += fmt::format("; rests on what no known machine had signed ({})", doubt);
  if (author->standing == Author::Standing::known && doubt.empty()) return check;
  check.state = CheckState::could_be_better;
  check.remedy = "live and replay use it only with --accept-unsigned: docs/manual/signatures.md";
  return check;
}

std::vector<Check> check_record(const std::filesystem::path& path) {
  Check check{kInputs, "calibration record", CheckState::good, "", ""};
  const auto read = read_signed_record(path);
  if (!read) {
    check.state = CheckState::bad;
    check.found = read.error().what;
    check.remedy = "take a copy that is whole, or calibrate: docs/manual/calibration.md";
    return {check};
  }
  const calibration::CalibrationRecord* const record = &read->record;
  check.found = fmt::format("{}: is sound, of {}: {}", path.string(),
                            record->scope.empty() ? "a scope without a name" : record->scope, record_words(*record));
  if (!record->lens || !record->hand_eye) {
    check.state = CheckState::could_be_better;
    check.remedy = "an overlay takes lens and hand-eye: calibrate what is not there";
  }
  return {check, check_author(*read)};
}

}  // namespace

Question ct_question(const VolumeSource& ct) {
  return {.area = kInputs, .name = "CT", .within = kCtWithin, .ask = [ct] { return check_ct(ct); }};
}

Question record_question(const std::filesystem::path& record) {
  return {.area = kInputs, .name = "calibration record", .ask = [record] { return check_record(record); }};
}

}  // namespace birdseye::host
