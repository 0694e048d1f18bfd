#include "host/operation/deformation_step.hpp"

#include <tbb/task_arena.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "drivers/system/clock.hpp"
#include "host/files/picture.hpp"
#include "host/registration/geometry/geometry_registration.hpp"
#include "host/registration/geometry/geometry_verdict.hpp"
#include "host/registration/similarity/overlap_mask.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr std::size_t kFewestViews = 2, kFewestBesideTouches = 1;

Result<VideoView> view_of(const KeptView& kept, const CameraModel& camera, std::size_t number) {
  VideoView view;
  view.name = words("view_name", number);
  view.camera = camera;
  view.camera_from_patient = kept.camera_from_patient;
  const wire::VideoFrame& frame = kept.frame;
  const RgbView video{*frame.rgb, frame.width_px, frame.height_px};
  view.grey = grey_of(video);
  const std::vector<std::uint8_t> nothing_left_out(view.grey.size(), 0);
  auto mask = overlap_mask(video, nothing_left_out);
  if (!mask) return mask.error().with_context(view.name);
  view.mask = *std::move(mask);
  return view;
}

/// What is said of the deformation, and after it how the touches fit, where there are any.
std::string with_touches(const std::string& said, const std::vector<PlaceFit>& touches) {
  if (touches.empty()) return said;
  const auto wrong =
      std::count_if(touches.begin(), touches.end(), [](const PlaceFit& fit) { return fit.thought_wrong(); });
  if (wrong == 0) return words("note_patches_none", said, touches.size());
  if (wrong == 1) return words("note_patches_one", said, touches.size());
  return words("note_patches_some", said, touches.size(), wrong);
}

}  // namespace

std::string DeformationStep::why_too_few(std::size_t views, bool touched) {
  if (views >= (touched ? kFewestBesideTouches : kFewestViews)) return {};
  return words("note_few_views", views, kEnoughViews);
}

void DeformationStep::begin(std::span<const KeptView> kept, const CameraModel& camera,
                            std::shared_ptr<const PatientPlan> patient,
                            std::shared_ptr<const TransferFunction> transfer, std::vector<SeenPoint> touches,
                            const std::optional<CameraMatrix>& camera_covariance) {
  if (running()) return;
  if (std::string why = why_too_few(kept.size(), !touches.empty()); !why.empty()) {
    note_.line = std::move(why);
    return;
  }
  std::vector<VideoView> views;
  std::vector<wire::VideoFrame> frames;
  for (const KeptView& one : kept) {
    auto view = view_of(one, camera, views.size() + 1);
    if (!view) {
      note_.line = view.error().what;
      return;
    }
    views.push_back(*std::move(view));
    frames.push_back(one.frame);
  }
  former_note_ = std::exchange(note_, {false, words("note_matching")});
  dropped_ = false;
  target_at_rest_mm_ = target_in_patient_mm(*patient);
  if (made_.patient.lock() != patient || made_.transfer.lock() != transfer) made_ = {patient, transfer, nullptr};
  matching_.start([target_mm = *target_at_rest_mm_, views = std::move(views), frames = std::move(frames),
                   patient = std::move(patient), transfer = std::move(transfer), made = made_.organ,
                   touches = std::move(touches),
                   camera_covariance](const std::stop_token& stop, const auto& say) -> Result<Matched> {
    std::vector<RgbView> pictures;
    for (const wire::VideoFrame& frame : frames) pictures.push_back({*frame.rgb, frame.width_px, frame.height_px});
    GeometrySettings settings;
    settings.targets_at_rest_mm = {target_mm};
    settings.touches = touches;
    settings.camera_covariances.assign(views.size(), camera_covariance);
    settings.gather_touches = true;
    settings.round_done = [&say](std::size_t round, std::size_t rounds, std::size_t places) {
      say(words("match_round", round, rounds, places));
    };
    settings.watch.cancelled = [&stop] { return stop.stop_requested(); };
    // On one core: the others have the live picture to draw.
    tbb::task_arena one(1);
    try {
      return one.execute([&]() -> Result<Matched> {
        auto organ = made;
        if (!organ) {
          auto fresh =
              organ_at_rest(patient->ct, patient->labels ? &*patient->labels : nullptr, patient->organ, *transfer);
          if (!fresh) return fresh.error();
          organ = *std::move(fresh);
        }
        auto found = register_geometry(views, pictures, patient->ct, *organ, settings);
        if (!found) return found.error();
        const Verdict verdict =
            geometry_verdict(views, *found, patient->landmarks.empty() ? JudgedBy::inside : JudgedBy::target);
        return Matched{*std::move(found), verdict, std::move(organ)};
      });
    } catch (const std::exception& problem) {  // of a library: it must not end the operation
      return Error{Errc::io, words("note_not_matched", problem.what())};
    }
  });
}

bool DeformationStep::tick() {
  auto matched = matching_.take();
  if (!matched || std::exchange(dropped_, false)) return false;
  if (!*matched) {
    note_ = {false, matched->error().what};
    return false;
  }
  ViewRegistration& registration = (*matched)->found;
  made_.organ = std::move((*matched)->organ);
  const Verdict& verdict = (*matched)->verdict;
  if (registration.worse_than_start) {
    note_ = {false, words("note_folds")};
    return false;
  }
  if (verdict.grade == Grade::fail) {
    note_ = {false, with_touches(verdict.reasons.front(), registration.touches)};
    return false;
  }
  const bool with_care = verdict.grade == Grade::marginal;
  const std::string& reason = verdict.reasons.front();
  note_ = {true, with_touches(with_care ? words("note_with_care", reason) : reason, registration.touches)};
  DeformedOrgan organ{std::move(registration.field), std::nullopt, std::nullopt, utc_now()};
  if (with_care) organ.care = reason;
  if (const auto& expected = registration.expected) {
    if (expected->seen) organ.seen_rms_mm = expected->seen->rms_mm;
    if (!expected->targets.empty()) {
      organ.target = MotionError{expected->targets.front().rms_mm, expected->targets.front().radius95_mm};
      organ.target_at_rest_mm = target_at_rest_mm_;
    }
  }
  found_ = std::make_shared<const DeformedOrgan>(std::move(organ));
  adjusted_.clear();
  if (registration.adjusted) adjusted_ = std::move(registration.adjusted->camera_from_patient);
  return true;
}

void DeformationStep::undo() {
  found_.reset();
  note_ = {false, words("note_undone")};
}

void DeformationStep::drop(const std::string& why) {
  dropped_ = running();
  cancel();
  const bool ended = matching_.take().has_value();  // and nobody has looked at it yet
  if (!dropped_ && !ended) return;
  note_ = found_ ? former_note_ : StepNote{false, why};
}

bool DeformationStep::forget() {
  dropped_ = running();
  cancel();
  (void)matching_.take();  // ended, and not looked at yet
  note_ = {};
  return std::exchange(found_, nullptr) != nullptr;
}

void DeformationStep::take_up(std::shared_ptr<const DeformedOrgan> kept, const std::string& line) {
  found_ = std::move(kept);
  note_ = {true, with_care() ? words("note_taken_up_with_care", line, found_->care) : line};
}

}  // namespace birdseye::host
