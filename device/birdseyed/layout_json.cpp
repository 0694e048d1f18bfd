#include "device/birdseyed/layout_json.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calibration/record/field_map_json.hpp"

namespace birdseye {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Duration, ns)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PoseHistory::Settings, capacity, max_gap, max_prediction, max_time_sigma,
                                   acceleration_mm_s2, smoothing)

}  // namespace birdseye

namespace birdseye::drivers::minibird {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Plausibility, most_speed_mm_s, most_turn_deg_s, most_acceleration_mm_s2, slack_mm,
                                   slack_deg, step_confirms, start_confirms, gap, frozen_after, frozen_moved_mm,
                                   hemisphere_border_mm, flip_memory)
static void to_json(nlohmann::json& json, const BirdLayout& bird) {
  const Eigen::Vector3d& into = bird.into_hemisphere;
  json = {{"format", static_cast<int>(bird.format)},
          {"mm_per_count", bird.mm_per_count},
          {"into_hemisphere", {into.x(), into.y(), into.z()}}};
}
static void from_json(const nlohmann::json& json, BirdLayout& bird) {
  const int format = json.at("format").get<int>();
  bird.format = static_cast<RecordFormat>(format > 0 && format < 256 ? format : 0);  // 0 is none: fault_of() tells
  json.at("mm_per_count").get_to(bird.mm_per_count);
  for (int i = 0; i < 3; ++i) bird.into_hemisphere[i] = json.at("into_hemisphere").at(static_cast<std::size_t>(i));
}
void to_json(nlohmann::json& json, const StreamLayout& layout) {
  json = {{"birds", layout.birds},
          {"group_mode", layout.group_mode},
          {"button_byte", layout.button_byte},
          {"rate_hz", layout.rate_hz},
          {"baud", layout.baud},
          {"delay", layout.delay},
          {"plausibility", layout.plausibility}};
}
void from_json(const nlohmann::json& json, StreamLayout& layout) {
  json.at("birds").get_to(layout.birds);
  json.at("group_mode").get_to(layout.group_mode);
  json.at("button_byte").get_to(layout.button_byte);
  json.at("rate_hz").get_to(layout.rate_hz);
  json.at("baud").get_to(layout.baud);
  json.at("delay").get_to(layout.delay);
  json.at("plausibility").get_to(layout.plausibility);
}

}  // namespace birdseye::drivers::minibird

namespace birdseye::device {

static void to_json(nlohmann::json& json, const FrameClock::Settings& settings) {
  json = {{"rate_hz", settings.rate_hz}, {"exposure", settings.exposure}, {"strobe", settings.strobe}};
  if (settings.delay) json["delay"] = *settings.delay;
}
static void from_json(const nlohmann::json& json, FrameClock::Settings& settings) {
  json.at("rate_hz").get_to(settings.rate_hz);
  json.at("exposure").get_to(settings.exposure);
  json.at("strobe").get_to(settings.strobe);
  if (json.contains("delay")) settings.delay = json.at("delay").get<Duration>();
}
void to_json(nlohmann::json& json, const CoreSettings& settings) {
  json = {{"bird_names", settings.bird_names},
          {"transforms", settings.transforms},
          {"pose", settings.pose},
          {"pose_wait", settings.pose_wait},
          {"frame_clock", settings.frame_clock},
          {"calibration", settings.calibration}};
  if (settings.field) json["field"] = settings.field->data();
  if (!settings.calibration_refused.empty()) json["calibration_refused"] = settings.calibration_refused;
  if (!settings.notice.empty()) json["notice"] = settings.notice;
  if (!settings.field_of.empty()) json["field_of"] = settings.field_of;
  if (!settings.field_refused.empty()) json["field_refused"] = settings.field_refused;
  if (!settings.field_unsigned.empty()) json["field_unsigned"] = settings.field_unsigned;
}
void from_json(const nlohmann::json& json, CoreSettings& settings) {
  json.at("bird_names").get_to(settings.bird_names);
  settings.transforms = json.value("transforms", false);  // recordings from before there were any replay without
  json.at("pose").get_to(settings.pose);
  json.at("pose_wait").get_to(settings.pose_wait);
  json.at("frame_clock").get_to(settings.frame_clock);
  json.at("calibration").get_to(settings.calibration);
  settings.calibration_refused = json.value("calibration_refused", "");
  settings.notice = json.value("notice", "");
  if (json.contains("field_of")) json.at("field_of").get_to(settings.field_of);
  settings.field_refused = json.value("field_refused", "");
  settings.field_unsigned = json.value("field_unsigned", "");
  if (!json.contains("field")) return;
  auto map = calibration::FieldMap::from(json.at("field").get<calibration::FieldMapData>());
  if (!map) throw std::invalid_argument(map.error().what);
  settings.field = *std::move(map);
}

}  // namespace birdseye::device
