// A map of the tracker's field.

#include "calibration/record/field_map_file.hpp"
#include "tests/fuzz/checksums.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/poses.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string input = testing::as_text({data, size});
  (void)calibration::parse_field_map(input);
  const auto file = calibration::parse_field_map(testing::with_checksum(input, testing::Keys::sorted));
  if (!file) return 0;
  const auto& functions = file->map.data().functions;
  const Eigen::Vector3d middle = (functions.low_mm + functions.high_mm) / 2;
  const auto corrected = file->map.correct(Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), middle));
  testing::must(!corrected || testing::is_pose(corrected->tracker_from_sensor), "a corrected pose is one");
  const std::string text = calibration::field_map_text(file->map, file->notes, file->signature);
  const auto again = calibration::parse_field_map(text);
  testing::must(again && calibration::field_map_text(again->map, again->notes, again->signature) == text,
                "what is written reads back the same");
  return 0;
}
