#include "device/wire/json.hpp"

namespace birdseye::wire {

using nlohmann::json;

void to_json(json& out, const FrameInfo& info) {
  json pose{{"kind", to_string(info.pose.kind)},
            {"reason", info.pose.reason},
            {"sigma_mm", info.pose.position_sigma_mm},
            {"time_sigma_ns", info.pose.time_sigma.ns},
            {"speed_mm_s", info.pose.speed_mm_s},
            {"age_ns", info.pose.age.ns},
            {"tracker_from_scope", nullptr}};
  if (info.pose.tracker_from_sensor) {
    const Eigen::Matrix4d m = info.pose.tracker_from_sensor->matrix();
    json rows = json::array();
    for (int i = 0; i < 16; ++i) rows.push_back(m(i / 4, i % 4));
    pose["tracker_from_scope"] = rows;
  }
  out = {{"sequence", info.sequence},
         {"acquired_ns", info.acquired.ns},
         {"acquired_sigma_ns", info.acquired_sigma.ns},
         {"arrived_ns", info.arrived.ns},
         {"frames_dropped", info.frames_dropped},
         {"pose", pose}};
}

void from_json(const json& in, FrameInfo& info) {
  in.at("sequence").get_to(info.sequence);
  in.at("acquired_ns").get_to(info.acquired.ns);
  in.at("acquired_sigma_ns").get_to(info.acquired_sigma.ns);
  in.at("arrived_ns").get_to(info.arrived.ns);
  in.at("frames_dropped").get_to(info.frames_dropped);
  const json& pose = in.at("pose");
  const auto kind = pose.at("kind").get<std::string>();
  pose.at("reason").get_to(info.pose.reason);
  pose.at("sigma_mm").get_to(info.pose.position_sigma_mm);
  pose.at("time_sigma_ns").get_to(info.pose.time_sigma.ns);
  pose.at("speed_mm_s").get_to(info.pose.speed_mm_s);
  pose.at("age_ns").get_to(info.pose.age.ns);
  const json& matrix = pose.at("tracker_from_scope");
  for (const PoseKind known : {PoseKind::exact, PoseKind::interpolated, PoseKind::predicted}) {
    if (kind != to_string(known) || matrix.size() != 16) continue;
    Eigen::Matrix4d m;
    for (int i = 0; i < 16; ++i) m(i / 4, i % 4) = matrix[static_cast<std::size_t>(i)].get<double>();
    // A pose that is no pose is refused here, whoever sent it: nothing downstream may draw by it.
    const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
    if (!m.allFinite() || !(r * r.transpose()).isIdentity(1e-6) || r.determinant() < 0) break;
    info.pose.kind = known;
    info.pose.tracker_from_sensor = Transform<Tracker, Sensor>::from_matrix(m);
  }
}

void to_json(json& out, const Doubt& doubt) {
  out = {{"acquired_ns", doubt.acquired.ns}, {"bird", doubt.bird}, {"why", doubt.why}};
}
void from_json(const json& in, Doubt& doubt) {
  in.at("acquired_ns").get_to(doubt.acquired.ns);
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
  in.at("at_ns").get_to(change.at.ns);
  in.at("clock").get_to(change.clock);
  in.at("kind").get_to(change.kind);
  in.at("by_ns").get_to(change.by.ns);
  in.at("by_ppm").get_to(change.by_ppm);
}

void to_json(json& out, const Pedal& pedal) {
  out = {{"pressed", pedal.pressed}, {"at_ns", pedal.at.ns}};
}
void from_json(const json& in, Pedal& pedal) {
  in.at("pressed").get_to(pedal.pressed);
  in.at("at_ns").get_to(pedal.at.ns);
}

void to_json(json& out, const ClockPong& pong) {
  out = {
      {"host_sent_ns", pong.host_sent_ns}, {"device_received_ns", pong.received.ns}, {"device_sent_ns", pong.sent.ns}};
}
void from_json(const json& in, ClockPong& pong) {
  in.at("host_sent_ns").get_to(pong.host_sent_ns);
  in.at("device_received_ns").get_to(pong.received.ns);
  in.at("device_sent_ns").get_to(pong.sent.ns);
}

}  // namespace birdseye::wire
