// The names that 3D Slicer and TotalSegmentator write into the header of a file of labels.

#include "host/volume/nifti_label_names.hpp"
#include "host/volume/slicer_label_names.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string path = testing::as_file("labels", testing::as_text({data, size}));
  for (const auto& names : {host::slicer_label_names(path), host::nifti_label_names(path)}) {
    if (!names) {
      testing::must_name(names.error().what, path);
      continue;
    }
    for (const auto& label : *names) testing::must(!label.name.empty(), "a label's name is one");
  }
  return 0;
}
