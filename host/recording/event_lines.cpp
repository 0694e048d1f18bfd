#include "host/recording/event_lines.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "calibration/geometry/rigid_matrix.hpp"
#include "calibration/record/strict_json.hpp"
#include "device/wire/json.hpp"
#include "drivers/system/json_file.hpp"

namespace birdseye::host {

namespace {

using nlohmann::json;

json json_of(const wire::Birds& birds) {
  json list = json::array();
  for (const wire::Bird& bird : birds.birds) {
    const Eigen::Matrix4d m = bird.tracker_from_sensor.matrix();
    json rows = json::array();
    for (int i = 0; i < 16; ++i) rows.push_back(m(i / 4, i % 4));
    list.push_back({{"name", bird.name}, {"tracker_from_sensor", rows}});
  }
  return {{"acquired_ns", birds.acquired.ns}, {"birds", list}};
}

/// Throws json::exception, or std::invalid_argument for a matrix that is no pose.
wire::Birds birds_of(const json& in) {
  wire::Birds birds;
  wire::get_time(in.at("acquired_ns"), birds.acquired.ns);
  for (const json& bird : in.at("birds")) {
    const json& rows = bird.at("tracker_from_sensor");
    if (rows.size() != 16) throw std::invalid_argument("a pose has 16 numbers");
    Eigen::Matrix4d m;
    for (int i = 0; i < 16; ++i) m(i / 4, i % 4) = rows[static_cast<std::size_t>(i)].get<double>();
    if (!is_rigid(m, 1e-6)) throw std::invalid_argument("a pose that is no pose");
    birds.birds.push_back({bird.at("name").get<std::string>(), Transform<Tracker, Sensor>::from_matrix(m)});
  }
  return birds;
}

json json_of(const wire::VideoFrame& frame, const FramePlace& place) {
  return {{"info", frame.info},
          {"width_px", frame.width_px},
          {"height_px", frame.height_px},
          {"file", place.file},
          {"index", place.index}};
}

EventOfLine event_of(const std::string& kind, const json& in) {
  if (kind == "VideoFrame") {
    wire::VideoFrame frame;
    in.at("info").get_to(frame.info);
    wire::get_whole(in.at("width_px"), frame.width_px);
    wire::get_whole(in.at("height_px"), frame.height_px);
    std::size_t index = 0;
    wire::get_whole(in.at("index"), index);
    return {frame, {in.at("file").get<std::string>(), index}};
  }
  if (kind == "Birds") return {birds_of(in), {}};
  if (kind == "Doubt") return {in.get<wire::Doubt>(), {}};
  if (kind == "ClockChange") return {in.get<wire::ClockChange>(), {}};
  if (kind == "Pedal") return {in.get<wire::Pedal>(), {}};
  if (kind == "Status") return {wire::Status{in.at("ok").get<bool>(), in.at("text").get<std::string>()}, {}};
  if (kind == "Health") return {in.get<wire::Health>(), {}};
  if (kind == "CameraControls") return {in.get<wire::CameraControls>(), {}};
  if (kind == "Calibration") return {in.get<wire::Calibration>(), {}};
  throw std::invalid_argument(fmt::format("an event of kind \"{}\", which is not known", kind));
}

}  // namespace

std::string event_line(const wire::Event& event, const FramePlace& place) {
  struct Visitor {
    const FramePlace& place;
    json operator()(const wire::VideoFrame& e) const { return {{"VideoFrame", json_of(e, place)}}; }
    json operator()(const wire::Birds& e) const { return {{"Birds", json_of(e)}}; }
    json operator()(const wire::Doubt& e) const { return {{"Doubt", e}}; }
    json operator()(const wire::ClockChange& e) const { return {{"ClockChange", e}}; }
    json operator()(const wire::Pedal& e) const { return {{"Pedal", e}}; }
    json operator()(const wire::Status& e) const { return {{"Status", {{"ok", e.ok}, {"text", e.text}}}}; }
    json operator()(const wire::Health& e) const { return {{"Health", e}}; }
    json operator()(const wire::CameraControls& e) const { return {{"CameraControls", e}}; }
    json operator()(const wire::Calibration& e) const { return {{"Calibration", e}}; }
  };
  return calibration::text_of_json(std::visit(Visitor{place}, event));
}

Result<EventOfLine> parse_event_line(const std::string& line) {
  const auto damaged = [](const std::string& why) {
    return Error{Errc::bad_format,
                 fmt::format("is no event: {}; take a copy of the recording that is as it was written", why)};
  };
  const json in = json::parse(line, nullptr, false);
  if (in.is_discarded()) return damaged("it is not JSON");
  if (!in.is_object() || in.size() != 1) return damaged("it does not name one event");
  try {
    return event_of(in.begin().key(), in.begin().value());
  } catch (const json::exception&) {
    return damaged(kPartMissing);
  } catch (const std::exception& fault) {
    return damaged(fault.what());
  }
}

}  // namespace birdseye::host
