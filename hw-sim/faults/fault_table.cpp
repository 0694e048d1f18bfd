#include "hw-sim/faults/fault_table.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kLeastChance = 0.001;  // of one that strikes nothing, nobody need tell anything
constexpr ParameterSpec kChance[] = {{"chance", 0.1, kLeastChance, 1}};
constexpr ParameterSpec kMetal[] = {{"peak_mm", 10, 0, 500}};
constexpr ParameterSpec kPower[] = {{"boot_s", 1.5, 0, 60}};
constexpr ParameterSpec kPpm[] = {{"ppm", 200, -10'000, 10'000}};
constexpr ParameterSpec kStepMs[] = {{"ms", 20, -1000, 1000}};
constexpr ParameterSpec kLateMs[] = {{"ms", 30, 0, 1000}};
constexpr ParameterSpec kGap[] = {{"chance", 0.1, kLeastChance, 1}, {"frames", 5, 1, 1'000'000, true}};
constexpr ParameterSpec kGarbage[] = {{"chance", 0.1, kLeastChance, 1}, {"bytes", 64, 1, 4096, true}};
constexpr ParameterSpec kTorn[] = {{"chance", 0.1, kLeastChance, 1}, {"part", 0.5, 0, 0.99}};

constexpr ParameterSpec kBump[] = {{"mm", 20, 0, 300}, {"deg", 5, 0, 90}, {"over_s", 0.2, 0, 600}};
constexpr ParameterSpec kTilt[] = {{"deg", 8, -30, 30}, {"over_s", 3, 0, 600}};
constexpr ParameterSpec kMoved[] = {{"mm", 10, 0, 300}, {"deg", 3, 0, 90}, {"over_s", 1, 0, 600}};
constexpr ParameterSpec kSlipped[] = {{"mm", 15, 0, 300}, {"deg", 10, 0, 180}, {"over_s", 0.1, 0, 600}};
constexpr ParameterSpec kBreath[] = {{"mm", 10, 0, 50}, {"period_s", 4, 1, 30}};
constexpr ParameterSpec kResected[] = {
    {"width_mm", 40, 5, 150}, {"depth_mm", 20, 1, 60}, {"aside_mm", 35, -100, 100}, {"over_s", 0, 0, 600}};
constexpr ParameterSpec kZoomed[] = {{"factor", 1.3, 0.5, 3}, {"over_s", 0.5, 0, 600}};
constexpr ParameterSpec kDelayMs[] = {{"ms", 300, 0, 10'000}};
constexpr ParameterSpec kSyncMs[] = {{"ms", 300, 0, 1000}};  // birdseyed, once it is ended, waits for a few
constexpr ParameterSpec kCut[] = {{"after_syncs", 1, 0, 1000, true}};
constexpr ParameterSpec kTurned[] = {{"deg", 30, -180, 180}, {"over_s", 0.5, 0, 600}};

// A program or a scope is away for so long at least. Silence that is shorter is a hole that no camera is blamed for,
// and a change of size that is shorter may fall between two frames.
constexpr double kLeastAway_s = 0.1, kLeastSilence_s = 0.5, kLeastOfFrames_s = 0.1;

constexpr FaultSpec kTable[] = {
    {FaultKind::drop_byte, true, false, false, false, WithoutEnd::once, kChance},
    {FaultKind::duplicate_byte, true, false, false, false, WithoutEnd::once, kChance},
    {FaultKind::corrupt_byte, true, false, false, false, WithoutEnd::once, kChance},
    {FaultKind::wrong_phase_bit, true, false, false, false, WithoutEnd::once, kChance},
    {FaultKind::line_noise, true, false, false, false, WithoutEnd::once, kChance},
    {FaultKind::lost_record, true, false, false, false, WithoutEnd::once, kChance},
    {FaultKind::stuck_stream, true, false, false, false, WithoutEnd::refused, {}},
    {FaultKind::frozen_pose, true, false, false, false, WithoutEnd::refused, {}},
    {FaultKind::saturated, true, false, false, false, WithoutEnd::refused, {}},
    {FaultKind::zero_matrix, true, false, false, false, WithoutEnd::refused, {}},
    {FaultKind::hemisphere_flip, true, false, false, false, WithoutEnd::refused, {}},
    {FaultKind::metal_distortion, true, false, false, false, WithoutEnd::for_good, kMetal},
    {FaultKind::power_cycle, true, false, false, false, WithoutEnd::refused, kPower},
    {FaultKind::drift_step, true, false, false, false, WithoutEnd::for_good, kPpm},
    {FaultKind::clock_step, true, true, false, false, WithoutEnd::for_good, kStepMs},
    {FaultKind::unplug, true, true, false, false, WithoutEnd::refused, {}},
    {FaultKind::drop_frames, false, true, false, false, WithoutEnd::once, kChance},
    {FaultKind::sequence_gap, false, true, false, false, WithoutEnd::once, kGap},
    {FaultKind::silence, false, true, false, false, WithoutEnd::refused, {}, kLeastSilence_s},
    {FaultKind::late_frames, false, true, false, false, WithoutEnd::refused, kLateMs},
    {FaultKind::duplicate_frames, false, true, false, false, WithoutEnd::once, kChance},
    {FaultKind::garbage, false, true, false, false, WithoutEnd::once, kGarbage},
    {FaultKind::size_change, false, true, false, false, WithoutEnd::refused, {}, kLeastOfFrames_s},
    {FaultKind::torn_frame, false, true, false, false, WithoutEnd::once, kTorn},
    {FaultKind::transmitter_bumped, false, false, true, false, WithoutEnd::for_good, kBump},
    {FaultKind::bed_tilted, false, false, true, false, WithoutEnd::for_good, kTilt},
    {FaultKind::patient_moved, false, false, true, false, WithoutEnd::for_good, kMoved},
    {FaultKind::reference_moved, false, false, true, false, WithoutEnd::for_good, kSlipped},
    {FaultKind::breathing, false, false, true, false, WithoutEnd::for_good, kBreath},
    {FaultKind::resected, false, false, true, false, WithoutEnd::for_good, kResected},
    {FaultKind::lens_zoomed, false, false, true, false, WithoutEnd::for_good, kZoomed},
    {FaultKind::scope_turned, false, false, true, false, WithoutEnd::for_good, kTurned},
    {FaultKind::link_cut, false, false, false, true, WithoutEnd::once, {}},
    {FaultKind::appliance_restart, false, false, false, true, WithoutEnd::refused, {}, kLeastAway_s},
    {FaultKind::window_restart, false, false, false, true, WithoutEnd::refused, {}, kLeastAway_s},
    {FaultKind::scope_exchanged, false, false, false, true, WithoutEnd::refused, {}, kLeastAway_s},
    {FaultKind::link_late, false, false, false, true, WithoutEnd::refused, kDelayMs},
    {FaultKind::window_stalls, false, false, false, true, WithoutEnd::refused, {}},
    {FaultKind::disk_late, false, false, false, true, WithoutEnd::refused, kDelayMs},
    {FaultKind::disk_full, false, false, false, true, WithoutEnd::refused, {}},
    {FaultKind::power_cut, false, false, false, true, WithoutEnd::refused, kCut, kLeastAway_s},
    {FaultKind::appliance_power_cut, false, false, false, true, WithoutEnd::refused, {}, kLeastAway_s},
    {FaultKind::appliance_disk_late, false, false, false, true, WithoutEnd::refused, kSyncMs},
    {FaultKind::appliance_disk_full, false, false, false, true, WithoutEnd::refused, {}},
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
