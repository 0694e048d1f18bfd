#include "hw-sim/video/camera_script.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"
#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr std::int64_t kStampSigmaNs = 100'000;

std::vector<Fault> some_of(const std::vector<Fault>& faults, bool of_the_plug) {
  std::vector<Fault> some;
  for (const Fault& fault : faults) {
    if ((fault.kind == FaultKind::unplug) == of_the_plug) some.push_back(fault);
  }
  return some;
}

}  // namespace

CameraScript::CameraScript(const CameraTiming& timing, std::int64_t zero_ns)
    : timing_(timing),
      zero_ns_(zero_ns),
      rate_hz_(timing.rate_hz * (1 + 1e-6 * timing.drift_ppm)),
      faults_(some_of(timing.faults, false), FaultTarget::camera),
      plug_(some_of(timing.faults, true), FaultTarget::camera) {}

void CameraScript::watched(std::int64_t now_ns) {
  faults_.begin(now_ns);
  plug_.begin(now_ns);
}

std::vector<FaultEvent> CameraScript::take_events() {
  auto events = faults_.take_events();
  for (const FaultEvent& event : plug_.take_events()) events.push_back(event);
  return events;
}

bool CameraScript::hits(FaultKind kind, std::int64_t now_ns) {
  const Fault* const fault = faults_.active(kind);
  if (fault == nullptr) return false;
  if (!fault->for_s) {
    faults_.done(kind, now_ns);
    return true;
  }
  return hashed_uniform(timing_.seed + 121, number_ * 32 + static_cast<std::uint64_t>(kind)) < fault->value("chance");
}

void CameraScript::apply_faults(FramePlan& plan) {
  const std::int64_t now_ns = plan.exposed_ns;
  if (const Fault* const gap = faults_.active(FaultKind::sequence_gap)) {
    const auto frames = static_cast<std::uint64_t>(gap->value("frames"));
    if (hits(FaultKind::sequence_gap, now_ns)) skipped_in_count_ += frames;
  }
  plan.sequence = plan.number + skipped_in_count_;
  plan.lost = hits(FaultKind::drop_frames, now_ns) || faults_.active(FaultKind::silence) != nullptr;
  if (hits(FaultKind::duplicate_frames, now_ns)) plan.copies = 2;
  if (const Fault* const torn = faults_.active(FaultKind::torn_frame)) {
    const double part = torn->value("part");
    if (hits(FaultKind::torn_frame, now_ns)) plan.part = part;
  }
  if (const Fault* const garbage = faults_.active(FaultKind::garbage)) {
    const auto bytes = static_cast<std::uint64_t>(garbage->value("bytes"));
    if (hits(FaultKind::garbage, now_ns)) plan.garbage_bytes = bytes;
  }
  plan.half_size = faults_.active(FaultKind::size_change) != nullptr;
  if (const Fault* const late = faults_.active(FaultKind::late_frames)) {
    plan.due_ns += static_cast<std::int64_t>(late->value("ms") * kNsPerMs);
  }
  if (const Fault* const step = faults_.active(FaultKind::clock_step)) {
    const auto by_ns = static_cast<std::int64_t>(step->value("ms") * kNsPerMs);
    (timing_.stamps ? plan.stamp_ns : plan.due_ns) += by_ns;
  }
}

FramePlan CameraScript::next() {
  FramePlan plan;
  plan.number = number_;
  plan.exposed_ns = zero_ns_ + std::llround(static_cast<double>(number_) / rate_hz_ * kNsPerSecond);
  if (timing_.stamps) {
    plan.stamp_ns = plan.exposed_ns;
    plan.sigma_ns = kStampSigmaNs;
  }
  const double late = -std::log1p(-hashed_uniform(timing_.seed + 122, number_));
  const double after_ms = std::max(timing_.delivery_ms, timing_.exposure_ms / 2);
  plan.due_ns =
      plan.exposed_ns + static_cast<std::int64_t>((after_ms + timing_.jitter_ms * std::min(late, 4.0)) * kNsPerMs);
  faults_.advance(plan.exposed_ns);
  apply_faults(plan);
  plan.due_ns = std::max(plan.due_ns, latest_due_ns_);
  latest_due_ns_ = plan.due_ns;
  ++number_;
  return plan;
}

}  // namespace birdseye::hw_sim
