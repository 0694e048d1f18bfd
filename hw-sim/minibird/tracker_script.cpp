#include "hw-sim/minibird/tracker_script.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/minibird/byte_faults.hpp"

namespace birdseye::hw_sim {

namespace {

/// Two birds share a measurement's sixteen draws; each further pair has a seed of its own.
BirdPose noisy(const BirdPose& pose, const BirdNoise& noise, std::uint64_t seed, std::int64_t cycle, std::size_t bird) {
  const std::uint64_t own = seed + 51 + 1000 * (bird / 2);
  const std::uint64_t key = static_cast<std::uint64_t>(cycle) * 16 + 8 * (bird % 2);
  const auto normal3 = [&](std::uint64_t first) {
    return Eigen::Vector3d(hashed_normal(own, key + first), hashed_normal(own, key + first + 1),
                           hashed_normal(own, key + first + 2));
  };
  return {pose.rotation * rotation_exp(noise.angle_deg * kRadPerDeg * normal3(3)),
          pose.position_mm + noise.position_mm * normal3(0)};
}

}  // namespace

TrackerScript::TrackerScript(const TrackerSettings& settings, BirdMotion motion, std::int64_t start_ns)
    : settings_(settings),
      motion_(std::move(motion)),
      unit_(settings.unit),
      faults_(settings.faults, FaultTarget::tracker),
      boots_until_ns_(start_ns + static_cast<std::int64_t>(settings.boot_ms * kNsPerMs)) {
  if (settings_.distortion_mm > 0) room_.emplace(settings_.distortion_mm, settings_.seed);
  rebase(start_ns);
}

double TrackerScript::rate_hz() const {
  const Fault* const drift = faults_.active(FaultKind::drift_step);
  const double ppm = settings_.drift_ppm + (drift != nullptr ? drift->value("ppm") : 0);
  return unit_.rate_hz() * (1 + 1e-6 * ppm);
}

void TrackerScript::rebase(std::int64_t measured_ns) {
  base_ns_ = measured_ns;
  since_base_ = 0;
  period_ns_ = kNsPerSecond / rate_hz();
}

std::int64_t TrackerScript::next_measurement_ns() const {
  return base_ns_ + std::llround(static_cast<double>(since_base_ + 1) * period_ns_);
}

bool TrackerScript::silent(std::int64_t now_ns) const {
  return held_in_reset_ || !powered_ || now_ns < boots_until_ns_;
}

void TrackerScript::receive(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  if (silent(now_ns)) return;
  faults_.advance(now_ns);
  for (const std::uint8_t byte : bytes) {
    std::vector<std::uint8_t> reply = unit_.receive(byte);
    if (reply.empty() || faults_.active(FaultKind::stuck_stream) != nullptr) continue;
    const auto wire_ns = static_cast<std::int64_t>(10e9 / settings_.baud * static_cast<double>(reply.size()));
    enqueue({now_ns + wire_ns, std::move(reply)});
  }
  if (unit_.streaming() && settings_.faults_from_streaming) faults_.begin(now_ns);
}

void TrackerScript::set_reset(bool asserted, std::int64_t now_ns) {
  if (asserted == held_in_reset_) return;
  held_in_reset_ = asserted;
  unit_.reset();
  pending_.clear();
  boots_until_ns_ = now_ns + static_cast<std::int64_t>(settings_.boot_ms * kNsPerMs);
}

/// A power cycle ends in a boot; while it lasts the unit is off.
void TrackerScript::apply_power(std::int64_t now_ns) {
  const Fault* const off = faults_.active(FaultKind::power_cycle);
  if (off != nullptr && powered_) {
    powered_ = false;
    unit_.reset();
    pending_.clear();
    const double dark_s = off->for_s.value_or(0) + off->value("boot_s");
    boots_until_ns_ = now_ns + static_cast<std::int64_t>(dark_s * kNsPerSecond);
  }
  if (off == nullptr) powered_ = true;
}

std::vector<BirdPose> TrackerScript::measured_poses(std::int64_t measured_ns) {
  const Fault* const metal = faults_.active(FaultKind::metal_distortion);
  if (metal == nullptr) metal_.reset();
  if (metal != nullptr && !metal_) metal_.emplace(metal->value("peak_mm"), settings_.seed + 1);
  const bool frozen = faults_.active(FaultKind::frozen_pose) != nullptr;
  if (frozen && !frozen_.empty()) return frozen_;
  std::vector<BirdPose> poses;
  for (std::size_t bird = 0; bird < static_cast<std::size_t>(unit_.birds()); ++bird) {
    BirdPose pose = motion_(bird, measured_ns);
    if (room_) pose = room_->apply(pose);
    if (metal_) pose = metal_->apply(pose);
    poses.push_back(noisy(pose, settings_.noise, settings_.seed, cycle_, bird));
  }
  frozen_ = frozen ? poses : std::vector<BirdPose>{};
  return poses;
}

void TrackerScript::disturb_bytes(Delivery& delivery, std::int64_t now_ns) {
  const auto hits = [&](FaultKind kind) {
    const Fault* const fault = faults_.active(kind);
    if (fault == nullptr) return false;
    if (!fault->for_s) {
      faults_.done(kind, now_ns);
      return true;
    }
    const auto key = static_cast<std::uint64_t>(cycle_) * 32 + static_cast<std::uint64_t>(kind);
    return hashed_uniform(settings_.seed + 113, key) < fault->value("chance");
  };
  for (const FaultKind kind : {FaultKind::drop_byte, FaultKind::duplicate_byte, FaultKind::corrupt_byte,
                               FaultKind::wrong_phase_bit, FaultKind::line_noise}) {
    if (!hits(kind)) continue;
    const auto key = static_cast<std::uint64_t>(cycle_) * 32 + static_cast<std::uint64_t>(kind);
    delivery.bytes = disturbed(kind, delivery.bytes, settings_.seed, key);
    delivery.line_error = delivery.line_error || kind == FaultKind::line_noise;
  }
  if (hits(FaultKind::lost_record) || faults_.active(FaultKind::stuck_stream) != nullptr) delivery.bytes.clear();
}

void TrackerScript::measure(std::int64_t measured_ns) {
  ++cycle_;
  ++since_base_;
  const double half_period_ns = 0.5 * period_ns_;
  if (align_ns_ && static_cast<double>(measured_ns) + half_period_ns > static_cast<double>(*align_ns_)) {
    measured_ns = *align_ns_;
    rebase(measured_ns);
    cycle_ = 0;
    if (!settings_.faults_from_streaming) faults_.begin(measured_ns);
    align_ns_.reset();
  }
  faults_.advance(measured_ns);
  apply_power(measured_ns);
  const bool saturated = faults_.active(FaultKind::saturated) != nullptr;
  if (saturated && !was_saturated_) unit_.latch_error(32);
  was_saturated_ = saturated;
  unit_.disturb({faults_.active(FaultKind::hemisphere_flip) != nullptr,
                 saturated || faults_.active(FaultKind::zero_matrix) != nullptr});
  const std::vector<BirdPose> poses = measured_poses(measured_ns);
  if (!silent(measured_ns)) {
    Delivery delivery{0, unit_.measure(poses)};
    const Fault* const step = faults_.active(FaultKind::clock_step);
    const double delay_ms = settings_.delay_ms + (step != nullptr ? step->value("ms") : 0);
    const std::int64_t ready_ns = measured_ns + static_cast<std::int64_t>(delay_ms * kNsPerMs);
    const double wire_ns = 10e9 / settings_.baud * static_cast<double>(delivery.bytes.size());
    wire_free_ns_ = std::max(ready_ns, wire_free_ns_) + static_cast<std::int64_t>(wire_ns);
    const double late = -std::log1p(-hashed_uniform(settings_.seed + 114, static_cast<std::uint64_t>(cycle_)));
    delivery.due_ns = wire_free_ns_ + static_cast<std::int64_t>(std::min(late, 4.0) * settings_.jitter_ms * kNsPerMs);
    if (!delivery.bytes.empty()) {
      disturb_bytes(delivery, measured_ns);
      enqueue(std::move(delivery));
    }
  }
  if (std::abs(period_ns_ - kNsPerSecond / rate_hz()) > 0) rebase(measured_ns);
}

void TrackerScript::enqueue(Delivery delivery) {
  if (delivery.bytes.empty()) return;
  if (!pending_.empty()) delivery.due_ns = std::max(delivery.due_ns, pending_.back().due_ns);
  pending_.push_back(std::move(delivery));
}

std::vector<Delivery> TrackerScript::advance(std::int64_t now_ns) {
  while (next_measurement_ns() <= now_ns) measure(next_measurement_ns());
  faults_.advance(now_ns);
  apply_power(now_ns);
  std::vector<Delivery> out;
  while (!pending_.empty() && pending_.front().due_ns <= now_ns) {
    out.push_back(std::move(pending_.front()));
    pending_.pop_front();
  }
  return out;
}

std::int64_t TrackerScript::next_ns() const {
  std::int64_t next = next_measurement_ns();
  if (!pending_.empty()) next = std::min(next, pending_.front().due_ns);
  if (const auto change = faults_.next_change_ns()) next = std::min(next, *change);
  return next;
}

}  // namespace birdseye::hw_sim
