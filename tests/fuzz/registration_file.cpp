// A registration: a matrix alone, or with remarks and a sum.

#include "host/files/registration_file.hpp"
#include "calibration/record/sha256.hpp"
#include "host/files/text_files.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/poses.hpp"

namespace {

/// With the sum that fits, as anybody can write one.
std::string with_sum(std::string text) {
  const std::size_t at = text.rfind("# sha256 ");
  if (at == std::string::npos) return text;
  text.resize(at);
  const std::string sum = birdseye::calibration::sha256_of(text);
  return text.append("# sha256 ").append(sum).append("\n");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string text = testing::as_text({data, size}), path = testing::as_file("input.txt", text);
  (void)host::read_registration(path);
  if (const auto way = host::read_path(path)) {
    for (const auto& key : *way) testing::must(testing::is_pose(key), "a pose of a way is one");
  }
  const auto read = host::read_registration(testing::as_file("summed.txt", with_sum(text)));
  if (!read) {
    testing::must_name(read.error().what, "summed.txt");
    return 0;
  }
  testing::must(testing::is_pose(read->patient_from_tracker), "a registration is a pose");
  const auto again = host::read_registration(testing::as_file("again.txt", host::registration_text(*read)));
  testing::must(again && again->patient_from_tracker.matrix() == read->patient_from_tracker.matrix() &&
                    again->ct_sha256 == read->ct_sha256 && again->fre_mm == read->fre_mm,
                "what is written reads back the same");
  return 0;
}
