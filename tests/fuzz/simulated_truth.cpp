// The simulator's truth: three files, which an input holds one after the other, form feeds between them.

#include "host/simulated/simulated_truth.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const auto parts = testing::parts_of<3>(testing::as_text({data, size}));
  const std::filesystem::path path = testing::as_file("truth.json", parts[0]);
  testing::as_file("frames.csv", parts[1]);
  testing::as_file("scene.csv", parts[2]);
  const auto truth = host::read_simulated_truth(path.parent_path());
  if (!truth) {
    testing::must_name(truth.error().what, path.parent_path());
    return 0;
  }
  const auto& [sequence, frame] = *truth->frames.begin();
  (void)host::overlay_error(*truth, sequence, frame.camera, frame.camera_from_patient, Eigen::Vector3d::Zero());
  return 0;
}
