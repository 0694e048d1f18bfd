#include "host/app/calibrate/live_hand_eye.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/base/units.hpp"
#include "calibration/solve/guidance.hpp"
#include "calibration/solve/view_pose.hpp"
#include "host/app/appliance_link.hpp"
#include "host/app/calibrate/live_stations.hpp"
#include "host/app/event_stream.hpp"
#include "host/app/interrupt.hpp"
#include "host/app/picture.hpp"
#include "host/app/text_files.hpp"
#include "host/app/write_files.hpp"

namespace birdseye::host {

namespace {

using calibration::HandEyeStation;
using Clock = wire::Client::Clock;

constexpr auto kSilence = std::chrono::seconds(6);
constexpr auto kLookEvery = std::chrono::milliseconds(1500);
constexpr std::size_t kFirstSolved = 6;
// Nearer than this to a station, another tells nothing new: a tracker repeats its error there.
constexpr double kSamePlaceMm = 4, kSameTurnRad = 2.5 * kRadPerDeg;
constexpr double kCornerSigmaPx = 0.3;

class Guide {
 public:
  Guide(const LivePlan& plan, Progress& progress)
      : plan_(plan), progress_(progress), stations_(plan.pattern, plan.bird), ends_(seconds_from_now(plan.seconds)) {
    session_.input.camera = plan.camera;
    Eigen::Vector3d first = Eigen::Vector3d::Zero(), last = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& point : calibration::pattern_points_mm(plan.pattern)) {
      first = first.cwiseMin(point);
      last = last.cwiseMax(point);
    }
    extent_mm_ = last - first;
  }

  Result<LiveSession> run(EventStream& stream) {
    progress_.keep("hold the scope over the pattern, all of it in the picture, and still for a second");
    auto heard = Clock::now(), posed = heard;
    while (session_.ended.empty()) {
      auto event = stream.next(Clock::now() + std::chrono::milliseconds(200));
      if (!event) return event.error();
      if (*event) {
        if (std::holds_alternative<wire::VideoFrame>(**event)) heard = Clock::now();
        if (const auto* birds = std::get_if<wire::Birds>(&**event); birds && hears(*birds)) posed = Clock::now();
        if (const auto taken = take(**event); !taken) return taken.error();
      }
      if (Clock::now() - heard > kSilence) {
        return Error{Errc::timeout,
                     fmt::format("{}: no frame has come for {} s{}{}", plan_.server, kSilence / std::chrono::seconds(1),
                                 status_.empty() ? "" : ": ", status_)};
      }
      if (Clock::now() - posed > kSilence) {
        return Error{Errc::timeout,
                     fmt::format("{}: no pose of \"{}\" has come for {} s{}{}", plan_.server, plan_.bird,
                                 kSilence / std::chrono::seconds(1), others_.empty() ? "" : "; there is " + others_,
                                 status_.empty() ? "" : "; it says: " + status_)};
      }
      if (session_.ended.empty() && interrupted()) session_.ended = "interrupted";
      if (session_.ended.empty() && Clock::now() > ends_)
        session_.ended = fmt::format("{:g} s are over", plan_.seconds);
    }
    progress_.keep(session_.ended + "; the last solution is being worked out");
    solve(true);
    return std::move(session_);
  }

 private:
  static Clock::time_point seconds_from_now(double seconds) {
    return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }

  Result<void> take(const wire::Event& event) {
    if (const auto* birds = std::get_if<wire::Birds>(&event)) stations_.push(*birds);
    if (const auto* status = std::get_if<wire::Status>(&event)) note(*status);
    if (const auto* frame = std::get_if<wire::VideoFrame>(&event)) {
      if (session_.width_px != 0 && (frame->width_px != session_.width_px || frame->height_px != session_.height_px)) {
        return Error{Errc::bad_value,
                     fmt::format("frames changed from {} x {} to {} x {}: calibrate at one size", session_.width_px,
                                 session_.height_px, frame->width_px, frame->height_px)};
      }
      session_.width_px = frame->width_px;
      session_.height_px = frame->height_px;
      stations_.push(*frame);
    }
    while (auto station = stations_.take_station()) {
      if (auto added = add(*std::move(station)); !added) return added;
    }
    if (const std::string remark = stations_.take_remark(); !remark.empty()) progress_.keep(remark);
    if (Clock::now() > next_look_) guide();
    return {};
  }

  /// Whether the scope is among them; the others are kept for messages.
  bool hears(const wire::Birds& birds) {
    bool scope = false;
    for (const wire::Bird& bird : birds.birds) {
      scope = scope || bird.name == plan_.bird;
      if (bird.name != plan_.bird && others_.find(bird.name) == std::string::npos)
        others_ += (others_.empty() ? "" : ", ") + bird.name;
    }
    return scope;
  }

  void note(const wire::Status& status) {
    if (!status.ok && status.text != status_) progress_.keep("the appliance says: " + status.text);
    status_ = status.text;
  }

  Result<void> add(LiveStation taken) {
    for (const HandEyeStation& other : session_.input.stations) {
      const auto& a = other.tracker_from_sensor;
      const auto& b = taken.tracker_from_sensor;
      if ((a.translation() - b.translation()).norm() < kSamePlaceMm &&
          rotation_angle_between(a.rotation(), b.rotation()) < kSameTurnRad) {
        progress_.keep(fmt::format("not taken: the same pose as {}; move on", other.name));
        return {};
      }
    }
    const std::size_t number = session_.input.stations.size() + 1;
    taken.view.name = fmt::format("station {}", number);
    if (auto kept = keep(taken, number); !kept) return kept;
    progress_.keep(fmt::format("station {}: {} points", number, taken.view.points_px.size()));
    HandEyeStation station;
    station.name = taken.view.name;
    station.tracker_from_sensor = taken.tracker_from_sensor;
    station.view = std::move(taken.view);
    session_.input.stations.push_back(std::move(station));
    if (number >= kFirstSolved) solve(false);
    if (session_.ended.empty() && number >= plan_.most_stations)
      session_.ended = fmt::format("{} stations, the most that were asked for", number);
    next_look_ = {};
    return {};
  }

  Result<void> keep(const LiveStation& taken, std::size_t number) {
    if (plan_.keep.empty()) return {};
    const std::string name = fmt::format("station{:03}", number);
    const wire::VideoFrame& frame = taken.frame;
    return write_files(
        {{plan_.keep / "pictures" / (name + ".png"), png_of(*frame.rgb, frame.width_px, frame.height_px, 3)},
         {plan_.keep / "poses" / (name + ".txt"), pose_text(taken.tracker_from_sensor.matrix())}});
  }

  /// The lens that is given, or that the views so far tell of.
  std::optional<CameraModel> lens(bool last) {
    if (plan_.camera) return plan_.camera;
    std::vector<calibration::PatternView> views;
    views.reserve(session_.input.stations.size());
    for (const HandEyeStation& station : session_.input.stations) views.push_back(station.view);
    calibration::CameraCalibrationSettings settings;
    if (!last) {  // quick: which model is best is asked at the end
      settings.model = calibration::LensModel::radial2_tangential2;
      settings.folds = 2;
    }
    auto found = calibration::calibrate_camera(views, session_.width_px, session_.height_px, settings);
    if (!found) {
      session_.lens_fault = found.error().what;
      return std::nullopt;
    }
    session_.lens_fault.clear();
    lens_grade_ = calibration::judge_camera(*found).grade;
    session_.lens = *std::move(found);
    return session_.lens->camera;
  }

  void solve(bool last) {
    session_.input.camera = lens(last);
    if (!session_.input.camera) {
      progress_.keep("lens: not found yet: " + session_.lens_fault);
      return;
    }
    const auto result = calibration::calibrate_hand_eye(session_.input);
    if (last || !result) return;
    Verdict verdict = calibration::judge(*result);
    if (!plan_.camera) verdict.add(lens_grade_, lens_grade_ == Grade::pass ? "" : "the lens wants more views");
    if (result->solved)
      progress_.keep(
          fmt::format("hand-eye so far: held-out {:.2f} mm, verdict {}", result->held_out_mm, name_of(verdict.grade)));
    if (verdict.grade == Grade::pass && session_.input.stations.size() >= plan_.fewest_stations)
      session_.ended = fmt::format("the verdict is pass with {} stations", session_.input.stations.size());
  }

  std::optional<Transform<Camera, Marker>> pose_of(const calibration::PatternView& view) const {
    if (!session_.input.camera) return std::nullopt;
    const auto pose = calibration::find_view_pose({{&*session_.input.camera, {}, &view}}, kCornerSigmaPx);
    if (!pose) return std::nullopt;
    return pose->camera_from_marker;
  }

  /// What is covered, and the next best pose from where the scope is.
  void guide() {
    next_look_ = Clock::now() + kLookEvery;
    if (stations_.deciding() || session_.width_px == 0) return;
    if (!session_.input.camera) {
      progress_(
          fmt::format("{} stations; tilt the scope by 20 to 40 degrees, each time another way, and turn it about "
                      "its length between them",
                      session_.input.stations.size()));
      return;
    }
    std::vector<calibration::Station> stations;
    for (const HandEyeStation& station : session_.input.stations) {
      if (const auto pose = pose_of(station.view))
        stations.push_back({station.tracker_from_sensor, *pose, station.view.points_px});
    }
    const auto seen = stations_.look();
    const auto next =
        calibration::next_best_pose(stations, *session_.input.camera, extent_mm_, seen ? pose_of(*seen) : std::nullopt);
    progress_(fmt::format("{} stations; {}; {}next: {}", stations.size(),
                          coverage_line(calibration::coverage_of(stations, session_.width_px, session_.height_px)),
                          seen ? "" : "the pattern is not seen now; ", next.words));
  }

  const LivePlan& plan_;
  Progress& progress_;
  LiveStations stations_;
  Clock::time_point ends_, next_look_{};
  Eigen::Vector3d extent_mm_;
  LiveSession session_;
  std::string status_, others_;
  Grade lens_grade_ = Grade::pass;
};

}  // namespace

Result<LiveSession> guide_hand_eye(const LivePlan& plan, Progress& progress) {
  if (plan.pattern.half_turn_ambiguous || plan.pattern.quarter_turn_ambiguous) {
    return Error{Errc::bad_value,
                 fmt::format("{}: looks the same turned upside down, so that a view does not tell which end is which; "
                             "use a board with one odd and one even count, or a ChArUco board",
                             plan.pattern.spec)};
  }
  if (!plan.keep.empty()) {
    std::error_code error;
    for (const char* folder : {"pictures", "poses"}) std::filesystem::create_directories(plan.keep / folder, error);
    if (error) return Error{Errc::unreadable, plan.keep.string() + ": cannot be made: " + error.message()};
  }
  auto client = connect_appliance(plan.server);
  if (!client) return client.error();
  // Focus or exposure that changes from view to view would be another lens.
  if (const auto locked = (*client)->lock_camera(true, Clock::now() + std::chrono::seconds(2)); !locked)
    return locked.error();
  note_interrupts();
  EventStream stream(*std::move(client), 60);
  return Guide(plan, progress).run(stream);
}

}  // namespace birdseye::host
