// What the side of the window shows of each step.
#include <fmt/format.h>

#include <array>

#include "host/guide/guide_words.hpp"
#include "host/operation/step_states.hpp"
#include "host/texts/texts.hpp"
#include "host/window/panel_context.hpp"

namespace birdseye::host {

namespace {

const Eigen::Vector3f& done_or_not(const PanelContext& context, LiveStep step) {
  return context.operation.note(step).holds() ? context.theme.good : context.theme.warn;
}

void draw_connect(PanelContext& context) {
  const Theme& theme = context.theme;
  const LinkState& link = context.operation.link;
  say(link.connected ? theme.good : theme.warn, link.words);
  for (const std::string& words : {link.appliance_says, link.appliance_notes})
    if (!words.empty()) say(theme.warn, words);
  if (link.may_retry) say(theme.warn, words("retry"));
  if (!link.health) return;
  for (const wire::InstrumentHealth& one : link.health->instruments) {
    const bool runs = one.state == "running";
    say(runs ? theme.good : theme.warn,
        fmt::format("{} {}", runs ? kGoodSign : kWarnSign, words("instrument", one.name, one.state)));
    if (!runs && !one.text.empty()) say(theme.quiet, one.text);
  }
}

/// A row of small squares, filled where something is covered.
template <std::size_t N>
void draw_cells(const PanelContext& context, const std::array<bool, N>& cells, std::size_t columns) {
  const float size = 16 * context.at.scale;
  ImDrawList* const list = ImGui::GetWindowDrawList();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  for (std::size_t i = 0; i < N; ++i) {
    const std::size_t row = i / columns;
    const ImVec2 from(at.x + static_cast<float>(i % columns) * size, at.y + static_cast<float>(row) * size);
    const ImVec2 to(from.x + size - 2, from.y + size - 2);
    if (cells[i]) list->AddRectFilled(from, to, ImGui::GetColorU32(colour(context.theme.good)));
    list->AddRect(from, to, ImGui::GetColorU32(colour(context.theme.quiet)));
  }
  const std::size_t rows = (N + columns - 1) / columns;
  ImGui::Dummy(ImVec2(static_cast<float>(columns) * size, static_cast<float>(rows) * size));
}

void draw_guide(PanelContext& context, const GuideState& guide) {
  const Theme& theme = context.theme;
  say(theme.text, guide.next);
  ImGui::Separator();
  say(theme.quiet, words("stations_taken", guide.stations));
  say(theme.quiet, words("covered_picture"));
  draw_cells(context, guide.coverage.cells, calibration::Coverage::kColumns);
  say(theme.quiet, words("covered_tilts"));
  draw_cells(context, guide.coverage.tilts, calibration::Coverage::kSectors);
  say(theme.quiet, words("covered_turns"));
  draw_cells(context, guide.coverage.turns, calibration::Coverage::kTurns);
  if (guide.held_out_mm)
    say(colour_of(guide.grade, theme), words("held_out_so_far", words_of(guide.grade), *guide.held_out_mm));
  if (const auto& lines = context.operation.guide_lines; !lines.empty()) say(theme.quiet, lines.back());
}

void draw_calibrate(PanelContext& context) {
  const OperationView& operation = context.operation;
  const Theme& theme = context.theme;
  if (operation.guide) return draw_guide(context, *operation.guide);
  say(done_or_not(context, LiveStep::calibrate), operation.note(LiveStep::calibrate).line);
  if (const auto& verdict = operation.calibration_verdict) {
    const Grade grade = verdict->grade;
    say(colour_of(grade, theme), fmt::format("{} {}", sign_of(grade), words("verdict", words_of(grade))));
    for (const std::string& reason : verdict->reasons) say(theme.quiet, reason);
    for (const std::string& next : verdict->next_steps) say(theme.text, next);
  }
  if (!operation.board_named && !operation.note(LiveStep::calibrate).done) say(theme.warn, words("no_board"));
}

void draw_slice_buttons(PanelContext& context) {
  const std::string label = label_of(context.facts.slices ? words("slices_close") : words("slices"), "slices");
  if (ImGui::Button(label.c_str())) context.wishes.slices = true;
  if (!context.operation.pick_line.empty()) say(context.theme.text, context.operation.pick_line);
}

/// How one touch fits, in words, and in millimetres among the details; and the button that takes it back.
void draw_touch(PanelContext& context, std::size_t i) {
  const OperationView& operation = context.operation;
  const Theme& theme = context.theme;
  const TouchedFiducial& touch = operation.touches[i];
  const bool details = context.facts.details;
  ImGui::BeginGroup();
  if (operation.odd_touch == i) {
    say(theme.bad, fmt::format("{} {}", kBadSign, words("touch_odd", i + 1)));
  } else if (operation.odd_touch || !touch.residual_mm) {
    // Beside one that is off, residuals tell nothing of the others: the fit spreads its error over all.
    say(theme.text, words("touch_taken", i + 1));
  } else {
    const Grade grade = *touch.residual_mm < kGoodFit_mm      ? Grade::pass
                        : *touch.residual_mm < kPlainlyOff_mm ? Grade::marginal
                                                              : Grade::fail;
    const std::string how = grade == Grade::pass ? words("touch_fits", i + 1) : words("touch_fits_poorly", i + 1);
    say(colour_of(grade, theme), fmt::format("{} {}", sign_of(grade), how));
  }
  ImGui::EndGroup();
  ImGui::SameLine();
  ImGui::PushID(static_cast<int>(i));
  if (ImGui::SmallButton(label_of(words("take_back"), "take back").c_str())) context.wishes.take_back = i;
  ImGui::PopID();
  if (details && touch.residual_mm) say(theme.quiet, words("touch_residual", i + 1, *touch.residual_mm));
  if (details && !touch.residual_mm) say(theme.quiet, words("touch_scatter", i + 1, touch.rms_mm));
}

/// What is wrong with touches that fit poorly, and what to do.
void draw_fit(const PanelContext& context) {
  constexpr std::size_t kTellsOne = 4;  // touches: of three, none can be left out
  const OperationView& operation = context.operation;
  if (!operation.fits_poorly) return;
  const Theme& theme = context.theme;
  if (const auto& odd = operation.odd_touch)
    return say(theme.bad, fmt::format("{} {}", kBadSign, words("odd_touch", *odd + 1)));
  const bool few = operation.touches.size() < kTellsOne;
  say(theme.warn, fmt::format("{} {}", kWarnSign, few ? words("odd_touch_too_few") : words("odd_touch_unknown")));
}

void draw_fiducials(PanelContext& context) {
  const OperationView& operation = context.operation;
  const Theme& theme = context.theme;
  if (!operation.simulated) say(theme.text, words("touch_each"));
  if (!operation.markers_seen) {
    if (operation.patient != nullptr) say(theme.quiet, words("markers_searched"));
  } else if (operation.fiducials_wanted != 0) {
    say(theme.quiet, words("markers_wanted", *operation.markers_seen, operation.fiducials_wanted));
  } else {
    say(theme.quiet, words("markers_seen", *operation.markers_seen));
  }
  draw_slice_buttons(context);
  for (std::size_t i = 0; i < operation.touches.size(); ++i) draw_touch(context, i);
  if (const auto& fre = operation.fre_mm; fre && context.facts.details) say(theme.quiet, words("fre", *fre));
  if (!operation.registration_fault.empty())
    say(theme.bad, fmt::format("{} {}", kBadSign, operation.registration_fault));
  draw_fit(context);
  if (!operation.touches.empty()) say(theme.quiet, words("undo_touch"));
  if (operation.touch_loses.empty()) return;
  if (operation.asked_to_take_back) {
    say(theme.bad, fmt::format("{} {}", kBadSign, words("touch_loses_asked", operation.touch_loses)));
  } else {
    say(theme.warn, fmt::format("{} {}", kWarnSign, words("touch_loses", operation.touch_loses)));
  }
}

/// From where the next view would tell most; empty: from nowhere else.
std::string words_of(const ViewAdvice& advice) {
  if (!advice.look_from_deg) return {};
  const double right = advice.look_from_deg->x(), down = advice.look_from_deg->y();
  const std::string across = right > 0 ? words("advice_right", right) : words("advice_left", -right);
  const std::string along = down > 0 ? words("advice_lower", down) : words("advice_upper", -down);
  if (down == 0) return words("advice_from", across);
  return right == 0 ? words("advice_from", along) : words("advice_from_both", across, along);
}

void draw_views(PanelContext& context) {
  const OperationView& operation = context.operation;
  const Theme& theme = context.theme;
  say(theme.text, words("keep_views"));
  say(theme.quiet, operation.note(LiveStep::views).line);
  const std::string stroke = label_of(operation.stroking ? words("stroke_end") : words("stroke_begin"), "stroke");
  if (ImGui::Button(stroke.c_str())) context.wishes.stroke = true;
  if (!operation.stroke_line.empty()) say(operation.stroking ? theme.good : theme.warn, operation.stroke_line);
  const auto& advice = operation.view_advice;
  if (!advice) return;  // why no view can be kept stands above
  const std::string from = words_of(*advice);
  if (!from.empty()) say(theme.text, from);
  if (from.empty() && operation.primary_refused.empty()) say(theme.text, words("advice_here"));
  if (context.facts.details) say(theme.quiet, words("view_gain", 100 * advice->gain_now, 100 * advice->gain_best));
  say(theme.quiet, words("undo_view"));
}

}  // namespace

std::vector<std::string> deformation_words(const OperationView& operation) {
  std::vector<std::string> out;
  if (operation.deformed == nullptr) return out;
  if (operation.target_moved_mm) out.push_back(words("deform_moved", *operation.target_moved_mm));
  const auto& error = operation.deformed->target;
  out.push_back(error ? words("deform_error", error->radius95_mm) : words("deform_error_unknown"));
  return out;
}

namespace {

void draw_deform(PanelContext& context) {
  const OperationView& operation = context.operation;
  const Theme& theme = context.theme;
  if (!operation.deformed && !operation.deforming) say(theme.text, words("match_views"));
  const StepNote& note = operation.note(LiveStep::deform);
  if (operation.deformed && !operation.deformed_with_care && !context.facts.details) {
    say(theme.good, fmt::format("{} {}", kGoodSign, words("deform_found")));
  } else {
    say(!note.done ? theme.quiet : !note.holds() || operation.deformed_with_care ? theme.warn : theme.good, note.line);
  }
  if (operation.deforming) {
    if (!operation.deform_progress.empty()) say(theme.text, operation.deform_progress);
    if (ImGui::Button(label_of(words("cancel_match"), "cancel").c_str())) context.wishes.cancel = true;
  }
  if (!operation.deformed) return;
  for (const std::string& line : deformation_words(operation)) say(theme.text, line);
  say(theme.quiet, words("undo_deform"));
}

void draw_check(PanelContext& context) {
  const Theme& theme = context.theme;
  say(theme.text, context.operation.simulated ? words("point_simulated") : words("point_at_landmark"));
  draw_slice_buttons(context);
  const auto& reading = context.operation.check;
  if (!reading) return say(theme.warn, fmt::format("{} {}", kWarnSign, words("no_pointer")));
  const Eigen::Vector3d& tip = reading->tip_in_patient_mm;
  if (context.facts.details) say(theme.quiet, words("tip_at", tip.x(), tip.y(), tip.z()));
  if (reading->nearest.empty()) return;
  // In doubt a fitted place tells as much as another.
  if (reading->fitted && !context.operation.unconfirmed)
    return say(theme.warn, words("from_fitted", reading->distance_mm, reading->nearest));
  say(reading->distance_mm < 3 ? theme.good : theme.text,
      words("from_nearest", reading->distance_mm, reading->nearest));
}

}  // namespace

void draw_patient_card(PanelContext& context) {
  const Theme& theme = context.theme;
  const OperationView& operation = context.operation;
  const auto& plan = operation.patient;
  if (plan == nullptr) {
    say(theme.quiet, words("patient_none"));
  } else if (context.facts.pseudonymised) {
    constexpr std::size_t kShort = 8;
    say(theme.quiet, words("patient_pseudonym", plan->ct_sha256.substr(0, kShort)));
  } else {
    const PatientIdentity& who = plan->identity;
    say(theme.text, who.known() ? words("patient_name", who.name) : words("patient_no_name"));
    std::string line = who.id.empty() ? "" : words("patient_id", who.id);
    if (!who.birth_date.empty()) line += (line.empty() ? "" : ", ") + words("patient_born", who.birth_date);
    if (!line.empty()) say(theme.text, line);
    say(theme.text, who.ct_date.empty() ? words("patient_no_ct_date") : words("patient_ct_date", who.ct_date));
    if (!who.known()) say(theme.quiet, words("patient_file", operation.patient_files.ct.path.filename().string()));
    if (operation.patient_confirmed) say(theme.good, fmt::format("{} {}", kGoodSign, words("patient_confirmed")));
  }
  if (plan != nullptr && operation.asks_for_patient) {
    for (const std::string& note : plan->notes) say(theme.quiet, note);
  }
  if (!operation.patient_fault.empty() && !context.facts.pseudonymised) {
    say(theme.bad, fmt::format("{} {}", kBadSign, operation.patient_fault));
  } else if (operation.asks_for_instruments) {
    say(theme.warn, fmt::format("{} {}", kWarnSign, words("instruments_ask")));
  } else if (operation.asks_for_patient) {
    say(theme.warn, fmt::format("{} {}", kWarnSign, words("patient_ask")));
  }
  ImGui::Separator();
}

void draw_step(PanelContext& context) {
  switch (context.operation.step) {
    case LiveStep::connect:
      return draw_connect(context);
    case LiveStep::calibrate:
      return draw_calibrate(context);
    case LiveStep::fiducials:
      return draw_fiducials(context);
    case LiveStep::views:
      return draw_views(context);
    case LiveStep::deform:
      return draw_deform(context);
    case LiveStep::check:
      return draw_check(context);
    case LiveStep::run:
      return draw_look(context);
  }
}

}  // namespace birdseye::host
