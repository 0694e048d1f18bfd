// The laws of what is on the screen.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hw-sim/operation/operation_laws.hpp"
#include "hw-sim/operation/operation_window.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kMostAge_ms = 150;
constexpr double kMostCircles = 3;
constexpr double kCalm_s = 10;  // after a fault's end what it had the window see may still be weighed

}  // namespace

void OperationLaws::note_motion(bool whole, double now_s) {
  constexpr double kWatched_s = 0.5;
  for (; next_move_ < moves_.size() && moves_[next_move_].begins_s <= now_s; ++next_move_) {
    if (!moves_[next_move_].of_patient) continue;
    ++figures_.moved;
    if (!registered_ || (whole_s_ && moves_[next_move_].begins_s - *whole_s_ < kWatched_s)) continue;
    ++figures_.moved_unwatched;
    unwatched_to_s_ = moves_[next_move_].ends_s;
  }
  if (whole) whole_s_ = now_s;
}

/// What the frame shows is on its way, or was so lately that no later frame can have told of it.
bool OperationLaws::moves_at(double exposed_s) const {
  constexpr double kTakes_s = 0.1;
  return std::ranges::any_of(moves_, [exposed_s](const Move& move) {
    return exposed_s >= move.begins_s && exposed_s < move.ends_s + kTakes_s;
  });
}

/// Of a whole overlay: the turn of the scope, or the zoom of the lens, must have been seen.
void OperationLaws::judge_scope(double exposed_s, double now_s) {
  constexpr double kSeenWithin_s = 3, kTurned_deg = 20, kZoomed = 1.15;
  for (const Span& span : spans_) {
    const Fault& fault = span.fault;
    const bool turned = fault.kind == FaultKind::scope_turned && std::abs(fault.value("deg")) >= kTurned_deg;
    const bool zoomed =
        fault.kind == FaultKind::lens_zoomed && std::max(fault.value("factor"), 1 / fault.value("factor")) >= kZoomed;
    if (!turned && !zoomed) continue;
    const double since_s = exposed_s - fault.at_s - takes_s(fault);
    if (since_s > kSeenWithin_s && exposed_s < span.ends_s)
      break_law(now_s, "turned", fmt::format("an overlay is whole {:.1f} s after {}", since_s, fault_name(fault.kind)));
  }
}

/// What the video shows is true: where no fault has touched its times or the poses, nobody may say that they differ.
void OperationLaws::judge_accusation(bool accused, double now_s) {
  const bool begins = accused && !accused_;
  accused_ = accused;
  const auto touches = [now_s](const Span& span) {
    return !span.signs.aside && span.begins_s <= now_s && now_s < span.ends_s + kCalm_s;
  };
  if (begins && std::ranges::none_of(spans_, touches))
    break_law(now_s, "accused", "the window says that video and poses do not agree, and nothing has befallen them");
}

/// By the scope that was in use as the frame was exposed. Nobody has a record of one that is calibrated over a board.
void OperationLaws::judge_setup(const host::LivePicture& picture, double exposed_s, double now_s) {
  constexpr double kSame = 1e-6;  // a record is text in between
  if (in_doubt_) break_law(now_s, "setup", "an overlay is drawn by a registration that is in doubt or held back");
  if (begins_at_board_) return;
  const std::size_t scope = truth_.scope_in_use(exposed_s);
  const auto& setup = picture.setup();
  const bool same =
      setup && setup->camera() == truth_.record_of(scope).lens->camera &&
      (setup->camera_from_sensor().matrix() - truth_.found_camera_from_sensor(scope).matrix()).norm() < kSame;
  if (!same) break_law(now_s, "setup", "an overlay is drawn with the calibration of a scope that is not in use");
}

void OperationLaws::take(const host::ShownPicture& shown, const host::LivePicture& picture, HostTime now) {
  const double now_s = at_s(now.ns);
  ++figures_.shown;
  note_motion(is_whole(shown), now_s);
  const bool overlaid = shown.overlaid && shown.strength > 0;
  const std::string doubt = doubts_.shown(overlaid, now_s);
  if (!doubt.empty()) break_law(now_s, "setup", "an overlay is drawn after " + doubt);
  if (!overlaid || !picture.frame()) return;
  ++figures_.overlaid;
  if (checks_when_opened_)
    break_law(now_s, "kept", "the window was opened again, and draws before a landmark was checked");
  const auto exposed_ns = exposed_ns_(picture.frame()->info.sequence);
  if (!exposed_ns) return break_law(now_s, "age", "an overlay is on a frame that the camera never gave");
  const double exposed_s = at_s(*exposed_ns);
  judge_setup(picture, exposed_s, now_s);
  if (picture.setup()) judge_place_kept(picture.setup()->tracker_from_patient(), now_s);
  double lies_s = 0;
  bool lies = false;
  for (const Span& span : spans_) {
    if (exposed_s < span.begins_s - kLinger_s || exposed_s > span.ends_s + kLinger_s) continue;
    if (span.of == FaultTarget::camera) lies_s += span.signs.extra_s;
    lies = lies || span.signs.lies || span.signs.extra_mm > 0 || span.signs.extra_s > 0;
  }
  const double age_ms = 1e3 * (now_s - exposed_s - lies_s);
  figures_.worst_age_ms = std::max(figures_.worst_age_ms, age_ms);
  if (age_ms > kMostAge_ms)
    break_law(now_s, "age", fmt::format("an overlay's frame was exposed {:.0f} ms ago", age_ms));
  const auto drawn_from = picture.camera_from_patient();
  const auto& budget = picture.decision().expected;
  if (!is_whole(shown) || !drawn_from || !budget) return;
  ++figures_.green;
  if (pictures_) judge_scope(exposed_s, now_s);
  if (lies || unwatched_to_s_ || moves_at(exposed_s)) return;
  const Eigen::Vector3d target_mm = truth_.target_mm() + truth_.organ(exposed_s).shift_mm;
  const Eigen::Vector3d true_mm = truth_.camera_from_patient(exposed_s) * target_mm;
  const auto true_px = project(truth_.lens(exposed_s), true_mm);
  const Eigen::Vector3d shown_mm = picture.figures().target_in_patient_mm.value_or(truth_.target_mm());
  const auto drawn_px = project(picture.setup()->camera(), Eigen::Vector3d(*drawn_from * shown_mm));
  if (!true_px || !drawn_px) return;
  ++figures_.judged;
  const double off_mm = (*true_px - *drawn_px).norm() / truth_.lens(exposed_s).fx_px * true_mm.z();
  const double circles = off_mm / budget->radius95_mm();
  figures_.worst_circles = std::max(figures_.worst_circles, circles);
  if (circles > kPromisedCircles) ++figures_.beyond;
  if (circles > kMostCircles) {
    break_law(now_s, "circle",
              fmt::format("a whole overlay is {:.1f} mm off, its circle {:.1f} mm", off_mm, budget->radius95_mm()));
  }
}

}  // namespace birdseye::hw_sim
