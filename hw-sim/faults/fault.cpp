#include "hw-sim/faults/fault.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

namespace birdseye::hw_sim {

std::string_view fault_name(FaultKind kind) {
  static constexpr std::array<std::string_view, 44> kNames{"drop_byte",
                                                           "duplicate_byte",
                                                           "corrupt_byte",
                                                           "wrong_phase_bit",
                                                           "line_noise",
                                                           "stuck_stream",
                                                           "frozen_pose",
                                                           "saturated",
                                                           "zero_matrix",
                                                           "hemisphere_flip",
                                                           "metal_distortion",
                                                           "power_cycle",
                                                           "drift_step",
                                                           "lost_record",
                                                           "unplug",
                                                           "clock_step",
                                                           "drop_frames",
                                                           "sequence_gap",
                                                           "silence",
                                                           "late_frames",
                                                           "duplicate_frames",
                                                           "garbage",
                                                           "size_change",
                                                           "torn_frame",
                                                           "transmitter_bumped",
                                                           "bed_tilted",
                                                           "patient_moved",
                                                           "reference_moved",
                                                           "breathing",
                                                           "resected",
                                                           "lens_zoomed",
                                                           "scope_turned",
                                                           "link_cut",
                                                           "appliance_restart",
                                                           "window_restart",
                                                           "scope_exchanged",
                                                           "link_late",
                                                           "window_stalls",
                                                           "disk_late",
                                                           "disk_full",
                                                           "power_cut",
                                                           "appliance_power_cut",
                                                           "appliance_disk_late",
                                                           "appliance_disk_full"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string_view target_name(FaultTarget target) {
  static constexpr std::array<std::string_view, 4> kNames{"tracker", "camera", "world", "program"};
  return kNames[static_cast<std::size_t>(target)];
}

double Fault::value(std::string_view name) const {
  const auto found = values.find(name);
  assert(found != values.end());
  return found == values.end() ? 0 : found->second;
}

FaultTimeline::FaultTimeline(std::vector<Fault> faults, FaultTarget target) : target_(target) {
  std::stable_sort(faults.begin(), faults.end(), [](const Fault& a, const Fault& b) { return a.at_s < b.at_s; });
  for (Fault& fault : faults) entries_.push_back({std::move(fault), State::waiting});
}

void FaultTimeline::begin(std::int64_t zero_ns) {
  if (!zero_ns_) zero_ns_ = zero_ns;
}

std::int64_t FaultTimeline::begins_ns(const Fault& fault) const {
  return *zero_ns_ + static_cast<std::int64_t>(fault.at_s * 1e9);
}

std::optional<std::int64_t> FaultTimeline::ends_ns(const Fault& fault) const {
  if (!fault.for_s) return std::nullopt;
  return begins_ns(fault) + static_cast<std::int64_t>(*fault.for_s * 1e9);
}

void FaultTimeline::advance(std::int64_t now_ns) {
  if (!zero_ns_) return;
  const std::size_t first = events_.size();
  for (std::size_t i = ended_; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    if (entry.state == State::waiting) {
      if (begins_ns(entry.fault) > now_ns) break;  // nor do those after it
      entry.state = State::active;
      begun_ = i + 1;
      events_.push_back({entry.fault.kind, target_, true, begins_ns(entry.fault)});
    }
    const auto ends = ends_ns(entry.fault);
    if (entry.state == State::active && ends && *ends <= now_ns) {
      entry.state = State::over;
      events_.push_back({entry.fault.kind, target_, false, *ends});
    }
  }
  while (ended_ < begun_ && entries_[ended_].state == State::over) ++ended_;
  std::stable_sort(events_.begin() + static_cast<std::ptrdiff_t>(first), events_.end(),
                   [](const FaultEvent& a, const FaultEvent& b) { return a.at_ns < b.at_ns; });
}

const Fault* FaultTimeline::active(FaultKind kind) const {
  for (std::size_t i = ended_; i < begun_; ++i) {
    const Entry& entry = entries_[i];
    if (entry.state == State::active && entry.fault.kind == kind) return &entry.fault;
  }
  return nullptr;
}

void FaultTimeline::done(FaultKind kind, std::int64_t now_ns) {
  for (std::size_t i = ended_; i < begun_; ++i) {
    Entry& entry = entries_[i];
    if (entry.state != State::active || entry.fault.kind != kind || entry.fault.for_s) continue;
    entry.state = State::over;
    events_.push_back({kind, target_, false, now_ns});
    return;
  }
}

std::optional<std::int64_t> FaultTimeline::next_change_ns() const {
  std::optional<std::int64_t> next;
  if (!zero_ns_) return next;
  if (begun_ < entries_.size()) next = begins_ns(entries_[begun_].fault);
  for (std::size_t i = ended_; i < begun_; ++i) {
    const auto ends = entries_[i].state == State::active ? ends_ns(entries_[i].fault) : std::nullopt;
    if (ends && (!next || *ends < *next)) next = ends;
  }
  return next;
}

std::vector<FaultEvent> FaultTimeline::take_events() {
  return std::exchange(events_, {});
}

}  // namespace birdseye::hw_sim
