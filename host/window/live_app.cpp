#include "host/window/live_app.hpp"

#include <fmt/format.h>

#include "calibration/detect/pattern.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/interrupt.hpp"
#include "host/files/picture.hpp"
#include "host/files/write_files.hpp"
#include "host/operation/snapshot.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/texts/texts.hpp"
#include "host/window/banner.hpp"
#include "host/window/stall_picture.hpp"

namespace birdseye::host {

namespace {

// Between pictures it is looked as often as this whether one has grown stale.
constexpr Duration kTick = Duration::from_ms(12);
constexpr Duration kRedraw = Duration::from_ms(50);  // for hands and figures, where there is no new frame

constexpr double kStepMm = 1.2;  // what two cores draw in time

/// Fiducials and landmarks, as the slices mark them.
std::vector<SliceMark> slice_marks(const OperationView& operation) {
  constexpr Colour kFiducial{240, 228, 66}, kLandmark{0, 200, 150};
  std::vector<SliceMark> marks;
  for (std::size_t i = 0; i < operation.markers_in_patient_mm.size(); ++i)
    marks.push_back({operation.markers_in_patient_mm[i], fmt::format("{}", i + 1), kFiducial});
  for (const NamedPoint& landmark : operation.landmarks) marks.push_back({landmark.place_mm, landmark.name, kLandmark});
  return marks;
}

}  // namespace

LiveApp::LiveApp(std::unique_ptr<LiveWindow> window, std::unique_ptr<LiveSource> source, LiveSettings settings,
                 PatientFiles simulated, std::optional<LiveScript> script, std::optional<DecisionLog> log,
                 std::unique_ptr<Publisher> publisher)
    : window_(std::move(window)),
      source_(std::move(source)),
      preset_(std::filesystem::path(settings.transfer).filename().string()),
      workflow_(std::move(settings)),
      simulated_(std::move(simulated)),
      script_(std::move(script)),
      log_(std::move(log)),
      publisher_(std::move(publisher)) {
  facts_.ages = &figures_.ages;
  facts_.recorded = !source_->live();
  facts_.look.render.step_mm = kStepMm;
  facts_.editor = &editor_;
  facts_.preset = preset_;
  workflow_.set_look(facts_.look);
}

void LiveApp::begin_with(const OverlayLook& look, Room room, bool identify) {
  identify_ = identify;
  const RenderSettings render = facts_.look.render;
  facts_.look = look;
  facts_.look.render = render;
  facts_.room = room;
  window_->set_room(room);
  workflow_.set_look(facts_.look);
}

Result<void> LiveApp::run(HostTime asked) {
  note_interrupts();
  const HostTime began = host_now();
  asked_ = asked;
  const Picture cover = stall_picture(window_->scale());
  window_->cover_when_still(side_px(window_->scale()), {cover.rgb, cover.width_px, cover.height_px});
  while (!window_->closed() && !interrupted()) {
    take_events();
    if (auto said = saving_.take()) facts_.said = *std::move(said);
    note_simulator();
    workflow_.set_link(source_->connected(), source_->words(), source_->may_retry());
    workflow_.tick();
    operation_ = workflow_.view();
    note_patient();
    if (publisher_) {
      const DeformedOrgan* const deformed = operation_.deformed.get();
      publisher_->show(operation_.patient, deformed != nullptr ? &deformed->field : nullptr, operation_.shapes);
    }
    draw();
    draw_inset();
    draw_slices();
    if (!window_->fault().empty())
      return Error{Errc::io, "window: " + window_->fault() + "; the driver of the graphics card is at fault"};
    const auto ended = follow_script();
    if (!ended) return ended.error();
    figures_.seconds = Duration{host_now().ns - began.ns}.seconds();
    figures_.stood_still = window_->stood_still();
    if (*ended) break;
  }
  figures_.frames_skipped = workflow_.picture().frames_skipped();
  return {};
}

void LiveApp::take_events() {
  const HostTime deadline = host_now() + kTick;
  bool frame = false;
  // Waits for a frame, then takes what has come besides: the newest frame is what is drawn.
  while (auto event = source_->next(frame ? host_now() : deadline)) {
    frame = frame || std::holds_alternative<wire::VideoFrame>(*event);
    workflow_.take(*event, host_now(), source_->host_from_device());
  }
}

void LiveApp::note_simulator() {
  SimulatedCart* const cart = source_->cart();
  if (cart == nullptr || sheet_read_) return;
  sheet_read_ = true;
  const CartSheet& sheet = cart->sheet();
  if (const auto pattern = calibration::parse_pattern(sheet.board))
    workflow_.set_sheet(*pattern, sheet.tip_in_pointer_mm, static_cast<std::size_t>(sheet.fiducials));
  workflow_.load(simulated_);
}

void LiveApp::note_patient() {
  if (operation_.markers_seen && !figures_.fiducials_s)
    figures_.fiducials_s = Duration{host_now().ns - asked_.ns}.seconds();
  if (operation_.patient == nullptr || histogram_) return;
  histogram_.emplace(operation_.patient->shown);
  facts_.histogram = &*histogram_;
  inset_.emplace(operation_.patient->shown);
  if (operation_.transfer) editor_.set_points(operation_.transfer->points());
  figures_.ct_s = Duration{host_now().ns - asked_.ns}.seconds();
}

/// Some times a second, between frames: it is no part of what must be live.
void LiveApp::draw_inset() {
  constexpr Duration kEvery = Duration::from_ms(250);
  if (!inset_ || Duration{host_now().ns - inset_drawn_.ns} < kEvery) return;
  inset_drawn_ = host_now();
  const auto ct =
      workflow_.ct_seen_from(inset_->camera(), inset_->outside_from_patient(), InsetView::render_settings());
  if (!ct) return;
  const Picture picture = inset_->draw(*ct, workflow_.picture().seen_from());
  window_->set_picture(LiveWindow::Slot::inset, {picture.rgb, picture.width_px, picture.height_px});
}

/// On a thread of its own, the newest wish next.
void LiveApp::draw_slices() {
  if (const auto picture = slicing_.take())
    window_->set_picture(LiveWindow::Slot::slices, {picture->rgb, picture->width_px, picture->height_px});
  if (!facts_.slices) return;
  std::vector<SliceMark> marks = slice_marks(operation_);
  if (marks != marks_) slices_changed_ = true;
  if (!slices_changed_ || slicing_.running()) return;
  slices_changed_ = false;
  marks_ = std::move(marks);
  slicing_.start(
      [view = *facts_.slices, marks = marks_](const std::stop_token&, const auto&) { return view.draw(marks); });
}

void LiveApp::draw() {
  const LivePicture& picture = workflow_.picture();
  workflow_.draw();
  const HostTime began = host_now();
  // Judged as of when it will be seen: drawing the window takes its time too.
  ShownPicture shown = workflow_.shown_at(began + to_draw_);
  const bool shoots = shot_due(began);
  const bool news = shown.changes != drawn_changes_ || shoots;
  if (!news && Duration{began.ns - drawn_.ns} < kRedraw) return;
  drawn_ = began;
  operation_ = workflow_.view();
  facts_.pseudonymised = shoots && !identify_;
  const PanelWishes wishes = draw_window(shown);
  figures_.picture_says = shown.reason;
  if (shoots) snapshot(shot_, shown);
  if (shown.overlaid && !workflow_.shown_at(host_now()).overlaid) {
    // It took longer than it was thought to: what has grown stale on the way is not shown.
    shown = workflow_.shown_at(host_now());
    draw_window(shown, true);
  }
  LiveWindow::Believed until;  // what is frozen or has stopped says so itself
  if (!operation_.frozen) until = shown.believe_until;
  window_->swap(until);
  const HostTime swapped = host_now();
  if (!figures_.window_s) figures_.window_s = Duration{swapped.ns - asked_.ns}.seconds();
  to_draw_ = Duration{swapped.ns - began.ns};
  // Of video that has stopped the age grows: it is said once.
  if (publisher_ && shown.any)
    publisher_->tell(shown.overlaid ? "" : shown.stale ? words("why_stopped_now") : shown.reason);
  if (!shown.any) return grant(wishes);
  const double age_ms = Duration{swapped.ns - picture.exposed().ns}.seconds() * 1e3;
  if (shown.overlaid) figures_.oldest_overlay_ms = std::max(figures_.oldest_overlay_ms, age_ms);
  const std::uint64_t sequence = picture.frame()->info.sequence;
  if (drawn_sequence_ != sequence) {
    drawn_sequence_ = sequence;
    publish(shown);
    ++figures_.frames;
    figures_.frames_overlaid += shown.overlaid ? 1 : 0;
    figures_.ages.add(age_ms);
    swaps_.push_back(swapped);
    while (Duration{swapped.ns - swaps_.front().ns} > Duration::from_ms(2000)) swaps_.pop_front();
    facts_.frames_per_s = static_cast<double>(swaps_.size()) / 2;
    if (log_) {
      LoggedDecision decision;
      decision.sequence = sequence;
      decision.age_ms = age_ms;
      decision.strength = shown.strength;
      decision.shape = operation_.shapes;
      decision.reason = shown.reason;
      Banner banner = banner_of(operation_, shown, facts_);
      decision.said = std::move(banner.text);
      decision.grade = banner.grade;
      const PoseAnswer& pose = picture.frame()->info.pose;
      decision.pose = pose.kind;
      decision.pose_sigma_mm = pose.position_sigma_mm;
      decision.pose_age_ms = pose.age.seconds() * 1e3;
      decision.expected = picture.decision().expected;
      if (shown.overlaid) decision.camera_from_patient = picture.camera_from_patient();
      log_->add(decision);
    }
  }
  grant(wishes);
}

/// What is on the screen, and no more than that: nothing goes out that no overlay was drawn by.
void LiveApp::publish(const ShownPicture& shown) {
  if (!publisher_ || !shown.overlaid) return;
  const LivePicture& picture = workflow_.picture();
  PublishedFrame frame;
  frame.exposed = picture.exposed();
  if (picture.setup()) frame.tracker_from_patient = picture.setup()->tracker_from_patient();
  frame.camera_from_patient = picture.camera_from_patient();
  publisher_->show(frame);
}

PanelWishes LiveApp::draw_window(const ShownPicture& shown, bool again) {
  if (shown.any && shown.changes != drawn_changes_) {
    window_->set_picture(LiveWindow::Slot::video, {*shown.rgb, shown.width_px, shown.height_px});
    drawn_changes_ = shown.changes;
  }
  window_->begin_frame(again);
  facts_.frames_skipped = workflow_.picture().frames_skipped();
  PanelWishes wishes = draw_panels(*window_, operation_, shown, facts_);
  window_->end_frame();
  return wishes;
}

/// What a key of the script asks for comes on top of what a hand asks for.
PanelWishes LiveApp::with_scripted(PanelWishes wishes) {
  for (const std::string& key : scripted_) add_key(key, operation_, facts_, wishes);
  if (place_) {
    SliceView view = wishes.slice_view.value_or(*facts_.slices);
    view.go_to(*place_);
    wishes.slice_view = view;
  }
  scripted_.clear();
  place_.reset();
  return wishes;
}

void LiveApp::grant(const PanelWishes& asked) {
  const PanelWishes wishes = with_scripted(asked);
  const bool begins = wishes.primary && operation_.step == LiveStep::connect && !operation_.frozen;
  if (wishes.retry || begins) source_->retry();
  if (wishes.primary) workflow_.primary(host_now());
  if (wishes.next) workflow_.go_on();
  if (wishes.cancel) workflow_.cancel_matching();
  if (wishes.undo) workflow_.undo();
  if (wishes.take_back) workflow_.take_back(*wishes.take_back);
  if (wishes.stroke) workflow_.stroke();
  if (wishes.turn_rod_deg) workflow_.turn_rod(*wishes.turn_rod_deg);
  if (wishes.freeze) workflow_.freeze_or_let_go();
  if (wishes.hide_or_show) workflow_.hide_or_show_overlay();
  if (wishes.step) workflow_.go_to(*wishes.step);
  if (wishes.inset) facts_.inset = !facts_.inset;
  if (wishes.details) facts_.details = !facts_.details;
  if (wishes.large_slices) facts_.large_slices = !facts_.large_slices;
  if (wishes.keys) facts_.keys = !facts_.keys;
  if (wishes.room) window_->set_room(facts_.room = *wishes.room);
  if (wishes.inset_corner) facts_.inset_corner = *wishes.inset_corner;
  grant_look(wishes);
  grant_slices(wishes);
  if (wishes.transfer) {
    workflow_.set_transfer(TransferFunction(*wishes.transfer));
    facts_.preset_changed = true;
  }
  if (const auto preset = load_transfer_function(wishes.preset); !wishes.preset.empty() && preset) {
    workflow_.set_transfer(*preset);
    editor_.set_points(preset->points());
    facts_.preset = wishes.preset;
    facts_.preset_changed = false;
  }
  if (wishes.snapshot && shot_.empty()) ask_for_shot(next_snapshot());
}

void LiveApp::grant_look(const PanelWishes& wishes) {
  if (wishes.look) facts_.look = *wishes.look;
  if (wishes.clip) facts_.clip = *wishes.clip;
  if (wishes.plane) facts_.plane = *wishes.plane;
  if ((wishes.clip || wishes.plane) && operation_.patient != nullptr) {
    facts_.look.render.clip.reset();
    if (facts_.clip) facts_.look.render.clip = clip_plane(facts_.plane, operation_.patient->shown);
  }
  if (wishes.look || wishes.clip || wishes.plane) workflow_.set_look(facts_.look);
}

void LiveApp::grant_slices(const PanelWishes& wishes) {
  if (wishes.slices && facts_.slices) {
    facts_.slices.reset();
  } else if (const auto& patient = operation_.patient; wishes.slices && patient) {
    facts_.slices.emplace(std::shared_ptr<const Volume>(patient, &patient->ct));
    if (const auto place_mm = first_place_mm(operation_)) facts_.slices->go_to(*place_mm);
    slices_changed_ = true;
  }
  if (!facts_.slices) return;
  if (wishes.slice_view) {
    facts_.slices = *wishes.slice_view;
    slices_changed_ = true;
  }
  const Eigen::Vector3d& place_mm = facts_.slices->place_mm();
  if (wishes.pick_marker) workflow_.pick(PlacePicks::Kind::fiducial, place_mm);
  if (wishes.pick_landmark) workflow_.pick(PlacePicks::Kind::landmark, place_mm);
  if (wishes.drop_marker) workflow_.drop_marker(place_mm);
}

Result<bool> LiveApp::follow_script() {
  // One after the other, as a hand would.
  if (!script_ || !scripted_.empty() || place_ || !shot_.empty() || saving_.running()) return false;
  const auto act = script_->next(workflow_.view(), host_now());
  if (!act) return act.error();
  if (!act->key.empty()) scripted_.push_back(act->key);
  if (act->place_mm) {
    if (!facts_.slices) return Error{Errc::bad_value, "the script points at the slices, which are closed: key v first"};
    place_ = act->place_mm;
  }
  if (!act->shot.empty()) ask_for_shot(act->shot);
  return act->end;
}

void LiveApp::ask_for_shot(std::filesystem::path path) {
  shot_ = std::move(path);
  shot_asked_ = host_now();
}

/// A snapshot waits for the next frame: on a slow machine the frame on the screen has grown too old for an overlay.
/// Where no frame comes, the snapshot is of the window as it is.
bool LiveApp::shot_due(HostTime now) const {
  constexpr Duration kPatience = Duration::from_ms(500);
  if (shot_.empty()) return false;
  const auto& frame = workflow_.picture().frame();
  return (frame && frame->info.sequence != drawn_sequence_) || now - shot_asked_ > kPatience;
}

/// The window as it is, and in a folder of the same name the picture with all that it was made of. Written on a thread
/// of its own: the picture on the screen must not stand still meanwhile.
void LiveApp::snapshot(const std::filesystem::path& path, const ShownPicture& shown) {
  if (saving_.running()) return;
  std::optional<Snapshot> parts;
  const LivePicture& picture = workflow_.picture();
  if (picture.frame() && shown.any) {
    parts.emplace();
    parts->frame = *picture.frame();
    parts->picture = *shown.rgb;
    parts->shown = shown;
    parts->shown.rgb = nullptr;
    if (operation_.frozen) parts->shown.reason = "frozen";
    parts->taken_with = workflow_.taken_with();
    parts->setup = picture.setup();
    parts->camera_from_patient = picture.camera_from_patient();
    parts->look = picture.look();
    parts->engine = operation_.engine_asked;
    parts->transfer = operation_.drawn_by;
    parts->patient = operation_.patient_files;
    parts->deformed = operation_.deformed;
    parts->fre_mm = operation_.fre_mm;
    parts->not_signed = operation_.not_signed;
    if (identify_ && operation_.patient) parts->identity = operation_.patient->identity;
  }
  saving_.start([path, shot = window_->shot(), parts = std::move(parts)](const std::stop_token&, const auto&) {
    auto written = write_file(path, png_of(RgbView{shot.rgb, shot.width_px, shot.height_px}));
    auto folder = path;
    if (written && parts) written = write_snapshot(folder.replace_extension(), *parts);
    return written ? "snapshot: " + path.string() : written.error().what;
  });
  shot_.clear();
}

/// Of snapshots that are there already, none is written over.
std::filesystem::path LiveApp::next_snapshot() {
  const std::filesystem::path folder = log_ ? log_->folder() : ".";
  std::error_code ignored;
  for (;;) {
    auto path = folder / fmt::format("snapshot-{:03}.png", ++shots_);
    if (!std::filesystem::exists(path, ignored)) return path;
  }
}

}  // namespace birdseye::host
