#include "host/files/record_file.hpp"

#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "drivers/system/clock.hpp"

namespace birdseye::host {

Result<calibration::CalibrationRecord> read_record(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    return Error{Errc::unreadable,
                 path.string() + ": cannot be read; give a record that birdseye calibrate has written (--record)"};
  std::ostringstream text;
  text << file.rdbuf();
  auto record = calibration::parse_record(text.str());
  if (!record) return record.error().with_context(path.string());
  return record;
}

Result<std::string> record_with(const std::filesystem::path& path, const RecordEntry& entry, Grade grade) {
  calibration::CalibrationRecord record;
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored)) {
    auto read = read_record(path);
    if (!read) return read.error();
    record = *std::move(read);
  }
  entry.enter(record, {utc_now(), "birdseye " BIRDSEYE_VERSION, entry.made_from, grade});
  return record_text(record);
}

void enter_lens(calibration::CalibrationRecord& record, calibration::LensEntry entry) {
  if (record.set_lens(std::move(entry)))
    fmt::print("the record's hand-eye is removed: it was made with another lens; calibrate it again\n");
}

}  // namespace birdseye::host
