#pragma once

#include <nlohmann/json.hpp>

#include "device/wire/packet.hpp"

/// The JSON inside the wire's STRINGs. Reading throws nlohmann::json::exception where a value is not what it should be.
namespace birdseye::wire {

void to_json(nlohmann::json& json, const FrameInfo& info);
void from_json(const nlohmann::json& json, FrameInfo& info);
void to_json(nlohmann::json& json, const ClockChange& change);
void from_json(const nlohmann::json& json, ClockChange& change);
void to_json(nlohmann::json& json, const Doubt& doubt);
void from_json(const nlohmann::json& json, Doubt& doubt);
void to_json(nlohmann::json& json, const Pedal& pedal);
void from_json(const nlohmann::json& json, Pedal& pedal);
void to_json(nlohmann::json& json, const ClockPong& pong);
void from_json(const nlohmann::json& json, ClockPong& pong);

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ClockPing, host_sent_ns)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Subscription, frames, tracking)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CameraLock, on)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CameraControls, locked, done, refused)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(InstrumentHealth, name, state, text, times_lost, identity)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Calibration, in_force, why_not, record)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WallClock, known, synchronised, tai_known, max_error_ns, est_error_ns,
                                   wall_minus_monotonic_ns, source)
// Counters that an older appliance does not have are 0.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(
    Health, state, instruments, tracker_rate_hz, frame_rate_hz, measurements, measurements_lost, phase_errors,
    senseless_records, doubted, line_errors, clock_events, frames, frames_dropped, frames_repeated, messages_shed,
    clients, clients_shed, requests_refused, events_dropped, tracker_drift_ppm, camera_drift_ppm, tracker_time_sigma_ms,
    latency_ms_p99_tracker, latency_ms_p99_tracker_beside_frames, latency_ms_p99_frame, clock, recording)

}  // namespace birdseye::wire
