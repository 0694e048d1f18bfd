// Where the points of a rigid body were tracked, row by row; and the body itself.

#include "host/files/body_points.hpp"
#include "host/files/rigid_body.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/poses.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string path = testing::as_file("input.csv", testing::as_text({data, size}));
  if (const auto body = host::read_rigid_body(path, 1)) {
    testing::must(body->points_mm.size() >= 3, "a body has three points");
    testing::must(body->names.empty() || body->names.size() == body->points_mm.size(),
                  "all points have names, or none");
    for (const Eigen::Vector3d& point : body->points_mm) testing::must(point.allFinite(), "a point is finite");
  }
  host::PoseReading how;
  how.body = testing::as_file("body.csv", "a,0,0,0\nb,50,0,0\nc,0,70,0\nd,0,0,90\n");
  const auto set = host::read_body_poses(path, how);
  if (!set) return 0;
  for (const host::TimedPose& pose : set->poses) {
    testing::must(testing::is_pose(pose.tracker_from_sensor), "a pose that is used is one");
    testing::must(pose.error_mm && *pose.error_mm <= host::kMostBodyError_mm, "a body that fits badly is rejected");
  }
  return 0;
}
