// What a window keeps of an operation. Its seal is made to fit, as anybody can: it tells damage, and no author.

#include <nlohmann/json.hpp>

#include "host/files/sealed_text.hpp"
#include "host/operation/operation.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/poses.hpp"

namespace {

std::string sealed(const std::string& text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return text;
  std::vector<birdseye::host::SealedPart> parts;
  for (const auto& [name, value] : json.items()) {
    if (name != "sha256" && name != "whole" && name != "signed") parts.emplace_back(name, value);
  }
  return birdseye::host::sealed_text(parts);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string text = testing::as_text({data, size});
  (void)host::read_signed_operation(testing::as_file("damaged.json", text));
  const std::string path = testing::as_file("operation.json", sealed(text));
  const auto read = host::read_signed_operation(path);
  if (!read) {
    testing::must_name(read.error().what, path);
    return 0;
  }
  const host::Operation* const operation = &read->operation;
  const auto& calibrated = operation->calibrated;
  const auto& registered = operation->registered;
  testing::must(!calibrated || testing::is_pose(calibrated->scope.camera_from_sensor()), "a hand-eye is a pose");
  testing::must(!calibrated || check(calibrated->scope.camera()), "a lens is one");
  testing::must(!registered || testing::is_pose(registered->tracker_from_patient), "a registration is a pose");
  for (std::size_t i = 0; operation->deformed && i < operation->deformed->field.displacement_mm.size(); ++i)
    testing::must(operation->deformed->field.displacement_mm[i].allFinite(), "a displacement is finite");
  return 0;
}
