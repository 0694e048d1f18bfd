// Poses from tables, matrices, NDI's logs, Motive's exports and PLUS sequences, read as they are and as somebody says.

#include <cmath>

#include "host/files/pose_files.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/poses.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string path = testing::as_file("poses.csv", testing::as_text({data, size}));
  host::PoseReading told;
  told.mm_per_unit = 1000;
  told.unit_said = true;
  told.s_per_unit = 1e-3;
  told.column_major = told.inverted = true;
  for (const host::PoseReading& how : {host::PoseReading{}, told}) {
    const auto set = host::read_pose_set(path, how);
    if (!set) {
      testing::must_name(set.error().what, path);
      continue;
    }
    testing::must(!set->poses.empty(), "a file without a pose is an error");
    for (const host::TimedPose& pose : set->poses) {
      testing::must(testing::is_pose(pose.tracker_from_sensor), "a pose that is used is one");
      testing::must(std::isfinite(pose.time_s), "a time that is used is one");
    }
    testing::must(!set->timed || std::is_sorted(set->poses.begin(), set->poses.end(),
                                                [](const auto& a, const auto& b) { return a.time_s < b.time_s; }),
                  "poses are in the order of their times");
  }
  return 0;
}
