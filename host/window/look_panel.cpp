// How the overlay is drawn, as the side of the window has it while the overlay runs.
#include <fmt/format.h>

#include <array>
#include <string>

#include "host/overlay/margins.hpp"
#include "host/texts/texts.hpp"
#include "host/window/panel_context.hpp"

namespace birdseye::host {

namespace {

/// A slider whose text is no format of ImGui's: words may hold anything.
bool slide(const char* id, float& value, float low, float high, const std::string& shown) {
  std::string format;
  for (const char c : shown) format.append(c == '%' ? 2 : 1, c);
  return ImGui::SliderFloat(id, &value, low, high, format.c_str());
}

void draw_plane(PanelContext& context) {
  bool clip = context.facts.clip;
  if (ImGui::Checkbox(label_of(words("cutting_plane"), "clip").c_str(), &clip)) context.wishes.clip = clip;
  if (!clip) return;
  CuttingPlane plane = context.facts.plane;
  const std::array<const char*, 3> axes{words("left_to_right").c_str(), words("front_to_back").c_str(),
                                        words("feet_to_head").c_str()};
  bool changed = ImGui::Combo("##axis", &plane.axis, axes.data(), static_cast<int>(axes.size()));
  float part = static_cast<float>(plane.part);
  ImGui::SetNextItemWidth(-1);
  changed = slide("##part", part, 0, 1, words("cut_at", part)) || changed;
  plane.part = part;
  if (changed) context.wishes.plane = plane;
}

void draw_hole(OverlayLook& look, bool& changed) {
  bool hole = look.hole_radius.has_value();
  if (ImGui::Checkbox(label_of(words("hole"), "hole").c_str(), &hole)) {
    constexpr double kUsual = 0.33;
    look.hole_radius = hole ? std::optional(kUsual) : std::nullopt;
    changed = true;
  }
  if (!look.hole_radius) return;
  float radius = static_cast<float>(*look.hole_radius);
  ImGui::SetNextItemWidth(-1);
  if (slide("##radius", radius, 0.1F, 0.6F, fmt::format("{} {:.2f}", words("hole_radius"), radius))) {
    look.hole_radius = radius;
    changed = true;
  }
}

void draw_margin_choice(const PanelContext& context, OverlayLook& look, bool& changed) {
  const auto& plan = context.operation.patient;
  if (plan == nullptr || !plan->margins) {
    if (context.facts.details) say(context.theme.quiet, words("no_margins"));
    return;
  }
  changed = ImGui::Checkbox(label_of(words("margins"), "margins").c_str(), &look.margins) || changed;
  if (!look.margins) return;
  for (std::size_t i = 0; i < plan->margins->size(); ++i) {
    const float side = 0.7F * ImGui::GetTextLineHeight();
    draw_margin_sign(i, ImGui::GetCursorScreenPos(), side);
    ImGui::Dummy(ImVec2(side, side));
    ImGui::SameLine();
    say(context.theme.text, words("margin", (*plan->margins)[i].mm));
  }
  say(context.theme.quiet, margin_error_words(context.operation));
}

}  // namespace

void draw_margin_sign(std::size_t shell, const ImVec2& at, float side) {
  draw_colour_sign(margin_colour(shell).cast<float>(), at, side);
}

void draw_colour_sign(const Eigen::Vector3f& rgb, const ImVec2& at, float side) {
  const ImVec2 from(at.x, at.y + 0.25F * side), to(at.x + side, at.y + 1.25F * side);
  ImDrawList* const list = ImGui::GetWindowDrawList();
  list->AddRectFilled(from, to, ImGui::GetColorU32(colour(rgb)));
  list->AddRect(from, to, IM_COL32(128, 128, 128, 255));  // a white one on white, a black one on black
}

std::string margin_error_words(const OperationView& operation) {
  const auto& target = operation.target;
  if (!target) return words("margin_error_unknown");
  return target->error.motion ? words("margin_error", target->error.radius95_mm())
                              : words("margin_error_unmoved", target->error.radius95_mm());
}

void draw_look(PanelContext& context) {
  const PanelFacts& facts = context.facts;
  const float scale = context.at.scale;
  OverlayLook look = facts.look;
  bool changed = false;
  bool shown = !context.operation.overlay_hidden;
  if (ImGui::Checkbox(label_of(words("overlay_shown"), "overlay").c_str(), &shown)) context.wishes.hide_or_show = true;
  float opacity = static_cast<float>(look.opacity);
  ImGui::SetNextItemWidth(-80 * scale);
  if (ImGui::SliderFloat(label_of(words("opacity"), "opacity").c_str(), &opacity, 0, 1, "%.2f")) {
    look.opacity = opacity;
    changed = true;
  }
  bool outlines = look.style == OverlayStyle::outlines;
  if (ImGui::Checkbox(label_of(words("outlines"), "outlines").c_str(), &outlines)) {
    look.style = outlines ? OverlayStyle::outlines : OverlayStyle::filled;
    changed = true;
  }
  draw_hole(look, changed);
  draw_margin_choice(context, look, changed);
  changed = ImGui::Checkbox(label_of(words("surface_in_front"), "in front").c_str(), &look.surface_in_front) || changed;
  if (changed) context.wishes.look = look;
  draw_plane(context);
  ImGui::SetNextItemWidth(-80 * scale);
  const std::string in_force = facts.preset.empty()   ? words("presets")
                               : facts.preset_changed ? words("preset_changed", facts.preset)
                                                      : facts.preset;
  if (ImGui::BeginCombo(label_of(words("colours"), "colours").c_str(), in_force.c_str())) {
    for (const std::string& name : transfer_presets()) {
      const bool is_it = name == facts.preset && !facts.preset_changed;
      if (ImGui::Selectable(name.c_str(), is_it)) context.wishes.preset = name;
    }
    ImGui::EndCombo();
  }
  if (context.operation.frozen) say(context.theme.warn, fmt::format("{} {}", kWarnSign, words("banner_frozen")));
  if (ImGui::Button(label_of(words("snapshot"), "snapshot").c_str())) context.wishes.snapshot = true;
  ImGui::SameLine();
  const bool dark = facts.room == Room::dark;
  if (ImGui::Button(label_of(dark ? words("light_room") : words("dark_room"), "room").c_str()))
    context.wishes.room = dark ? Room::light : Room::dark;
  if (facts.details && facts.histogram != nullptr && facts.editor != nullptr)
    context.wishes.transfer = facts.editor->draw(*facts.histogram, scale);
}

}  // namespace birdseye::host
