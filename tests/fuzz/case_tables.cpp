// The tables that a case names: places, landmarks and the true deformation.

#include "host/case/point_rows.hpp"
#include "host/case/true_deformation.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string path = testing::as_file("input.txt", testing::as_text({data, size}));
  if (const auto rows = host::read_point_rows(path)) {
    for (const auto& seen : rows->surface) testing::must(seen.place_mm.allFinite(), "a place is finite");
    for (const auto& match : rows->matched)
      testing::must(match.place.rest_mm.allFinite() && match.place.seen_mm.allFinite(), "a place is finite");
  }
  if (const auto landmarks = host::read_landmarks(path)) {
    for (const auto& landmark : *landmarks)
      testing::must(landmark.rest_mm.allFinite() && landmark.deformed_mm.allFinite(), "a place is finite");
  }
  if (const auto truth = host::read_true_deformation(path)) {
    testing::must(truth->box_mm.minCoeff() > 0, "a box has a size");
    (void)truth->patch.displacement({0.5, 0.5, 0.5});
  }
  return 0;
}
