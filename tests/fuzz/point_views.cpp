// Points that another program detected: three files a view, which an input holds one after the other, form feeds
// between them.

#include "host/files/point_files.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const auto parts = testing::parts_of<3>(testing::as_text({data, size}));
  const std::filesystem::path path = testing::as_file("ids.1.txt", parts[0]);
  testing::as_file("object_points.1.txt", parts[1]);
  testing::as_file("image_points.1.txt", parts[2]);
  const auto views = host::read_point_views(path.parent_path());
  if (!views) return 0;
  for (const auto& view : *views) {
    testing::must(view.ids.size() == view.points_in_marker_mm.size() && view.ids.size() == view.points_px.size(),
                  "each point has an id and two places");
  }
  return 0;
}
