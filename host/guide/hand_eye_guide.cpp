#include "host/guide/hand_eye_guide.hpp"

#include <fmt/format.h>

#include "calibration/base/units.hpp"
#include "calibration/hand_eye/view_pose.hpp"
#include "calibration/picture/field_edge.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/durable.hpp"
#include "host/files/picture.hpp"
#include "host/files/text_files.hpp"
#include "host/files/write_files.hpp"
#include "host/guide/guide_words.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

using calibration::HandEyeStation;

constexpr Duration kLookEvery = Duration::from_ms(1500);
constexpr std::size_t kFirstSolved = 6;
// Nearer than this to a station, another tells nothing new: a tracker repeats its error there.
constexpr double kSamePlaceMm = 4, kSameTurnRad = 2.5 * kRadPerDeg;
constexpr double kCornerSigmaPx = 0.3;

}  // namespace

Result<void> HandEyeGuide::check(const GuidePlan& plan) {
  if (plan.pattern.half_turn_ambiguous || plan.pattern.quarter_turn_ambiguous) {
    return Error{Errc::bad_value,
                 fmt::format("{}: looks the same turned upside down, so that a view does not tell which end is which; "
                             "use a board with one odd and one even count, or a ChArUco board",
                             plan.pattern.spec)};
  }
  if (plan.keep.empty()) return {};
  for (const char* folder : {"pictures", "poses"}) {
    if (auto made = make_folder_durably(plan.keep / folder); !made) return made;
  }
  return {};
}

HandEyeGuide::HandEyeGuide(GuidePlan plan, Teller tell)
    : plan_(std::move(plan)), tell_(std::move(tell)), stations_(plan_.pattern, plan_.bird) {
  session_.input.camera = plan_.camera;
  Eigen::Vector3d first = Eigen::Vector3d::Zero(), last = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : calibration::pattern_points_mm(plan_.pattern)) {
    first = first.cwiseMin(point);
    last = last.cwiseMax(point);
  }
  extent_mm_ = last - first;
  state_.next = words("guide_begin");
  tell_.lasting(state_.next);
}

Result<void> HandEyeGuide::take(const wire::Event& event) {
  if (ended()) return {};
  if (const auto* birds = std::get_if<wire::Birds>(&event)) stations_.push(*birds);
  if (const auto* frame = std::get_if<wire::VideoFrame>(&event)) {
    if (auto taken = take_frame(*frame); !taken) return taken;
  }
  while (auto station = stations_.take_station()) {
    if (auto added = add(*std::move(station)); !added) return added;
  }
  if (const std::string remark = stations_.take_remark(); !remark.empty()) tell_.lasting(remark);
  if (host_now() > next_look_) look();
  return {};
}

Result<void> HandEyeGuide::take_frame(const wire::VideoFrame& frame) {
  if (session_.width_px != 0 && (frame.width_px != session_.width_px || frame.height_px != session_.height_px)) {
    return Error{Errc::bad_value,
                 words("guide_size_changed", session_.width_px, session_.height_px, frame.width_px, frame.height_px)};
  }
  session_.width_px = frame.width_px;
  session_.height_px = frame.height_px;
  stations_.push(frame);
  return {};
}

void HandEyeGuide::end(const std::string& why) {
  if (!ended()) session_.ended = why;
}

GuidedStations HandEyeGuide::finish() {
  if (const std::string words = stations_.rests().left_out_words(); !words.empty()) tell_.lasting(words);
  tell_.lasting(words("guide_working_out", session_.ended));
  find_lens_or_say({});
  session_.round_field = calibration::agreed_round_field(round_fields_, session_.input.stations.size());
  return std::move(session_);
}

Result<void> HandEyeGuide::add(LiveStation taken) {
  for (const HandEyeStation& other : session_.input.stations) {
    const auto& a = other.tracker_from_sensor;
    const auto& b = taken.tracker_from_sensor;
    if ((a.translation() - b.translation()).norm() < kSamePlaceMm &&
        rotation_angle_between(a.rotation(), b.rotation()) < kSameTurnRad) {
      tell_.lasting(words("guide_same_pose", other.name));
      return {};
    }
  }
  const std::size_t number = session_.input.stations.size() + 1;
  taken.view.name = fmt::format("station {}", number);
  if (auto kept = keep(taken, number); !kept) return kept;
  const wire::VideoFrame& frame = taken.frame;
  const auto grey = grey_of({*frame.rgb, frame.width_px, frame.height_px});
  if (const auto field = calibration::find_round_field({grey, frame.width_px, frame.height_px}))
    round_fields_.push_back(*field);
  state_.stations = number;
  tell_.lasting(words("guide_station", number, taken.view.points_px.size()));
  HandEyeStation station;
  station.name = taken.view.name;
  station.tracker_from_sensor = taken.tracker_from_sensor;
  station.view = std::move(taken.view);
  session_.input.stations.push_back(std::move(station));
  if (number >= kFirstSolved) solve();
  if (session_.ended.empty() && number >= plan_.most_stations) session_.ended = words("guide_most_stations", number);
  next_look_ = {};
  return {};
}

Result<void> HandEyeGuide::keep(const LiveStation& taken, std::size_t number) {
  if (plan_.keep.empty()) return {};
  const std::string name = fmt::format("station{:03}", number);
  const wire::VideoFrame& frame = taken.frame;
  return write_files(
      {{plan_.keep / "pictures" / (name + ".png"), png_of(RgbView{*frame.rgb, frame.width_px, frame.height_px})},
       {plan_.keep / "poses" / (name + ".txt"), pose_text(taken.tracker_from_sensor.matrix())}});
}

/// Where none is given.
void HandEyeGuide::find_lens_or_say(const calibration::CameraCalibrationSettings& settings) {
  if (plan_.camera) return;
  find_lens(session_, settings);
  if (!session_.lens) tell_.lasting(words("guide_no_lens", session_.lens_fault));
}

void HandEyeGuide::solve() {
  calibration::CameraCalibrationSettings quick;  // which model is best is asked at the end
  quick.model = calibration::LensModel::radial2_tangential2;
  quick.folds = 2;
  find_lens_or_say(quick);
  if (!session_.input.camera) return;
  const auto result = calibration::calibrate_hand_eye(session_.input);
  if (!result) return;
  Verdict verdict = calibration::judge(*result);
  if (session_.lens) {
    const Grade lens = calibration::judge_camera(*session_.lens).grade;
    verdict.add(lens, lens == Grade::pass ? "" : words("guide_more_views"));
  }
  state_.grade = verdict.grade;
  if (result->solved) state_.held_out_mm = result->held_out_mm;
  if (result->solved) tell_.lasting(words("guide_so_far", result->held_out_mm, words_of(verdict.grade)));
  if (verdict.grade == Grade::pass && session_.input.stations.size() >= plan_.fewest_stations)
    session_.ended = words("guide_passes", session_.input.stations.size());
}

std::optional<Transform<Camera, Marker>> HandEyeGuide::pose_of(const calibration::PatternView& view) const {
  if (!session_.input.camera) return std::nullopt;
  const auto pose = calibration::find_view_pose({{&*session_.input.camera, {}, &view}}, kCornerSigmaPx);
  if (!pose) return std::nullopt;
  return pose->camera_from_marker;
}

/// What is covered, and the next best pose from where the scope is.
void HandEyeGuide::look() {
  next_look_ = host_now() + kLookEvery;
  if (stations_.rests().deciding() || session_.width_px == 0) return;
  if (!session_.input.camera) {
    state_.next = words("guide_any_tilt");
    tell_.now(words("guide_stations", session_.input.stations.size(), state_.next));
    return;
  }
  std::vector<calibration::Station> stations;
  for (const HandEyeStation& station : session_.input.stations) {
    if (const auto pose = pose_of(station.view))
      stations.push_back({station.tracker_from_sensor, *pose, station.view.points_px});
  }
  const auto seen = stations_.look();
  state_.pattern_seen = seen.has_value();
  state_.next = words_of(
      calibration::next_best_pose(stations, *session_.input.camera, extent_mm_, seen ? pose_of(*seen) : std::nullopt));
  state_.coverage = calibration::coverage_of(stations, session_.width_px, session_.height_px);
  const std::string covered = coverage_line(state_.coverage);
  tell_.now(seen ? words("guide_next", stations.size(), covered, state_.next)
                 : words("guide_next_unseen", stations.size(), covered, state_.next));
}

}  // namespace birdseye::host
