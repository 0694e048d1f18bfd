// A lens as OpenCV, ROS and Kalibr write it, and where a camera is against another.

#include "host/files/camera_files.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/poses.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string text = testing::as_text({data, size});
  // OpenCV's reader of XML has holes of its own (it follows a null pointer). The product gives it such a text in a
  // confined process, which this program is not. What is made of a text's figures is the same in YAML and JSON.
  const std::size_t first = text.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  if (first != std::string::npos && text[first] == '<') return 0;
  const std::string path = testing::as_file("camera.yaml", text);
  const auto relation = host::read_camera_relation(path);
  testing::must(!relation || testing::is_rigid(*relation), "where a camera is against another is a pose");
  (void)host::read_camera_covariance(path);
  const auto camera = host::read_camera(path);
  if (!camera) {
    testing::must_name(camera.error().what, path);
    return 0;
  }
  testing::must(check(*camera).has_value(), "a lens is one");
  const auto again = host::read_camera(testing::as_file("again.yaml", host::camera_text(*camera)));
  testing::must(again && *again == *camera, "what is written reads back the same");
  return 0;
}
