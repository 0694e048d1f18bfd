#include "hw-sim/operation/operation_faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>

#include "hw-sim/base/hashed.hpp"
#include "hw-sim/faults/fault_table.hpp"

namespace birdseye::hw_sim {

namespace {

/// A kind of fault as an operation meets it: for how long, and with which parameters in place of the usual ones.
struct DrawnFault {
  FaultKind kind;
  FaultTarget of;
  double least_s, most_s;
  const char* parameter = "";
  double least = 0, most = 0;
};

constexpr FaultTarget kTracker = FaultTarget::tracker, kCamera = FaultTarget::camera, kWorld = FaultTarget::world,
                      kProgram = FaultTarget::program;

constexpr DrawnFault kDrawn[] = {
    {FaultKind::drop_byte, kTracker, 1, 5, "chance", 0.2, 0.5},
    {FaultKind::duplicate_byte, kTracker, 1, 5, "chance", 0.2, 0.5},
    {FaultKind::corrupt_byte, kTracker, 1, 5, "chance", 0.2, 0.5},
    {FaultKind::wrong_phase_bit, kTracker, 1, 5, "chance", 0.2, 1},
    {FaultKind::line_noise, kTracker, 1, 5, "chance", 0.2, 0.5},
    {FaultKind::lost_record, kTracker, 1, 5, "chance", 0.2, 0.5},
    {FaultKind::zero_matrix, kTracker, 1, 5},
    {FaultKind::saturated, kTracker, 1, 5},
    {FaultKind::frozen_pose, kTracker, 1, 5},
    {FaultKind::hemisphere_flip, kTracker, 1, 5},
    {FaultKind::metal_distortion, kTracker, 1, 5, "peak_mm", 2, 20},
    {FaultKind::stuck_stream, kTracker, 1, 10},
    {FaultKind::unplug, kTracker, 1, 20},
    {FaultKind::power_cycle, kTracker, 1, 10, "boot_s", 0.5, 2},
    {FaultKind::clock_step, kTracker, 3, 10, "ms", 15, 40},
    {FaultKind::drift_step, kTracker, 3, 10, "ppm", 1500, 3000},
    {FaultKind::drop_frames, kCamera, 2, 5, "chance", 0.2, 0.5},
    {FaultKind::sequence_gap, kCamera, 2, 5, "chance", 0.2, 0.5},
    {FaultKind::late_frames, kCamera, 2, 5, "ms", 20, 200},
    {FaultKind::duplicate_frames, kCamera, 2, 5, "chance", 0.2, 0.5},
    {FaultKind::size_change, kCamera, 2, 5},
    {FaultKind::silence, kCamera, 2, 15},
    {FaultKind::clock_step, kCamera, 3, 10, "ms", 15, 40},
    {FaultKind::garbage, kCamera, 2, 5, "chance", 0.1, 0.3},
    {FaultKind::torn_frame, kCamera, 2, 5, "chance", 0.1, 0.3},
    {FaultKind::unplug, kCamera, 1, 20},
    // These need a reference bird to be seen.
    {FaultKind::transmitter_bumped, kWorld, 5, 60, "mm", 2, 40},
    {FaultKind::patient_moved, kWorld, 5, 60, "mm", 2, 20},
};

/// The patient that moves along the line of sight, with the scope in his wall, the video does not surely show.
constexpr DrawnFault kDrawnInView[] = {{FaultKind::transmitter_bumped, kWorld, 20, 90, "mm", 15, 40}};

constexpr DrawnFault kDrawnOfScopeInView[] = {
    {FaultKind::scope_turned, kWorld, 10, 60, "deg", 20, 60},
    {FaultKind::scope_turned, kWorld, 10, 60, "deg", -60, -20},
    {FaultKind::lens_zoomed, kWorld, 10, 60, "factor", 1.2, 1.7},
    {FaultKind::lens_zoomed, kWorld, 10, 60, "factor", 0.6, 0.85},
    {FaultKind::resected, kWorld, 0, 0, "aside_mm", -40, 40},
};

constexpr DrawnFault kDrawnOfPrograms[] = {
    {FaultKind::link_cut, kProgram, 0, 0},
    {FaultKind::appliance_restart, kProgram, 1, 10},
    {FaultKind::window_restart, kProgram, 1, 10},
};

constexpr DrawnFault kDrawnDelays[] = {
    {FaultKind::link_late, kProgram, 1, 20, "ms", 20, 3000},
    {FaultKind::window_stalls, kProgram, 0.1, 6},
};

constexpr DrawnFault kDrawnTilts[] = {{FaultKind::bed_tilted, kWorld, 10, 90, "deg", -15, 15}};

constexpr DrawnFault kDrawnSlips[] = {{FaultKind::reference_moved, kWorld, 10, 60, "mm", 10, 60}};

constexpr DrawnFault kDrawnOfScopes[] = {{FaultKind::scope_exchanged, kProgram, 2, 20}};

constexpr DrawnFault kDrawnOfAppliance[] = {{FaultKind::appliance_power_cut, kProgram, 2, 20}};

// A later disk would hold an appliance that is ended for as long as it waits at most.
constexpr DrawnFault kDrawnOfApplianceDisk[] = {
    {FaultKind::appliance_disk_late, kProgram, 5, 20, "ms", 10, 400},
    {FaultKind::appliance_disk_full, kProgram, 5, 60},
};

constexpr DrawnFault kDrawnOfDisk[] = {
    {FaultKind::disk_late, kProgram, 5, 20, "ms", 10, 1500},
    {FaultKind::disk_full, kProgram, 5, 60},
    {FaultKind::power_cut, kProgram, 10, 60, "after_syncs", 0, 8},
};

Fault usual(FaultKind kind) {
  Fault fault;
  fault.kind = kind;
  for (const ParameterSpec& parameter : fault_spec(fault_name(kind))->parameters)
    fault.values.emplace(parameter.name, parameter.usual);
  return fault;
}

/// Until a frame is hit, of those that each are with the fault's chance.
double strikes_within_s(const Fault& fault) {
  constexpr double kNever = 1e-6, kMostChance = 0.99;
  return std::log(kNever) / std::log1p(-std::min(fault.value("chance"), kMostChance)) / kVideo_hz;
}

FaultSigns of_camera(const Fault& fault) {
  switch (fault.kind) {
    case FaultKind::drop_frames:
    case FaultKind::sequence_gap:
      return {.counters = {"frames_dropped"}};
    case FaultKind::duplicate_frames:
      return {.counters = {"frames_repeated"}};
    case FaultKind::size_change:
      return {.half_size = true};
    case FaultKind::silence:
      return {.words = {"sends no"}};
    case FaultKind::late_frames:
      return {};  // each frame says when it arrived
    case FaultKind::clock_step:
      return {.counters = {"clock_events"}, .extra_s = std::abs(fault.value("ms")) * 1e-3};
    case FaultKind::garbage:
    case FaultKind::torn_frame:
      return {.words = {"is not a frame"}, .strikes_within_s = strikes_within_s(fault)};
    default:
      return {.words = {"the camera has gone", "no camera listens"}};
  }
}

constexpr double kFlockStarts_s = 1.5;  // the waits that a flock needs from its first answer to its first record

}  // namespace

double takes_s(const Fault& fault) {
  return fault.values.contains("over_s") ? fault.value("over_s") : 0;
}

bool starts_appliance(FaultKind kind) {
  return kind == FaultKind::appliance_restart || kind == FaultKind::scope_exchanged ||
         kind == FaultKind::appliance_power_cut;
}

namespace {

FaultSigns of_program(const Fault& fault) {
  if (fault.kind == FaultKind::disk_full || fault.kind == FaultKind::appliance_disk_full) return {.aside = true};
  // A program that is ended waits for it.
  if (fault.kind == FaultKind::disk_late || fault.kind == FaultKind::appliance_disk_late) return {};
  constexpr double kConnects_s = 1.1;  // the window tries each second
  if (fault.kind == FaultKind::link_late) return {.own_s = kConnects_s + fault.value("ms") * 1e-3};
  return {.own_s = kConnects_s + (starts_appliance(fault.kind) ? kFlockStarts_s : 0)};
}

}  // namespace

FaultSigns signs_of(const Fault& fault, FaultTarget target) {
  if (target == FaultTarget::camera) return of_camera(fault);
  if (target == FaultTarget::program) return of_program(fault);
  switch (fault.kind) {
    case FaultKind::line_noise:
    case FaultKind::corrupt_byte:
      return {.counters = {"doubted", "phase_errors"}, .extra_mm = kUnseenChange_mm};
    case FaultKind::lost_record:
      return {.counters = {"clock_events", "measurements_lost"}};
    case FaultKind::zero_matrix:
    case FaultKind::saturated:
      return {.words = {"saturated"}};
    case FaultKind::frozen_pose:
      return {.words = {"frozen"}};
    case FaultKind::hemisphere_flip:
      return {.words = {"hemisphere"}};
    case FaultKind::metal_distortion:
      return {.lies = true};
    case FaultKind::clock_step:
      return {.counters = {"clock_events"}, .extra_s = std::abs(fault.value("ms")) * 1e-3};
    case FaultKind::drift_step:
      return {};  // the clock's line may follow the new rate unsaid; how far off poses are then is for the law of poses
    case FaultKind::stuck_stream:
      return {.words = {"silent"}, .own_s = kFlockStarts_s};
    case FaultKind::unplug:
      return {.words = {"is not there", "the line is gone"}, .own_s = kFlockStarts_s};
    case FaultKind::power_cycle:
      return {.words = {"silent"}, .own_s = fault.value("boot_s") + kFlockStarts_s};
    default:
      return {.counters = {"phase_errors"}, .shifts_bytes = true};
  }
}

namespace {

/// Draws faults of these kinds one after another, between_s apart on average, and gives each to take. All of it follows
/// from the seed.
void draw(std::span<const DrawnFault> kinds, std::uint64_t seed, double between_s, double from_s, double until_s,
          const std::function<void(const DrawnFault&, Fault)>& take) {
  std::uint64_t key = 0;
  const auto uniform = [&](double least, double most) { return least + (most - least) * hashed_uniform(seed, key++); };
  double at_s = from_s;
  for (;;) {
    at_s += -between_s * std::log(1 - uniform(0, 1));
    const DrawnFault& drawn = kinds[static_cast<std::size_t>(uniform(0, static_cast<double>(kinds.size())))];
    const double lasts_s = uniform(drawn.least_s, drawn.most_s), value = uniform(drawn.least, drawn.most);
    if (at_s + lasts_s > until_s) return;
    Fault fault = usual(drawn.kind);
    fault.at_s = std::round(at_s * 1e3) / 1e3;
    if (drawn.most_s > 0) fault.for_s = std::round(lasts_s * 1e3) / 1e3;
    if (*drawn.parameter != 0) fault.values.insert_or_assign(drawn.parameter, std::round(value * 1e3) / 1e3);
    take(drawn, std::move(fault));
  }
}

std::vector<Fault> all_drawn(std::span<const DrawnFault> kinds, std::uint64_t seed, double between_s, double from_s,
                             double until_s) {
  std::vector<Fault> faults;
  draw(kinds, seed, between_s, from_s, until_s,
       [&](const DrawnFault&, Fault fault) { faults.push_back(std::move(fault)); });
  return faults;
}

}  // namespace

FaultScript draw_faults(std::uint64_t seed, double from_s, double until_s, bool reference) {
  FaultScript script;
  draw(kDrawn, hashed_word(seed, 3), 20, from_s, until_s, [&](const DrawnFault& drawn, Fault fault) {
    if (drawn.of == kWorld && !reference) return;
    script.of(drawn.of).push_back(std::move(fault));
  });
  return script;
}

namespace {

void draw_in_view(std::span<const DrawnFault> kinds, std::uint64_t seed, double between_s, double from_s,
                  double until_s, FaultScript& befalls) {
  constexpr double kApart_s = 6;  // the video is back after another fault, and has shown that it goes with the poses
  const auto hides = [](const Fault& other, double at_s) {
    return at_s > other.at_s - kApart_s && at_s < other.at_s + other.for_s.value_or(0) + kApart_s;
  };
  const auto is_seen = [&](double at_s) {
    return std::ranges::none_of(kFaultTargets, [&](FaultTarget target) {
      return std::ranges::any_of(befalls.of(target), [&](const Fault& other) { return hides(other, at_s); });
    });
  };
  draw(kinds, seed, between_s, from_s, until_s, [&](const DrawnFault& drawn, Fault fault) {
    const bool seen = is_seen(fault.at_s) && is_seen(fault.at_s + fault.for_s.value_or(0));
    if (seen) befalls.of(drawn.of).push_back(std::move(fault));
  });
}

}  // namespace

void draw_bumps_in_view(std::uint64_t seed, double from_s, double until_s, FaultScript& befalls) {
  draw_in_view(kDrawnInView, hashed_word(seed, 11), 60, from_s, until_s, befalls);
}

void draw_scope_faults_in_view(std::uint64_t seed, double from_s, double until_s, FaultScript& befalls) {
  draw_in_view(kDrawnOfScopeInView, hashed_word(seed, 16), 90, from_s, until_s, befalls);
}

std::vector<Fault> draw_program_faults(std::uint64_t seed, double from_s, double until_s) {
  return all_drawn(kDrawnOfPrograms, hashed_word(seed, 6), 90, from_s, until_s);
}

std::vector<Fault> draw_scope_exchanges(std::uint64_t seed, double from_s, double until_s) {
  return all_drawn(kDrawnOfScopes, hashed_word(seed, 12), 300, from_s, until_s);
}

std::vector<Fault> draw_appliance_power_cuts(std::uint64_t seed, double from_s, double until_s) {
  return all_drawn(kDrawnOfAppliance, hashed_word(seed, 17), 200, from_s, until_s);
}

std::vector<Fault> draw_appliance_disk_faults(std::uint64_t seed, double from_s, double until_s) {
  return all_drawn(kDrawnOfApplianceDisk, hashed_word(seed, 20), 150, from_s, until_s);
}

std::vector<Fault> draw_delays(std::uint64_t seed, double from_s, double until_s) {
  return all_drawn(kDrawnDelays, hashed_word(seed, 14), 100, from_s, until_s);
}

std::vector<Fault> draw_tilts(std::uint64_t seed, double from_s, double until_s) {
  return all_drawn(kDrawnTilts, hashed_word(seed, 15), 200, from_s, until_s);
}

std::vector<Fault> draw_slips(std::uint64_t seed, double from_s, double until_s) {
  return all_drawn(kDrawnSlips, hashed_word(seed, 21), 250, from_s, until_s);
}

std::vector<Fault> draw_disk_faults(std::uint64_t seed, double from_s, double until_s) {
  std::vector<Fault> faults = all_drawn(kDrawnOfDisk, hashed_word(seed, 9), 120, from_s, until_s);
  for (Fault& fault : faults) {
    if (fault.kind != FaultKind::power_cut) continue;
    double& after_syncs = fault.values.find("after_syncs")->second;
    after_syncs = std::floor(after_syncs);
  }
  return faults;
}

std::string text_of(const FaultScript& script) {
  std::string text;
  for (const FaultTarget target : kFaultTargets) {
    for (const Fault& fault : script.of(target)) {
      text += fmt::format("[[fault]]\nname = \"{}\"\n", fault_name(fault.kind));
      if (target == kTracker || target == kCamera) text += fmt::format("of = \"{}\"\n", target_name(target));
      text += fmt::format("at_s = {}\n", fault.at_s);
      if (fault.for_s) text += fmt::format("for_s = {}\n", *fault.for_s);
      for (const auto& [name, value] : fault.values) text += fmt::format("{} = {}\n", name, value);
      text += '\n';
    }
  }
  return text;
}

}  // namespace birdseye::hw_sim
