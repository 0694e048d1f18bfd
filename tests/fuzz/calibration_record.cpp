// A scope's calibration record.

#include "calibration/record/calibration_record.hpp"
#include "tests/fuzz/checksums.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/poses.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string input = testing::as_text({data, size});
  (void)calibration::parse_record(input);
  const auto record = calibration::parse_record(testing::with_checksum(input, testing::Keys::as_written));
  if (!record) return 0;
  testing::must(!record->lens || check(record->lens->camera), "a lens is one");
  testing::must(!record->hand_eye || testing::is_pose(record->hand_eye->camera_from_sensor), "a hand-eye is a pose");
  const std::string text = calibration::record_text(*record);
  const auto again = calibration::parse_record(text);
  testing::must(again && calibration::record_text(*again) == text, "what is written reads back the same");
  return 0;
}
