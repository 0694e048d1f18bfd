#include "host/window/live_panels.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>

#include "host/texts/texts.hpp"
#include "host/window/banner.hpp"
#include "host/window/line_breaks.hpp"
#include "host/window/panel_context.hpp"

namespace birdseye::host {

namespace {

constexpr float kSidePx = 330, kStripPx = 72, kFiguresPx = 216;  // the strip, and with all figures in it

void draw_steps(PanelContext& context) {
  constexpr std::array<TextKey<0>, kLiveSteps> kNames{"step_connect", "step_calibrate", "step_fiducials", "step_views",
                                                      "step_deform",  "step_check",     "step_run"};
  const Theme& theme = context.theme;
  for (std::size_t i = 0; i < kLiveSteps; ++i) {
    const auto step = static_cast<LiveStep>(i);
    const StepNote& note = context.operation.note(step);
    // That the video stands still, the line over the picture says.
    const bool stands = step == LiveStep::run && note.done && context.shown.stale;
    const bool here = context.operation.step == step, doubted = stands || !note.doubt.empty();
    const Eigen::Vector3f& told = doubted ? theme.warn : note.done ? theme.good : theme.quiet;
    ImGui::PushStyleColor(ImGuiCol_Text, colour(here && !doubted ? theme.text : told));
    const char* const sign = doubted ? kWarnSign : note.done ? kGoodSign : "";
    const std::string label = fmt::format("{}  {} {}###step{}", i + 1, words(kNames[i]), sign, i);
    if (ImGui::Selectable(label.c_str(), here)) context.wishes.step = step;
    ImGui::PopStyleColor();
  }
  for (const std::string& why : doubts_of(context.operation)) say(theme.warn, fmt::format("{} {}", kWarnSign, why));
}

void draw_side(PanelContext& context) {
  const PanelLayout& at = context.at;
  const float button = 44 * at.scale, below = button + 62 * at.scale;
  ImGui::SetNextWindowPos(ImVec2(0, 0));
  ImGui::SetNextWindowSize(ImVec2(at.side, at.high));
  ImGui::Begin("workflow", nullptr, kPanel);
  draw_patient_card(context);
  draw_steps(context);
  ImGui::Separator();
  // What is longer than the window is high can be scrolled; the button stays where it is.
  ImGui::BeginChild("step", ImVec2(0, std::max(40 * at.scale, at.high - ImGui::GetCursorPosY() - below)), false,
                    ImGuiWindowFlags_NoBackground);
  if (context.facts.keys) say(context.theme.text, words("all_keys"));
  if (const std::string& why = context.operation.primary_refused; !why.empty())
    say(context.theme.warn, fmt::format("{} {}", kWarnSign, why));
  draw_step(context);
  ImGui::EndChild();
  ImGui::SetCursorPosY(at.high - below);
  const std::string primary = label_of(primary_words(context.operation), "primary");
  const bool waits = !context.operation.primary_refused.empty();
  ImGui::BeginDisabled(waits);
  if (ImGui::Button(primary.c_str(), ImVec2(-1, button))) context.wishes.primary = true;
  ImGui::EndDisabled();
  say(context.theme.quiet, words("keys"));
  ImGui::End();
}

/// How old the pictures were when they came to the screen. What it is and what its axes are stand above and below it,
/// for a line through them hides both.
void draw_ages(const PanelContext& context) {
  constexpr float kFullMs = 160;
  const PanelLayout& at = context.at;
  const std::vector<float> ages = context.facts.ages->newest();
  const float gap = 5 * at.scale, line = ImGui::GetTextLineHeight() + 2;
  const ImVec2 low = ImGui::GetCursorScreenPos();
  const ImVec2 high(low.x + (at.wide - at.side) * 0.42F, low.y + at.strip - 20 * at.scale);
  ImGui::BeginGroup();
  ImGui::SetCursorScreenPos(ImVec2(low.x, low.y + line));
  ImGui::PlotLines("##ages", ages.data(), static_cast<int>(ages.size()), 0, nullptr, 0, kFullMs,
                   ImVec2(high.x - low.x, high.y - low.y - 2 * line));
  ImGui::EndGroup();
  ImDrawList* const list = ImGui::GetWindowDrawList();
  const ImU32 ink = ImGui::GetColorU32(colour(context.theme.text));
  const auto write = [&](const std::string& text, float part, float y) {
    const float wide = ImGui::CalcTextSize(text.c_str()).x;
    list->AddText(ImVec2(low.x + gap + part * (high.x - low.x - 2 * gap - wide), y), ink, text.c_str());
  };
  write(words("axis_ms", kFullMs), 0, low.y);
  write(words("ages_title"), 0.5F, low.y);
  write(words("axis_ms", 0.0F), 0, high.y - line + 2);
  write(words("axis_pictures", AgeStrip::kShown), 0.5F, high.y - line + 2);
  write(words("axis_now"), 1, high.y - line + 2);
}

/// FRE, and what the error to be expected at the target is made of.
void draw_parts(const PanelContext& context) {
  const Theme& theme = context.theme;
  const OperationView& operation = context.operation;
  if (operation.fre_mm) say(theme.text, words("fre", *operation.fre_mm));
  if (!operation.fre_mm) return;
  if (!operation.expected) return say(theme.quiet, words("parts_unknown"));
  const ErrorBudget& error = *operation.expected;
  const std::string parts = error.motion ? words("parts", error.rms_mm(), error.fiducials_mm, error.hand_eye_mm,
                                                 error.pose_mm, error.lens_mm, error.time_mm, error.motion->rms_mm)
                                         : words("parts_unmoved", error.rms_mm(), error.fiducials_mm, error.hand_eye_mm,
                                                 error.pose_mm, error.lens_mm, error.time_mm);
  say(theme.text, parts);
}

/// What tells whoever looks after the cart how it does.
void draw_figures(const PanelContext& context) {
  const PanelFacts& facts = context.facts;
  const Theme& theme = context.theme;
  say(theme.text,
      words("ages", facts.ages->percentile_ms(0.5), facts.ages->percentile_ms(0.95), facts.ages->most_ms()));
  say(theme.quiet, words("rates", facts.frames_per_s, facts.frames_skipped, context.operation.engine_name));
  if (const auto& health = context.operation.link.health)
    say(theme.quiet, words("tracker_rate", health->tracker_rate_hz, health->doubted));
  draw_parts(context);
}

/// What watches whether patient, transmitter and organ move, while the overlay runs. Not where the line over the
/// picture says that nothing is to be believed.
void draw_watch(const PanelContext& context) {
  const OperationView& operation = context.operation;
  const bool runs = operation.step == LiveStep::run && operation.fre_mm && !operation.unconfirmed;
  if (context.shown.stale || (!context.shown.overlaid && !runs)) return;
  const WatchLine line = watch_line_of(operation);
  say(line.good ? context.theme.good : context.theme.warn,
      fmt::format("{} {}", line.good ? kGoodSign : kWarnSign, line.text));
}

/// What may be left out, last: half a line at the window's edge is none.
void say_if_room(const Theme& theme, const std::string& text) {
  if (ImGui::GetContentRegionAvail().y >= ImGui::GetTextLineHeight()) say(theme.quiet, text);
}

void draw_strip(PanelContext& context) {
  const PanelLayout& at = context.at;
  const PanelFacts& facts = context.facts;
  const OperationView& operation = context.operation;
  const Theme& theme = context.theme;
  ImGui::SetNextWindowPos(ImVec2(at.side, at.high - at.strip));
  ImGui::SetNextWindowSize(ImVec2(at.wide - at.side, at.strip));
  ImGui::Begin("strip", nullptr, kPanel);
  if (facts.details) {
    draw_ages(context);
    ImGui::SameLine();
  }
  ImGui::BeginGroup();
  if (!operation.fault.empty()) say(theme.bad, fmt::format("{} {}", kBadSign, operation.fault));
  draw_watch(context);
  if (facts.details) draw_figures(context);
  if (!operation.surface_check.empty() && (facts.details || !operation.surface_told))
    say(operation.organ_moved ? theme.warn : theme.quiet, operation.surface_check);
  if (!facts.said.empty()) say(theme.quiet, facts.said);
  const bool holds = operation.surface_told && !operation.organ_moved && !context.shown.stale;
  if (holds && !facts.details) say_if_room(theme, words("surface_holds"));
  if (!facts.details) say_if_room(theme, words("details"));
  ImGui::EndGroup();
  ImGui::End();
}

void add_look_key(const std::string& key, const PanelFacts& facts, PanelWishes& wishes) {
  constexpr double kNotch = 0.1, kHole = 0.33;
  OverlayLook look = wishes.look.value_or(facts.look);
  if (key == "u") {
    look.style = look.style == OverlayStyle::outlines ? OverlayStyle::filled : OverlayStyle::outlines;
  } else if (key == "h") {
    look.hole_radius = look.hole_radius ? std::nullopt : std::optional(kHole);
  } else if (key == "m") {
    look.margins = !look.margins;
  } else if (key == "g") {
    look.surface_in_front = !look.surface_in_front;
  } else if (key == "+") {
    look.opacity = std::min(1.0, look.opacity + kNotch);
  } else if (key == "-") {
    look.opacity = std::max(0.0, look.opacity - kNotch);
  } else {
    return;
  }
  wishes.look = look;
}

}  // namespace

ImVec4 colour(const Eigen::Vector3f& rgb) {
  return {rgb.x(), rgb.y(), rgb.z(), 1};
}

ImTextureID texture(std::uintptr_t name) {
  return reinterpret_cast<ImTextureID>(name);  // NOLINT(performance-no-int-to-ptr)
}

std::string label_of(const std::string& text, const char* id) {
  return fmt::format("{}###{}", text, id);
}

void say(const Eigen::Vector3f& rgb, const std::string& text) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour(rgb));
  ImGui::PushTextWrapPos(0);
  const std::string lines = broken_at_spaces(text, ImGui::GetContentRegionAvail().x, [](const std::string& line) {
    return ImGui::CalcTextSize(line.c_str()).x;
  });
  ImGui::TextUnformatted(lines.c_str());
  ImGui::PopTextWrapPos();
  ImGui::PopStyleColor();
}

const Eigen::Vector3f& colour_of(Grade grade, const Theme& theme) {
  return grade == Grade::pass ? theme.good : grade == Grade::marginal ? theme.warn : theme.bad;
}

const char* sign_of(Grade grade) {
  return grade == Grade::pass ? kGoodSign : grade == Grade::marginal ? kWarnSign : kBadSign;
}

std::vector<std::string> doubts_of(const OperationView& operation) {
  std::vector<std::string> out;
  out.reserve(kLiveSteps);
  for (const StepNote& note : operation.notes) {
    if (!note.doubt.empty() && std::find(out.begin(), out.end(), note.doubt) == out.end()) out.push_back(note.doubt);
  }
  return out;
}

int side_px(float scale) {
  return static_cast<int>(kSidePx * scale);
}

void add_key(const std::string& key, const OperationView& operation, const PanelFacts& facts, PanelWishes& wishes) {
  if (key == "space") wishes.primary = true;
  if (key == "enter") wishes.next = true;
  if (key == "backspace") wishes.undo = true;
  if (key == "escape") wishes.cancel = true;
  if (key == "t") wishes.stroke = true;
  constexpr double kRodNotch_deg = 5;
  if (key == "pageup") wishes.turn_rod_deg = kRodNotch_deg;
  if (key == "pagedown") wishes.turn_rod_deg = -kRodNotch_deg;
  if (key == "f") wishes.freeze = true;
  if (key == "s") wishes.snapshot = true;
  if (key == "o") wishes.hide_or_show = true;
  if (key == "v") wishes.slices = true;
  if (key == "i") wishes.inset = true;
  if (key == "e") wishes.details = true;
  if (key == "r") wishes.retry = true;
  if (key == "d") wishes.take_back = operation.odd_touch;
  if (key == "?") wishes.keys = true;
  if (key == "c") wishes.clip = !facts.clip;
  if (key == "l") wishes.room = facts.room == Room::dark ? Room::light : Room::dark;
  if (facts.slices) {
    if (key == "p") wishes.pick_marker = true;
    if (key == "k") wishes.pick_landmark = true;
    if (key == "x") wishes.drop_marker = true;
    if (key == "b") wishes.large_slices = true;
  }
  if (key.size() == 1 && key[0] >= '1' && key[0] < static_cast<char>('1' + kLiveSteps))
    wishes.step = static_cast<LiveStep>(key[0] - '1');
  add_look_key(key, facts, wishes);
}

PanelWishes draw_panels(const LiveWindow& window, const OperationView& operation, const ShownPicture& shown,
                        const PanelFacts& facts) {
  PanelWishes wishes;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float scale = window.scale();
  const float strip = (facts.details ? kFiguresPx : kStripPx) * scale;
  PanelContext context{
      window, operation, shown, facts, theme_of(facts.room), {size.x, size.y, kSidePx * scale, strip, scale}, wishes};
  draw_side(context);
  draw_video(context);
  draw_strip(context);
  for (const std::string& key : window.keys()) add_key(key, operation, facts, wishes);
  return wishes;
}

}  // namespace birdseye::host
