#include "host/window/live_panels.hpp"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>

#include "host/window/inset_view.hpp"

namespace birdseye::host {

namespace {

constexpr float kSidePx = 330, kStripPx = 118;
const ImVec4 kGood(0.45F, 0.80F, 0.45F, 1), kWarn(0.96F, 0.74F, 0.30F, 1), kBad(0.96F, 0.38F, 0.34F, 1);
const ImVec4 kQuiet(0.62F, 0.66F, 0.70F, 1), kText(0.92F, 0.93F, 0.94F, 1);
// Without a background of its own: the window's is drawn at once, which a driver in software is glad of.
constexpr ImGuiWindowFlags kPanel = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                                    ImGuiWindowFlags_NoBackground;

struct PanelLayout {
  float wide, high, side, strip, scale;
};

ImVec4 colour_of(Grade grade) {
  return grade == Grade::pass ? kGood : grade == Grade::marginal ? kWarn : kBad;
}

/// ImGui carries OpenGL's names as pointers.
ImTextureID texture(std::uintptr_t name) {
  return reinterpret_cast<ImTextureID>(name);  // NOLINT(performance-no-int-to-ptr)
}

void say(const ImVec4& colour, const std::string& text) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour);
  ImGui::PushTextWrapPos(0);
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::PopStyleColor();
}

void draw_steps(const OperationView& operation, PanelWishes& wishes) {
  for (std::size_t i = 0; i < kLiveSteps; ++i) {
    const auto step = static_cast<LiveStep>(i);
    const bool here = operation.step == step, done = operation.note(step).done;
    ImGui::PushStyleColor(ImGuiCol_Text, here ? kText : done ? kGood : kQuiet);
    const std::string label = fmt::format("{}  {} {}", i + 1, name_of(step), done ? "(done)" : "");
    if (ImGui::Selectable(label.c_str(), here)) wishes.step = step;
    ImGui::PopStyleColor();
  }
}

void draw_connect(const OperationView& operation) {
  say(operation.link.connected ? kGood : kWarn, operation.link.words);
  if (!operation.link.appliance_says.empty()) say(kWarn, operation.link.appliance_says);
  const auto& health = operation.link.health;
  if (!health) return;
  for (const wire::InstrumentHealth& one : health->instruments) {
    say(one.state == "running" ? kGood : kWarn, fmt::format("{}: {}", one.name, one.state));
    if (one.state != "running" && !one.text.empty()) say(kQuiet, one.text);
  }
}

/// A row of small squares, filled where something is covered.
template <std::size_t N>
void draw_cells(const std::array<bool, N>& cells, std::size_t columns, float size) {
  ImDrawList* const list = ImGui::GetWindowDrawList();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  for (std::size_t i = 0; i < N; ++i) {
    const std::size_t row = i / columns;
    const ImVec2 from(at.x + static_cast<float>(i % columns) * size, at.y + static_cast<float>(row) * size);
    const ImVec2 to(from.x + size - 2, from.y + size - 2);
    if (cells[i]) list->AddRectFilled(from, to, ImGui::GetColorU32(kGood));
    list->AddRect(from, to, ImGui::GetColorU32(kQuiet));
  }
  const std::size_t rows = (N + columns - 1) / columns;
  ImGui::Dummy(ImVec2(static_cast<float>(columns) * size, static_cast<float>(rows) * size));
}

void draw_calibrate(const OperationView& operation, float scale) {
  if (const auto& guide = operation.guide) {
    say(kText, guide->next);
    ImGui::Separator();
    say(kQuiet, fmt::format("{} stations taken", guide->stations));
    say(kQuiet, "of the picture");
    draw_cells(guide->coverage.cells, calibration::Coverage::kColumns, 16 * scale);
    say(kQuiet, "tilts: small above, large below");
    draw_cells(guide->coverage.tilts, calibration::Coverage::kSectors, 16 * scale);
    say(kQuiet, "turns about the scope's length");
    draw_cells(guide->coverage.turns, calibration::Coverage::kTurns, 16 * scale);
    if (guide->held_out_mm) {
      say(colour_of(guide->grade),
          fmt::format("so far {}: {:.2f} mm held out", name_of(guide->grade), *guide->held_out_mm));
    }
    if (!operation.guide_lines.empty()) say(kQuiet, operation.guide_lines.back());
    return;
  }
  say(operation.note(LiveStep::calibrate).done ? kGood : kWarn, operation.note(LiveStep::calibrate).line);
  if (const auto& verdict = operation.calibration_verdict) {
    say(colour_of(verdict->grade), fmt::format("verdict: {}", name_of(verdict->grade)));
    for (const std::string& reason : verdict->reasons) say(kQuiet, reason);
    for (const std::string& next : verdict->next_steps) say(kText, next);
  }
  if (!operation.board_named && !operation.note(LiveStep::calibrate).done)
    say(kWarn, "no board is named: start with --board, or give the appliance the scope's record");
}

void draw_fiducials(const OperationView& operation, bool simulated) {
  say(kText, simulated ? "the simulated operator touches each fiducial with the pointer: wait"
                       : "touch each fiducial with the pointer, and rest there for half a second");
  if (operation.markers_seen) {
    say(kQuiet,
        fmt::format("the CT shows {}{}", *operation.markers_seen,
                    operation.fiducials_wanted != 0 ? fmt::format("; {} are wanted", operation.fiducials_wanted) : ""));
  } else if (operation.patient != nullptr) {
    say(kQuiet, "markers are looked for in the CT");
  }
  for (std::size_t i = 0; i < operation.touches.size(); ++i) {
    const TouchedFiducial& touch = operation.touches[i];
    if (touch.residual_mm) {
      const Grade grade = *touch.residual_mm < 2 ? Grade::pass : *touch.residual_mm < 5 ? Grade::marginal : Grade::fail;
      say(colour_of(grade), fmt::format("{}: residual {:.2f} mm", i + 1, *touch.residual_mm));
    } else {
      say(kQuiet, fmt::format("{}: touched, scatter {:.2f} mm", i + 1, touch.rms_mm));
    }
  }
  if (const auto& fre = operation.fre_mm) say(*fre < 2 ? kGood : kWarn, fmt::format("FRE {:.2f} mm", *fre));
  if (!operation.registration_fault.empty()) say(kBad, operation.registration_fault);
  say(kQuiet, "Backspace takes the last one back");
}

void draw_views(const OperationView& operation, PanelWishes& wishes) {
  say(kText, "keep five views or more of the organ, from different sides; or go on without (Enter)");
  say(kQuiet, operation.note(LiveStep::views).line);
  if (ImGui::Button(operation.stroking ? "end the stroke (T)###stroke"
                                       : "stroke the organ with the pointer (T)###stroke"))
    wishes.stroke = true;
  if (!operation.stroke_line.empty()) say(operation.stroking ? kGood : kWarn, operation.stroke_line);
  const auto& advice = operation.view_advice;
  if (!advice) return say(kWarn, "no overlay now: a view cannot be kept");
  say(advice->words == "keep this view" ? kGood : kText, advice->words);
  say(kQuiet, fmt::format("this view would shrink what is open by {:.0f} %, the best in reach by {:.0f} %",
                          100 * advice->gain_now, 100 * advice->gain_best));
  say(kQuiet, "Backspace takes the last view or stroke back");
}

void draw_deform(const OperationView& operation) {
  say(kText, "match the CT with the kept views, or go on without (Enter)");
  say(operation.note(LiveStep::deform).done ? kGood : kQuiet, operation.note(LiveStep::deform).line);
  if (operation.deforming) say(kText, operation.deform_progress);
  if (operation.deformed) say(kQuiet, "Backspace undoes it");
}

void draw_check(const OperationView& operation, bool simulated) {
  say(kText, simulated ? "nobody points at anything over the simulated cart: go on"
                       : "point at a landmark, and hold the pointer's tip to it: the distance below should be near 0");
  const auto& reading = operation.check;
  if (!reading) return say(kWarn, "no pointer is seen, or the patient is not registered");
  const Eigen::Vector3d& tip = reading->tip_in_patient_mm;
  say(kQuiet, fmt::format("the tip is at ({:.1f}, {:.1f}, {:.1f}) mm of the CT", tip.x(), tip.y(), tip.z()));
  if (!reading->nearest.empty())
    say(reading->distance_mm < 3 ? kGood : kText,
        fmt::format("{:.1f} mm from {}", reading->distance_mm, reading->nearest));
}

void draw_plane(const PanelFacts& facts, PanelWishes& wishes) {
  bool clip = facts.clip;
  if (ImGui::Checkbox("cutting plane (C)", &clip)) wishes.clip = clip;
  if (!clip) return;
  CuttingPlane plane = facts.plane;
  constexpr std::array<const char*, 3> kAxes{"left to right", "front to back", "feet to head"};
  bool changed = ImGui::Combo("##axis", &plane.axis, kAxes.data(), static_cast<int>(kAxes.size()));
  float part = static_cast<float>(plane.part);
  ImGui::SetNextItemWidth(-1);
  changed = ImGui::SliderFloat("##part", &part, 0, 1, "at %.2f of the CT") || changed;
  plane.part = part;
  if (changed) wishes.plane = plane;
}

void draw_run(const OperationView& operation, const PanelFacts& facts, TransferEditor& editor, float scale,
              PanelWishes& wishes) {
  float opacity = static_cast<float>(facts.opacity);
  ImGui::SetNextItemWidth(-80 * scale);
  if (ImGui::SliderFloat("opacity", &opacity, 0, 1, "%.2f")) wishes.opacity = opacity;
  bool in_front = facts.surface_in_front;
  if (ImGui::Checkbox("surface in front (G)", &in_front)) wishes.surface_in_front = in_front;
  draw_plane(facts, wishes);
  ImGui::SetNextItemWidth(-80 * scale);
  if (ImGui::BeginCombo("colours", "presets")) {
    for (const std::string& name : transfer_presets()) {
      if (ImGui::Selectable(name.c_str())) wishes.preset = name;
    }
    ImGui::EndCombo();
  }
  if (facts.histogram != nullptr) wishes.transfer = editor.draw(*facts.histogram, scale);
  if (operation.frozen) say(kWarn, "frozen: this is no live picture");
  if (ImGui::Button("snapshot (S)")) wishes.snapshot = true;
}

void draw_side(const PanelLayout& at, const OperationView& operation, const PanelFacts& facts, TransferEditor& editor,
               PanelWishes& wishes) {
  ImGui::SetNextWindowPos(ImVec2(0, 0));
  ImGui::SetNextWindowSize(ImVec2(at.side, at.high));
  ImGui::Begin("workflow", nullptr, kPanel);
  draw_steps(operation, wishes);
  ImGui::Separator();
  ImGui::Spacing();
  switch (operation.step) {
    case LiveStep::connect:
      draw_connect(operation);
      break;
    case LiveStep::calibrate:
      draw_calibrate(operation, at.scale);
      break;
    case LiveStep::fiducials:
      draw_fiducials(operation, facts.simulated);
      break;
    case LiveStep::views:
      draw_views(operation, wishes);
      break;
    case LiveStep::deform:
      draw_deform(operation);
      break;
    case LiveStep::check:
      draw_check(operation, facts.simulated);
      break;
    case LiveStep::run:
      draw_run(operation, facts, editor, at.scale, wishes);
      break;
  }
  const float button = 44 * at.scale;
  ImGui::SetCursorPosY(std::max(ImGui::GetCursorPosY() + 8, at.high - button - 74 * at.scale));
  if (ImGui::Button((primary_words(operation) + "###primary").c_str(), ImVec2(-1, button))) wishes.primary = true;
  say(kQuiet, "Space or the pedal: this. Enter: go on. 1 to 7: a step. F: freeze.");
  ImGui::End();
}

/// The safety of the picture, in words and colour, over its upper edge.
void draw_banner(const ShownPicture& shown, const OperationView& operation, bool recorded, ImVec2 from, float wide,
                 float scale) {
  std::string text;
  ImVec4 colour = kGood;
  if (operation.frozen) {
    text = "FROZEN: this is no live picture";
    colour = kWarn;
  } else if (shown.stale || !shown.any) {
    text = shown.any ? "NOT LIVE: " + shown.reason : shown.reason;
    colour = kBad;
  } else if (shown.overlaid && shown.reason.empty()) {
    text = fmt::format("overlay; FRE {:.1f} mm", operation.fre_mm.value_or(0));
  } else {
    text = (shown.overlaid ? "overlay fades: " : "no overlay: ") + shown.reason;
    colour = kWarn;
  }
  if (recorded) text = "RECORDING, not live - " + text;
  ImDrawList* const list = ImGui::GetWindowDrawList();
  const float high = 28 * scale;
  list->AddRectFilled(from, ImVec2(from.x + wide, from.y + high), IM_COL32(0, 0, 0, 190));
  list->AddRectFilled(from, ImVec2(from.x + 6 * scale, from.y + high), ImGui::GetColorU32(colour));
  list->AddText(ImVec2(from.x + 14 * scale, from.y + 5 * scale), ImGui::GetColorU32(colour), text.c_str());
}

/// Where the target is drawn, and how far from there it may be.
void draw_target(const TargetMark& mark, ImVec2 corner, float fit, float scale) {
  ImDrawList* const list = ImGui::GetWindowDrawList();
  const ImVec2 middle(corner.x + fit * static_cast<float>(mark.at_px.x() + 0.5),
                      corner.y + fit * static_cast<float>(mark.at_px.y() + 0.5));
  const float radius = fit * static_cast<float>(mark.radius_px);
  const ImU32 colour = ImGui::GetColorU32(mark.motion_counted ? kGood : kWarn);
  list->AddCircle(middle, radius, IM_COL32(0, 0, 0, 160), 0, 3.5F * scale);
  list->AddCircle(middle, radius, colour, 0, 1.5F * scale);
  const std::string text =
      fmt::format("+-{:.1f} mm{}", mark.radius_mm, mark.motion_counted ? "" : ", if it has not moved since the CT");
  const ImVec2 wide = ImGui::CalcTextSize(text.c_str());
  const float beside = radius + 6 * scale, right = ImGui::GetWindowPos().x + ImGui::GetWindowSize().x;
  const bool fits = middle.x + beside + wide.x < right;
  const ImVec2 from(fits ? middle.x + beside : middle.x - beside - wide.x, middle.y - wide.y / 2);
  list->AddRectFilled(ImVec2(from.x - 3 * scale, from.y - 2 * scale),
                      ImVec2(from.x + wide.x + 3 * scale, from.y + wide.y + 2 * scale), IM_COL32(0, 0, 0, 150));
  list->AddText(from, colour, text.c_str());
}

void draw_video(const PanelLayout& at, const LiveWindow& window, const OperationView& operation,
                const ShownPicture& shown, bool recorded) {
  const ImVec2 size(at.wide - at.side, at.high - at.strip);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
  ImGui::SetNextWindowPos(ImVec2(at.side, 0));
  ImGui::SetNextWindowSize(size);
  ImGui::Begin("video", nullptr, kPanel | ImGuiWindowFlags_NoInputs);
  if (shown.any) {
    const float fit =
        std::min(size.x / static_cast<float>(shown.width_px), size.y / static_cast<float>(shown.height_px));
    const ImVec2 shape(fit * static_cast<float>(shown.width_px), fit * static_cast<float>(shown.height_px));
    ImGui::SetCursorPos(ImVec2((size.x - shape.x) / 2, (size.y - shape.y) / 2));
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    ImGui::Image(texture(window.picture(LiveWindow::Slot::video)), shape);
    if (operation.target && shown.overlaid) draw_target(*operation.target, corner, fit, at.scale);
  }
  draw_banner(shown, operation, recorded, ImVec2(at.side, 0), size.x, at.scale);
  if (const std::uintptr_t inset = window.picture(LiveWindow::Slot::inset); inset != 0) {
    const ImVec2 small(at.scale * InsetView::kWidthPx * 0.75F, at.scale * InsetView::kHeightPx * 0.75F);
    ImGui::SetCursorPos(ImVec2(size.x - small.x - 8 * at.scale, size.y - small.y - 8 * at.scale));
    ImGui::Image(texture(inset), small);
  }
  ImGui::End();
  ImGui::PopStyleVar();
}

void draw_strip(const PanelLayout& at, const OperationView& operation, const PanelFacts& facts) {
  ImGui::SetNextWindowPos(ImVec2(at.side, at.high - at.strip));
  ImGui::SetNextWindowSize(ImVec2(at.wide - at.side, at.strip));
  ImGui::Begin("strip", nullptr, kPanel);
  const std::vector<float> ages = facts.ages->newest();
  constexpr float kFullMs = 160;
  const ImVec2 chart((at.wide - at.side) * 0.52F, at.strip - 20 * at.scale);
  ImGui::PlotLines("##ages", ages.data(), static_cast<int>(ages.size()), 0,
                   fmt::format("up to {:.0f} ms", kFullMs).c_str(), 0, kFullMs, chart);
  ImGui::SameLine();
  ImGui::BeginGroup();
  say(kText, fmt::format("exposure to screen, ms: p50 {:.0f}  p95 {:.0f}  max {:.0f}", facts.ages->percentile_ms(0.5),
                         facts.ages->percentile_ms(0.95), facts.ages->most_ms()));
  say(kQuiet, fmt::format("{:.1f} frames/s, {} skipped; engine {}", facts.frames_per_s, facts.frames_skipped,
                          operation.engine_name));
  if (const auto& health = operation.link.health)
    say(kQuiet, fmt::format("tracker {:.0f} Hz, {} doubted", health->tracker_rate_hz, health->doubted));
  if (!operation.fault.empty()) say(kBad, operation.fault);
  if (!operation.surface_check.empty()) say(operation.organ_moved ? kWarn : kQuiet, operation.surface_check);
  if (!facts.said.empty()) say(kQuiet, facts.said);
  ImGui::EndGroup();
  ImGui::End();
}

}  // namespace

int side_px(float scale) {
  return static_cast<int>(kSidePx * scale);
}

void add_key(const std::string& key, const PanelFacts& facts, PanelWishes& wishes) {
  constexpr double kNotch = 0.1;
  if (key == "space") wishes.primary = true;
  if (key == "enter") wishes.next = true;
  if (key == "backspace") wishes.undo = true;
  if (key == "t") wishes.stroke = true;
  if (key == "f") wishes.freeze = true;
  if (key == "s") wishes.snapshot = true;
  if (key == "c") wishes.clip = !facts.clip;
  if (key == "g") wishes.surface_in_front = !facts.surface_in_front;
  if (key == "+") wishes.opacity = std::min(1.0, facts.opacity + kNotch);
  if (key == "-") wishes.opacity = std::max(0.0, facts.opacity - kNotch);
  if (key.size() == 1 && key[0] >= '1' && key[0] < static_cast<char>('1' + kLiveSteps))
    wishes.step = static_cast<LiveStep>(key[0] - '1');
}

PanelWishes draw_panels(const LiveWindow& window, const OperationView& operation, const ShownPicture& shown,
                        const PanelFacts& facts, TransferEditor& editor) {
  PanelWishes wishes;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float scale = window.scale();
  const PanelLayout at{size.x, size.y, kSidePx * scale, kStripPx * scale, scale};
  draw_side(at, operation, facts, editor, wishes);
  draw_video(at, window, operation, shown, facts.recorded);
  draw_strip(at, operation, facts);
  for (const std::string& key : window.keys()) add_key(key, facts, wishes);
  return wishes;
}

}  // namespace birdseye::host
