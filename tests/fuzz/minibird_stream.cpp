// The bytes that a miniBIRD streams. The first bytes of an input say how they are to be read, and then how they come.

#include <array>

#include "drivers/minibird/assembler.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/poses.hpp"

namespace {

using namespace birdseye;
using namespace birdseye::drivers::minibird;

StreamLayout layout_of(testing::Pieces& input) {
  constexpr std::array kFormats{
      RecordFormat::position_matrix, RecordFormat::position_angles, RecordFormat::position_quaternion,
      RecordFormat::position,        RecordFormat::angles,          RecordFormat::matrix,
      RecordFormat::quaternion};
  const unsigned how = input.byte();
  StreamLayout layout;
  layout.button_byte = (how & 1U) != 0;
  layout.group_mode = (how & 2U) != 0;
  layout.birds.resize(layout.group_mode ? 1 + (how >> 2U & 3U) : 1);
  for (BirdLayout& bird : layout.birds) bird.format = kFormats.at(input.byte() % kFormats.size());
  return layout;
}

void must_be_sound(const BirdReading& reading) {
  testing::must(reading.pose.has_value() == reading.doubt.empty(), "a reading has a pose, or says why it has none");
  if (!reading.pose) return;
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  if (reading.pose->position_mm) pose.topRightCorner<3, 1>() = *reading.pose->position_mm;
  if (reading.pose->rotation) pose.topLeftCorner<3, 3>() = *reading.pose->rotation;
  testing::must(testing::is_rigid(pose), "a bird's pose is one");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  testing::Pieces input({data, size});
  const StreamLayout layout = layout_of(input);
  MeasurementAssembler assembler(layout);
  RecordParser parts(layout), whole(layout);
  Bytes all;
  std::size_t records = 0;
  DeviceTime now{1'000'000'000};
  while (!input.empty()) {
    const unsigned how = input.byte();
    const auto bytes = input.take(1 + how % 64);
    now = now + Duration{(1 + std::int64_t{how}) * 200'000};
    const Chunk chunk{{bytes.begin(), bytes.end()}, now, how > 250, how == 250};
    all.insert(all.end(), bytes.begin(), bytes.end());
    records += parts.push(bytes).size();
    for (const Measurement& measurement : assembler.push(chunk)) {
      testing::must(measurement.birds.size() == layout.birds.size(), "a measurement is of all birds");
      testing::must(measurement.acquired_sigma.ns >= 0, "a sigma is none below 0");
      for (const BirdReading& reading : measurement.birds) must_be_sound(reading);
    }
  }
  testing::must(whole.push(all).size() == records, "portions make no difference");
  return 0;
}
