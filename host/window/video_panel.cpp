// The picture, what of it may be believed, and where the target is in it.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "host/overlay/margins.hpp"
#include "host/texts/texts.hpp"
#include "host/window/banner.hpp"
#include "host/window/inset_place.hpp"
#include "host/window/inset_view.hpp"
#include "host/window/panel_context.hpp"

namespace birdseye::host {

namespace {

constexpr ImU32 kGround = IM_COL32(0, 0, 0, 235);
constexpr float kBannerPx = 28;

/// The safety of the picture, in words, sign and colour, over its upper edge.
/// Gives how high it is: no word of a reason is cut, however long the reason or narrow the picture.
float draw_banner(const PanelContext& context, ImVec2 from, float wide) {
  const float scale = context.at.scale;
  const Banner banner = banner_of(context.operation, context.shown, context.facts);
  std::string text = banner.text;
  if (banner.grade) text = fmt::format("{} {}", sign_of(*banner.grade), text);
  const Theme& theme = context.theme;  // a dark line dazzles nobody in a dark room, and hides in a light one
  const ImU32 ground = ImGui::GetColorU32(colour(theme.background));
  const ImU32 ink = ImGui::GetColorU32(colour(banner.grade ? colour_of(*banner.grade, theme) : theme.text));
  ImDrawList* const list = ImGui::GetWindowDrawList();
  const float left = 14 * scale, above = 5 * scale, text_wide = std::max(wide - 2 * left, 1.0F);
  const ImVec2 text_size = ImGui::CalcTextSize(text.c_str(), nullptr, false, text_wide);
  const float high = std::max(kBannerPx * scale, text_size.y + 2 * above);
  list->AddRectFilled(from, ImVec2(from.x + wide, from.y + high), ground);
  list->AddRectFilled(from, ImVec2(from.x + 6 * scale, from.y + high), ink);
  list->AddText(nullptr, 0, ImVec2(from.x + left, from.y + above), ink, text.c_str(), nullptr, text_wide);
  return high;
}

/// Where the target is drawn, and how far from there it may be. checked: by a landmark. Gives what that takes of the
/// screen.
ScreenBox draw_target(const TargetMark& mark, bool checked, ImVec2 corner, float fit, float scale) {
  ImDrawList* const list = ImGui::GetWindowDrawList();
  const ImVec2 middle(corner.x + fit * static_cast<float>(mark.at_px.x() + 0.5),
                      corner.y + fit * static_cast<float>(mark.at_px.y() + 0.5));
  const float radius = fit * static_cast<float>(mark.radius_px);
  const Theme& theme = theme_over_video();
  const ImU32 ink = ImGui::GetColorU32(colour(mark.error.motion && checked ? theme.good : theme.warn));
  list->AddCircle(middle, radius, IM_COL32(0, 0, 0, 160), 0, 3.5F * scale);
  list->AddCircle(middle, radius, ink, 0, 1.5F * scale);
  const std::string text = mark.error.motion ? words("target_error", mark.error.radius95_mm())
                                             : words("target_error_unmoved", mark.error.radius95_mm());
  const ImVec2 wide = ImGui::CalcTextSize(text.c_str());
  const float beside = radius + 6 * scale, right = ImGui::GetWindowPos().x + ImGui::GetWindowSize().x;
  const bool fits = middle.x + beside + wide.x < right;
  const ImVec2 from(fits ? middle.x + beside : middle.x - beside - wide.x, middle.y - wide.y / 2);
  const ImVec2 to(from.x + wide.x, from.y + wide.y);
  list->AddRectFilled(ImVec2(from.x - 3 * scale, from.y - 2 * scale), ImVec2(to.x + 3 * scale, to.y + 2 * scale),
                      IM_COL32(0, 0, 0, 220));
  list->AddText(from, ink, text.c_str());
  return {{std::min(from.x, middle.x - radius), std::min(from.y, middle.y - radius)},
          {std::max(to.x, middle.x + radius), std::max(to.y, middle.y + radius)}};
}

/// What the rings about the target are, at the picture's lower edge, with how far off they may be. How high that is.
float draw_margin_legend(const PanelContext& context, ImVec2 lower_left) {
  const auto& plan = context.operation.patient;
  const bool shown = context.shown.overlaid && context.facts.look.margins;
  if (!shown || plan == nullptr || !plan->margins) return 0;
  const float gap = 6 * context.at.scale, line = ImGui::GetTextLineHeight(), side = 0.7F * line;
  const ImU32 ink = ImGui::GetColorU32(colour(theme_over_video().text));
  ImDrawList* const list = ImGui::GetWindowDrawList();
  const std::string error = margin_error_words(context.operation);
  float wide = ImGui::CalcTextSize(error.c_str()).x + 2 * gap;
  for (const MarginShell& shell : *plan->margins)
    wide = std::max(wide, ImGui::CalcTextSize(words("margin", shell.mm).c_str()).x + side + 3 * gap);
  const float high = line * static_cast<float>(plan->margins->size() + 1) + 2 * gap;
  ImVec2 at(lower_left.x, lower_left.y - high);
  list->AddRectFilled(at, ImVec2(at.x + wide, lower_left.y), IM_COL32(0, 0, 0, 220));
  at = ImVec2(at.x + gap, at.y + gap);
  for (std::size_t i = 0; i < plan->margins->size(); ++i) {
    draw_margin_sign(i, at, side);
    list->AddText(ImVec2(at.x + side + gap, at.y), ink, words("margin", (*plan->margins)[i].mm).c_str());
    at.y += line;
  }
  list->AddText(at, ink, error.c_str());
  return high;
}

/// Which colour is what, beneath the picture's lower edge's other legend. How high that is, with what lies below it.
float draw_vessel_legend(const PanelContext& context, ImVec2 lower_left) {
  const auto& drawn_by = context.operation.drawn_by;
  const bool preset = context.facts.preset == kTumourAndVessels && !context.facts.preset_changed;
  if (!context.shown.overlaid || !preset || drawn_by == nullptr || context.facts.look.opacity <= 0) return 0;
  constexpr int kPortal_hu = 220, kHepatic_hu = 160, kTumour_hu = 350;  // rendering.md has the ranges
  const std::array<std::pair<std::string, int>, 3> rows{{{words("legend_portal"), kPortal_hu},
                                                         {words("legend_hepatic"), kHepatic_hu},
                                                         {words("legend_tumour"), kTumour_hu}}};
  const float gap = 6 * context.at.scale, line = ImGui::GetTextLineHeight(), side = 0.7F * line;
  float wide = 0;
  for (const auto& [name, hu] : rows) wide = std::max(wide, ImGui::CalcTextSize(name.c_str()).x + side + 3 * gap);
  const float high = line * static_cast<float>(rows.size()) + 2 * gap;
  ImDrawList* const list = ImGui::GetWindowDrawList();
  list->AddRectFilled(ImVec2(lower_left.x, lower_left.y - high), ImVec2(lower_left.x + wide, lower_left.y), kGround);
  ImVec2 at(lower_left.x + gap, lower_left.y - high + gap);
  for (const auto& [name, hu] : rows) {
    const TransferFunction::Entry& entry = drawn_by->at(hu);
    draw_colour_sign({entry.r, entry.g, entry.b}, at, side);
    list->AddText(ImVec2(at.x + side + gap, at.y), ImGui::GetColorU32(colour(theme_over_video().text)), name.c_str());
    at.y += line;
  }
  return high;
}

/// The CT from outside, in a corner that leaves the target free.
void draw_inset(PanelContext& context, const ScreenBox& area, const std::optional<ScreenBox>& target) {
  const std::uintptr_t inset = context.window.picture(LiveWindow::Slot::inset);
  if (inset == 0 || !context.facts.inset) return;
  const float size = context.at.scale * 0.75F;
  const auto place =
      place_inset(area, {size * InsetView::kWidthPx, size * InsetView::kHeightPx}, target, context.facts.inset_corner);
  if (!place) return;
  context.wishes.inset_corner = place->corner;
  ImGui::SetCursorScreenPos(ImVec2(place->box.from.x(), place->box.from.y()));
  ImGui::Image(texture(inset), ImVec2(size * InsetView::kWidthPx, size * InsetView::kHeightPx));
}

void draw_picture(PanelContext& context, ImVec2 from, ImVec2 size) {
  const ShownPicture& shown = context.shown;
  const float scale = context.at.scale, gap = 8 * scale;
  std::optional<ScreenBox> target;
  if (shown.any) {
    const float fit =
        std::min(size.x / static_cast<float>(shown.width_px), size.y / static_cast<float>(shown.height_px));
    const ImVec2 shape(fit * static_cast<float>(shown.width_px), fit * static_cast<float>(shown.height_px));
    const ImVec2 corner(from.x + (size.x - shape.x) / 2, from.y + (size.y - shape.y) / 2);
    ImGui::SetCursorScreenPos(corner);
    ImGui::Image(texture(context.window.picture(LiveWindow::Slot::video)), shape);
    if (context.operation.target && shown.overlaid)
      target = draw_target(*context.operation.target, context.operation.checked.has_value(), corner, fit, scale);
  }
  const float banner_high = draw_banner(context, from, size.x);
  const ImVec2 lower_left(from.x + gap, from.y + size.y - gap);
  const float margins_high = draw_margin_legend(context, lower_left);
  const float legend_high =
      margins_high + draw_vessel_legend(context, ImVec2(lower_left.x, lower_left.y - margins_high));
  const ScreenBox area{{from.x + gap, from.y + banner_high + gap},
                       {from.x + size.x - gap, from.y + size.y - gap - legend_high}};
  draw_inset(context, area, target);
}

}  // namespace

void draw_video(PanelContext& context) {
  const PanelLayout& at = context.at;
  const ImVec2 size(at.wide - at.side, at.high - at.strip);
  // Slices share the room with the video, which stays in sight.
  const float slices_high = context.facts.slices ? slices_height(context, size) : 0;
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
  ImGui::SetNextWindowPos(ImVec2(at.side, 0));
  ImGui::SetNextWindowSize(ImVec2(size.x, size.y - slices_high));
  ImGui::Begin("video", nullptr, kPanel | ImGuiWindowFlags_NoInputs);
  draw_picture(context, ImVec2(at.side, 0), ImVec2(size.x, size.y - slices_high));
  ImGui::End();
  ImGui::PopStyleVar();
  if (context.facts.slices) draw_slices(context, ImVec2(at.side, size.y - slices_high), ImVec2(size.x, slices_high));
}

}  // namespace birdseye::host
