// A calibration pattern as a person names it, and the places of its points.

#include "calibration/detect/pattern.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const auto pattern = calibration::parse_pattern(testing::as_text({data, size}));
  if (!pattern) return 0;
  testing::must(pattern->columns > 0 && pattern->rows > 0 && pattern->spacing_mm > 0, "a pattern has a size");
  const auto points = calibration::pattern_points_mm(*pattern);
  for (const Eigen::Vector3d& point : points) testing::must(point.allFinite(), "a point is finite");
  for (const int id : pattern->under_bars)
    testing::must(id >= 0 && id < static_cast<int>(points.size()), "a bar covers places of the grid");
  for (const int id : pattern->larger_dots)
    testing::must(id >= 0 && id < static_cast<int>(points.size()), "a dot is one of the grid");
  if (pattern->kind == calibration::PatternKind::charuco) (void)calibration::tag_places(*pattern);
  return 0;
}
