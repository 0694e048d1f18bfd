#include "hw-sim/world/happenings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "hw-sim/world/ease.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

template <typename Frame>
Transform<Frame, Frame> about(const Vector3d& pivot_mm, const Vector3d& turn, const Vector3d& shift_mm) {
  const Eigen::Matrix3d rotation = rotation_exp(turn);
  return {rotation, Vector3d(pivot_mm - rotation * pivot_mm + shift_mm)};
}

}  // namespace

Happenings::Happenings(std::vector<Fault> faults) {
  for (Fault& fault : faults) {
    const double over_s = fault.values.contains("over_s") ? fault.value("over_s") : 0;
    faults_.push_back({std::move(fault), over_s});
  }
}

/// 0 before it, 1 while it holds, between them while it comes and goes.
double Happenings::share(const Timed& timed, double world_s) {
  const auto& [fault, over_s] = timed;
  if (world_s < fault.at_s) return 0;
  const auto come = [world_s, over_s = over_s](double at_s) {
    if (over_s > 0) return ease((world_s - at_s) / over_s);
    return world_s >= at_s ? 1.0 : 0.0;
  };
  return come(fault.at_s) - (fault.for_s ? come(fault.at_s + *fault.for_s) : 0);
}

template <typename Visit>
void Happenings::each(FaultKind kind, double world_s, const Visit& visit) const {
  for (const Timed& timed : faults_) {
    if (timed.fault.kind != kind) continue;
    if (const double now = share(timed, world_s); now > 0) visit(timed.fault, now);
  }
}

Transform<Tracker, Tracker> Happenings::transmitter(double world_s) const {
  Transform<Tracker, Tracker> now_from_before;
  each(FaultKind::transmitter_bumped, world_s, [&](const Fault& fault, double share) {
    now_from_before = about<Tracker>(Vector3d::Zero(), share * fault.value("deg") * kRadPerDeg * Vector3d(0.6, 0, 0.8),
                                     share * fault.value("mm") * Vector3d(0.36, 0.8, -0.48)) *
                      now_from_before;
  });
  return now_from_before;
}

Transform<Patient, Patient> Happenings::table(double world_s, const Vector3d& pivot_mm) const {
  double turn_deg = 0;
  each(FaultKind::bed_tilted, world_s,
       [&](const Fault& fault, double share) { turn_deg += share * fault.value("deg"); });
  if (turn_deg == 0) return {};
  return about<Patient>(pivot_mm, turn_deg * kRadPerDeg * Vector3d::UnitZ(), Vector3d::Zero());
}

Transform<Patient, Patient> Happenings::patient(double world_s, const Vector3d& pivot_mm) const {
  Transform<Patient, Patient> now_from_before;
  each(FaultKind::patient_moved, world_s, [&](const Fault& fault, double share) {
    now_from_before = about<Patient>(pivot_mm, share * fault.value("deg") * kRadPerDeg * Vector3d::UnitY(),
                                     share * fault.value("mm") * Vector3d(0.28, 0, -0.96)) *
                      now_from_before;
  });
  return now_from_before;
}

Transform<Sensor, Sensor> Happenings::reference(double world_s) const {
  Transform<Sensor, Sensor> now_from_before;
  each(FaultKind::reference_moved, world_s, [&](const Fault& fault, double share) {
    now_from_before = about<Sensor>(Vector3d::Zero(), share * fault.value("deg") * kRadPerDeg * Vector3d(0, 0.8, 0.6),
                                    share * fault.value("mm") * Vector3d(0.8, 0, -0.6)) *
                      now_from_before;
  });
  return now_from_before;
}

Vector3d Happenings::breath_mm(double world_s) const {
  constexpr double kFadeS = 1;  // where it is held for good
  Vector3d moved_mm = Vector3d::Zero();
  each(FaultKind::breathing, world_s, [&](const Fault& fault, double /*share*/) {
    const double since_s = world_s - fault.at_s;
    const double fade = fault.for_s ? ease((*fault.for_s - since_s) / kFadeS) : 1;
    const double full = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * since_s / fault.value("period_s"));
    // Breathing in, the diaphragm presses the liver towards the feet, and a little forward.
    moved_mm += fade * full * fault.value("mm") * Vector3d(0, -0.28, -0.96);
  });
  return moved_mm;
}

std::optional<Hollow> Happenings::hollow(double world_s, const Vector3d& face_mm, const Vector3d& outward,
                                         const Vector3d& right) const {
  std::optional<Hollow> found;
  each(FaultKind::resected, world_s, [&](const Fault& fault, double share) {
    if (!found)
      found = Hollow{.axis_mm = face_mm + fault.value("aside_mm") * right,
                     .outward = outward,
                     .width_mm = fault.value("width_mm"),
                     .depth_mm = share * fault.value("depth_mm")};
  });
  return found;
}

double Happenings::zoom(double world_s) const {
  double factor = 1;
  each(FaultKind::lens_zoomed, world_s,
       [&](const Fault& fault, double share) { factor *= std::pow(fault.value("factor"), share); });
  return factor;
}

Transform<Camera, Camera> Happenings::scope(double world_s) const {
  double turn_deg = 0;
  each(FaultKind::scope_turned, world_s,
       [&](const Fault& fault, double share) { turn_deg += share * fault.value("deg"); });
  if (turn_deg == 0) return {};
  return about<Camera>(Vector3d::Zero(), turn_deg * kRadPerDeg * Vector3d::UnitZ(), Vector3d::Zero());
}

}  // namespace birdseye::hw_sim
