// A surface as the simulator's phantom writes it.

#include "hw-sim/phantom/mesh.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string path = testing::as_file("input.ply", testing::as_text({data, size}));
  const auto mesh = hw_sim::read_ply(path);
  if (!mesh) {
    testing::must_name(mesh.error().what, path);
    return 0;
  }
  for (const auto& triangle : mesh->triangles) {
    for (const auto corner : triangle) testing::must(corner < mesh->vertices.size(), "a triangle has three corners");
  }
  return 0;
}
