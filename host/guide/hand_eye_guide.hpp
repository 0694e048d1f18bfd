#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calibration/detect/pattern.hpp"
#include "device/wire/messages.hpp"
#include "host/guide/guide_state.hpp"
#include "host/guide/guided_calibration.hpp"
#include "host/guide/live_stations.hpp"

namespace birdseye::host {

/// Settings of a guided hand-eye calibration.
struct GuidePlan {
  std::string bird = "scope";  ///< the scope's, as the appliance names it
  calibration::Pattern pattern;
  std::optional<CameraModel> camera;  ///< a lens that is known; empty: found from the same views
  std::filesystem::path keep;         ///< a folder for the stations' pictures and poses; empty: none are kept
  std::size_t fewest_stations = 12, most_stations = 40;
};

/// Leads a person through the stations of a hand-eye calibration. Fed with the appliance's events in order, it takes a
/// station whenever the scope is held still over the pattern, solves after each station, and says what is covered and
/// where to go next. It ends when the verdict is pass, or at the most stations. Solving holds the caller up for some
/// tenths of a second.
class HandEyeGuide {
 public:
  /// now: called with a line that the next one replaces; lasting: called with a line that stays.
  struct Teller {
    std::function<void(const std::string&)> now, lasting;
  };

  /// Refuses a pattern that looks the same upside down, and a folder that cannot be made.
  static Result<void> check(const GuidePlan& plan);
  HandEyeGuide(GuidePlan plan, Teller tell);

  /// Takes the next event. Errors: frames of another size than before, a picture that cannot be kept.
  Result<void> take(const wire::Event& event);
  /// Ends the calibration with the stations that it has. why: in words.
  void end(const std::string& why);
  [[nodiscard]] bool ended() const { return !session_.ended.empty(); }
  /// Works out the last lens and gives all that was taken. To be called once, at the end.
  GuidedStations finish();

  [[nodiscard]] const GuideState& state() const { return state_; }

 private:
  Result<void> take_frame(const wire::VideoFrame& frame);
  Result<void> add(LiveStation taken);
  Result<void> keep(const LiveStation& taken, std::size_t number);
  void find_lens_or_say(const calibration::CameraCalibrationSettings& settings);
  void solve();
  [[nodiscard]] std::optional<Transform<Camera, Marker>> pose_of(const calibration::PatternView& view) const;
  void look();

  GuidePlan plan_;
  Teller tell_;
  LiveStations stations_;
  HostTime next_look_;
  Eigen::Vector3d extent_mm_;
  GuidedStations session_;
  std::vector<RoundField> round_fields_;  ///< of the stations whose picture shows an edge
  GuideState state_;
};

}  // namespace birdseye::host
