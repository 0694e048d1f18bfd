#include "device/wire/json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <type_traits>
#include <utility>
#include <vector>

#include "calibration/geometry/rigid_matrix.hpp"

namespace birdseye::wire {

using nlohmann::json;

template <typename Whole>
void get_whole(const json& in, Whole& out) {
  if (!in.is_number_integer()) throw json::type_error::create(302, "a whole number is wanted", &in);
  out = in.get<Whole>();
}

template void get_whole(const json& in, int& out);
template void get_whole(const json& in, std::int64_t& out);
template void get_whole(const json& in, std::uint64_t& out);

namespace {

bool is_near(std::int64_t ns) {
  return ns >= -kFarthest_ns && ns <= kFarthest_ns;
}

}  // namespace

void get_time(const json& in, std::int64_t& ns) {
  get_whole(in, ns);
  if (!is_near(ns)) throw json::out_of_range::create(406, "a time within 73 years of zero is wanted", &in);
}

namespace {

[[noreturn]] void refuse_negative(const json& in) {
  throw json::out_of_range::create(406, "a finite value that is not below zero is wanted", &in);
}

/// Of what is never below zero. A sigma that is would switch off whatever asks whether it is too large.
void get_not_negative(const json& in, double& value) {
  in.get_to(value);
  if (!std::isfinite(value) || value < 0) refuse_negative(in);
}

void get_not_negative(const json& in, std::int64_t& ns) {
  get_time(in, ns);
  if (ns < 0) refuse_negative(in);
}

/// Gives every member, with its key, to `each`.
template <typename AnyInstrument, typename Each>
void each_of_instrument(AnyInstrument& instrument, const Each& each) {
  each("name", instrument.name);
  each("state", instrument.state);
  each("text", instrument.text);
  each("times_lost", instrument.times_lost);
  each("identity", instrument.identity);
}

template <typename AnyHealth, typename Each>
void each_of_health(AnyHealth& health, const Each& each) {
  each("state", health.state);
  each("instruments", health.instruments);
  each("tracker_rate_hz", health.tracker_rate_hz);
  each("frame_rate_hz", health.frame_rate_hz);
  each("measurements", health.measurements);
  each("measurements_lost", health.measurements_lost);
  each("phase_errors", health.phase_errors);
  each("senseless_records", health.senseless_records);
  each("doubted", health.doubted);
  each("line_errors", health.line_errors);
  each("clock_events", health.clock_events);
  each("frames", health.frames);
  each("frames_dropped", health.frames_dropped);
  each("frames_repeated", health.frames_repeated);
  each("spurious_strobe_edges", health.spurious_strobe_edges);
  each("messages_shed", health.messages_shed);
  each("clients", health.clients);
  each("clients_shed", health.clients_shed);
  each("requests_refused", health.requests_refused);
  each("events_dropped", health.events_dropped);
  each("tracker_drift_ppm", health.tracker_drift_ppm);
  each("camera_drift_ppm", health.camera_drift_ppm);
  each("tracker_time_sigma_ms", health.tracker_time_sigma_ms);
  each("latency_ms_p99_tracker", health.latency_ms_p99_tracker);
  each("latency_ms_p99_tracker_beside_frames", health.latency_ms_p99_tracker_beside_frames);
  each("latency_ms_p99_frame", health.latency_ms_p99_frame);
  each("clock", health.clock);
  each("recording", health.recording);
  each("reference", health.reference);
  each("field_unsigned", health.field_unsigned);
}

/// Leaves what is not told as it is.
template <typename Value>
void get_where_told(const json& in, const char* key, Value& value) {
  if constexpr (std::is_integral_v<Value> && !std::is_same_v<Value, bool>) {
    if (in.contains(key)) get_whole(in.at(key), value);
  } else {
    value = in.value(key, value);
  }
}

}  // namespace

std::string text_of(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

void to_json(json& out, const FrameInfo& info) {
  // Member by member: of a list of them each would be copied, and there is one with every frame.
  out = json::object();
  out["sequence"] = info.sequence;
  out["acquired_ns"] = info.acquired.ns;
  out["acquired_sigma_ns"] = info.acquired_sigma.ns;
  out["arrived_ns"] = info.arrived.ns;
  out["frames_dropped"] = info.frames_dropped;
  if (info.latency) out["latency_ns"] = info.latency->ns;
  json& pose = out["pose"];
  pose["kind"] = to_string(info.pose.kind);
  pose["reason"] = info.pose.reason;
  pose["sigma_mm"] = info.pose.position_sigma_mm;
  pose["time_sigma_ns"] = info.pose.time_sigma.ns;
  pose["speed_mm_s"] = info.pose.speed_mm_s;
  pose["age_ns"] = info.pose.age.ns;
  json& rows = pose["tracker_from_scope"];
  if (!info.pose.tracker_from_sensor) return;
  const Eigen::Matrix4d m = info.pose.tracker_from_sensor->matrix();
  std::vector<json> numbers;
  numbers.reserve(16);
  for (int i = 0; i < 16; ++i) numbers.emplace_back(m(i / 4, i % 4));
  rows = std::move(numbers);
}

void from_json(const json& in, FrameInfo& info) {
  get_whole(in.at("sequence"), info.sequence);
  get_time(in.at("acquired_ns"), info.acquired.ns);
  get_not_negative(in.at("acquired_sigma_ns"), info.acquired_sigma.ns);
  get_time(in.at("arrived_ns"), info.arrived.ns);
  get_whole(in.at("frames_dropped"), info.frames_dropped);
  if (in.contains("latency_ns")) get_time(in.at("latency_ns"), info.latency.emplace().ns);
  const json& pose = in.at("pose");
  const auto kind = pose.at("kind").get<std::string>();
  pose.at("reason").get_to(info.pose.reason);
  get_not_negative(pose.at("sigma_mm"), info.pose.position_sigma_mm);
  get_not_negative(pose.at("time_sigma_ns"), info.pose.time_sigma.ns);
  get_not_negative(pose.at("speed_mm_s"), info.pose.speed_mm_s);
  get_time(pose.at("age_ns"), info.pose.age.ns);
  // The newest pose lies before what is predicted from it.
  if (kind == to_string(PoseKind::predicted) && info.pose.age.ns < 0) refuse_negative(pose.at("age_ns"));
  const json& matrix = pose.at("tracker_from_scope");
  for (const PoseKind known : {PoseKind::exact, PoseKind::interpolated, PoseKind::predicted}) {
    if (kind != to_string(known) || matrix.size() != 16) continue;
    Eigen::Matrix4d m;
    for (int i = 0; i < 16; ++i) m(i / 4, i % 4) = matrix[static_cast<std::size_t>(i)].get<double>();
    // A pose that is no pose is refused here, whoever sent it: nothing downstream may draw by it.
    if (!is_rigid(m, 1e-6)) break;
    info.pose.kind = known;
    info.pose.tracker_from_sensor = Transform<Tracker, Sensor>::from_matrix(m);
  }
}

void to_json(json& out, const Doubt& doubt) {
  out = {{"acquired_ns", doubt.acquired.ns}, {"bird", doubt.bird}, {"why", doubt.why}};
}
void from_json(const json& in, Doubt& doubt) {
  get_time(in.at("acquired_ns"), doubt.acquired.ns);
  in.at("bird").get_to(doubt.bird);
  in.at("why").get_to(doubt.why);
}

void to_json(json& out, const ClockChange& change) {
  out = {{"at_ns", change.at.ns},
         {"clock", change.clock},
         {"kind", change.kind},
         {"by_ns", change.by.ns},
         {"by_ppm", change.by_ppm}};
}
void from_json(const json& in, ClockChange& change) {
  get_time(in.at("at_ns"), change.at.ns);
  in.at("clock").get_to(change.clock);
  in.at("kind").get_to(change.kind);
  get_time(in.at("by_ns"), change.by.ns);
  in.at("by_ppm").get_to(change.by_ppm);
}

void to_json(json& out, const Pedal& pedal) {
  out = {{"pressed", pedal.pressed}, {"at_ns", pedal.at.ns}};
}
void from_json(const json& in, Pedal& pedal) {
  in.at("pressed").get_to(pedal.pressed);
  get_time(in.at("at_ns"), pedal.at.ns);
}

void to_json(json& out, const ClockPing& ping) {
  out = {{"host_sent_ns", ping.host_sent_ns}};
}
void from_json(const json& in, ClockPing& ping) {
  get_time(in.at("host_sent_ns"), ping.host_sent_ns);
}

void to_json(json& out, const ClockPong& pong) {
  out = {
      {"host_sent_ns", pong.host_sent_ns}, {"device_received_ns", pong.received.ns}, {"device_sent_ns", pong.sent.ns}};
}
void from_json(const json& in, ClockPong& pong) {
  get_time(in.at("host_sent_ns"), pong.host_sent_ns);
  get_time(in.at("device_received_ns"), pong.received.ns);
  get_time(in.at("device_sent_ns"), pong.sent.ns);
}

void to_json(json& out, const Subscription& subscription) {
  out = {{"frames", subscription.frames}, {"tracking", subscription.tracking}};
}
void from_json(const json& in, Subscription& subscription) {
  in.at("frames").get_to(subscription.frames);
  in.at("tracking").get_to(subscription.tracking);
}

void to_json(json& out, const CameraLock& lock) {
  out = {{"on", lock.on}};
}
void from_json(const json& in, CameraLock& lock) {
  in.at("on").get_to(lock.on);
}

void to_json(json& out, const CameraControls& controls) {
  out = {{"locked", controls.locked}, {"done", controls.done}, {"refused", controls.refused}};
}
void from_json(const json& in, CameraControls& controls) {
  in.at("locked").get_to(controls.locked);
  in.at("done").get_to(controls.done);
  in.at("refused").get_to(controls.refused);
}

void to_json(json& out, const Calibration& calibration) {
  out = {{"in_force", calibration.in_force}, {"why_not", calibration.why_not}, {"record", calibration.record}};
}
void from_json(const json& in, Calibration& calibration) {
  in.at("in_force").get_to(calibration.in_force);
  in.at("why_not").get_to(calibration.why_not);
  in.at("record").get_to(calibration.record);
}

void to_json(json& out, const WallClock& clock) {
  out = {{"known", clock.known},
         {"synchronised", clock.synchronised},
         {"tai_known", clock.tai_known},
         {"max_error_ns", clock.max_error_ns},
         {"est_error_ns", clock.est_error_ns},
         {"wall_minus_monotonic_ns", clock.wall_minus_monotonic_ns},
         {"source", clock.source}};
}
void from_json(const json& in, WallClock& clock) {
  in.at("known").get_to(clock.known);
  in.at("synchronised").get_to(clock.synchronised);
  in.at("tai_known").get_to(clock.tai_known);
  get_not_negative(in.at("max_error_ns"), clock.max_error_ns);
  get_not_negative(in.at("est_error_ns"), clock.est_error_ns);
  get_whole(in.at("wall_minus_monotonic_ns"), clock.wall_minus_monotonic_ns);
  // A wall clock that was set to a year far away is not known; the rest of the message is sound.
  if (!is_near(clock.wall_minus_monotonic_ns)) {
    clock.known = clock.synchronised = clock.tai_known = false;
    clock.wall_minus_monotonic_ns = 0;
  }
  in.at("source").get_to(clock.source);
}

void to_json(json& out, const InstrumentHealth& instrument) {
  each_of_instrument(instrument, [&](const char* key, const auto& value) { out[key] = value; });
}
void from_json(const json& in, InstrumentHealth& instrument) {
  instrument = InstrumentHealth();
  each_of_instrument(instrument, [&](const char* key, auto& value) { get_where_told(in, key, value); });
}

void to_json(json& out, const Health& health) {
  each_of_health(health, [&](const char* key, const auto& value) { out[key] = value; });
}
void from_json(const json& in, Health& health) {
  health = Health();
  each_of_health(health, [&](const char* key, auto& value) { get_where_told(in, key, value); });
}

}  // namespace birdseye::wire
