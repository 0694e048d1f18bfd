#include "hw-sim/faults/fault_table.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr ParameterSpec kChance[] = {{"chance", 0.1, 0, 1}};
constexpr ParameterSpec kMetal[] = {{"peak_mm", 10, 0, 500}};
constexpr ParameterSpec kPower[] = {{"boot_s", 1.5, 0, 60}};
constexpr ParameterSpec kPpm[] = {{"ppm", 200, -10'000, 10'000}};
constexpr ParameterSpec kStepMs[] = {{"ms", 20, -1000, 1000}};
constexpr ParameterSpec kLateMs[] = {{"ms", 30, 0, 1000}};
constexpr ParameterSpec kGap[] = {{"chance", 0.1, 0, 1}, {"frames", 5, 1, 1'000'000, true}};
constexpr ParameterSpec kGarbage[] = {{"chance", 0.1, 0, 1}, {"bytes", 64, 1, 4096, true}};
constexpr ParameterSpec kTorn[] = {{"chance", 0.1, 0, 1}, {"part", 0.5, 0, 0.99}};

constexpr FaultSpec kTable[] = {
    {FaultKind::drop_byte, true, false, WithoutEnd::once, kChance},
    {FaultKind::duplicate_byte, true, false, WithoutEnd::once, kChance},
    {FaultKind::corrupt_byte, true, false, WithoutEnd::once, kChance},
    {FaultKind::wrong_phase_bit, true, false, WithoutEnd::once, kChance},
    {FaultKind::line_noise, true, false, WithoutEnd::once, kChance},
    {FaultKind::lost_record, true, false, WithoutEnd::once, kChance},
    {FaultKind::stuck_stream, true, false, WithoutEnd::refused, {}},
    {FaultKind::frozen_pose, true, false, WithoutEnd::refused, {}},
    {FaultKind::saturated, true, false, WithoutEnd::refused, {}},
    {FaultKind::zero_matrix, true, false, WithoutEnd::refused, {}},
    {FaultKind::hemisphere_flip, true, false, WithoutEnd::refused, {}},
    {FaultKind::metal_distortion, true, false, WithoutEnd::for_good, kMetal},
    {FaultKind::power_cycle, true, false, WithoutEnd::refused, kPower},
    {FaultKind::drift_step, true, false, WithoutEnd::for_good, kPpm},
    {FaultKind::clock_step, true, true, WithoutEnd::for_good, kStepMs},
    {FaultKind::unplug, true, true, WithoutEnd::refused, {}},
    {FaultKind::drop_frames, false, true, WithoutEnd::once, kChance},
    {FaultKind::sequence_gap, false, true, WithoutEnd::once, kGap},
    {FaultKind::silence, false, true, WithoutEnd::refused, {}},
    {FaultKind::late_frames, false, true, WithoutEnd::refused, kLateMs},
    {FaultKind::duplicate_frames, false, true, WithoutEnd::once, kChance},
    {FaultKind::garbage, false, true, WithoutEnd::once, kGarbage},
    {FaultKind::size_change, false, true, WithoutEnd::refused, {}},
    {FaultKind::torn_frame, false, true, WithoutEnd::once, kTorn},
};

}  // namespace

std::span<const FaultSpec> fault_table() {
  return kTable;
}

const FaultSpec* fault_spec(std::string_view name) {
  for (const FaultSpec& spec : kTable) {
    if (fault_name(spec.kind) == name) return &spec;
  }
  return nullptr;
}

}  // namespace birdseye::hw_sim
