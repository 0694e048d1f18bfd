// What is read of a NIfTI file's header before ITK is given the file.

#include "host/volume/nifti_file.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const auto file = host::NiftiFile::open(testing::as_file("input.nii", testing::as_text({data, size})));
  if (!file || !file->header_is_sound()) return 0;
  (void)file->type_fault();
  (void)file->gaps();
  (void)file->unread_place();
  (void)file->fault(file->bytes_of(8), file->bytes_of(2));
  if (const auto place = file->place_by("LPS"))
    testing::must(place->axes.allFinite() && file->says_a_place(), "a place of voxels is one");
  return 0;
}
