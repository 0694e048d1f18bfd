// What maps of the field are made of, and the history of a plate.

#include "host/files/field_files.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string text = testing::as_text({data, size}), path = testing::as_file("input.csv", text);
  (void)host::parse_grid_spec(text);
  for (const bool held_alike : {false, true}) {
    const auto grid = host::read_field_grid(path, held_alike, 10);
    if (!grid) continue;
    for (const auto& sample : grid->samples) {
      testing::must(sample.true_mm.allFinite(), "a place is finite");
      testing::must(sample.measured.matrix().allFinite(), "a measured pose is finite");
    }
  }
  if (const auto places = host::read_places(path)) {
    for (const auto& [name, place] : *places) testing::must(place.allFinite(), "a place is finite");
  }
  const auto history = host::read_history(path);
  if (!history) return 0;
  const auto again = host::read_history(testing::as_file("again.csv", host::history_text(*history)));
  testing::must(again && again->size() == history->size(), "no day is lost when a history is written anew");
  return 0;
}
