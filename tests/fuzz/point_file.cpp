// Points as 3D Slicer, MITK and tables of text have them.

#include "host/files/named_points.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string text = testing::as_text({data, size});
  for (const char* const name : {"points.mrk.json", "points.mps", "points.fcsv"}) {
    const std::string path = testing::as_file(name, text);
    for (const auto of : {host::PointsOf::patient, host::PointsOf::tracker, host::PointsOf::sensor}) {
      const auto read = host::read_named_points(path, of);
      if (!read) {
        testing::must_name(read.error().what, path);
        continue;
      }
      for (const Eigen::Vector3d& place : read->places_mm) testing::must(place.allFinite(), "a place is finite");
      std::vector<std::string> names = read->names;
      testing::must(names.empty() || names.size() == read->places_mm.size(), "all points have names, or none");
      std::sort(names.begin(), names.end());
      testing::must(std::adjacent_find(names.begin(), names.end()) == names.end(), "a name is one point's");
    }
  }
  return 0;
}
