// Slices of the CT beside the video, to see fiducials and landmarks in, and to point at them.
#include <fmt/format.h>

#include <algorithm>

#include "host/texts/texts.hpp"
#include "host/window/panel_context.hpp"

namespace birdseye::host {

namespace {

constexpr float kControlsPx = 58, kMarginPx = 16;

void draw_controls(PanelContext& context, const SliceView& now, SliceView& asked, bool& changed) {
  const float scale = context.at.scale;
  const Eigen::Vector3d& place = now.place_mm();
  const auto hu = now.hu();
  say(context.theme.text, hu ? words("slice_place", place.x(), place.y(), place.z(), *hu)
                             : words("slice_outside", place.x(), place.y(), place.z()));
  ImGui::SameLine();
  say(context.theme.quiet, words("slice_help"));
  float zoom = static_cast<float>(now.zoom());
  ImGui::SetNextItemWidth(120 * scale);
  if (ImGui::SliderFloat(label_of(words("slice_zoom"), "zoom").c_str(), &zoom, 1, SliceView::kMostZoom, "%.1f")) {
    asked.set_zoom(zoom);
    changed = true;
  }
  ImGui::SameLine();
  for (const auto& [name, window] : {std::pair(label_of(words("soft_tissue"), "soft"), kSoftTissue),
                                     std::pair(label_of(words("bone_and_markers"), "bone"), kBoneAndMarkers)}) {
    if (ImGui::RadioButton(name.c_str(), now.window() == window)) {
      asked.set_window(window);
      changed = true;
    }
    ImGui::SameLine();
  }
  const std::string size = context.facts.large_slices ? words("slices_smaller") : words("slices_larger");
  if (ImGui::Button(label_of(size, "size").c_str())) context.wishes.large_slices = true;
  ImGui::SameLine();
  const LiveStep step = context.operation.step;
  if (step == LiveStep::fiducials) {
    if (ImGui::Button(label_of(words("pick_marker"), "pick").c_str())) context.wishes.pick_marker = true;
    ImGui::SameLine();
    if (ImGui::Button(label_of(words("drop_marker"), "drop").c_str())) context.wishes.drop_marker = true;
  } else if (ImGui::Button(label_of(words("pick_landmark"), "landmark").c_str())) {
    context.wishes.pick_landmark = true;
  }
  if (context.operation.looking_for_marker) {
    ImGui::SameLine();
    say(context.theme.warn, words("pick_wait"));
  }
}

}  // namespace

float slices_height(const PanelContext& context, const ImVec2& size) {
  // The video stays in sight.
  const float most = (context.facts.large_slices ? 0.7F : 0.5F) * size.y;
  const float whole = (size.x - kMarginPx) * SliceView::kHeightPx / SliceView::kWidthPx;
  return std::min(most, whole + kControlsPx * context.at.scale + kMarginPx);
}

void draw_slices(PanelContext& context, const ImVec2& from, const ImVec2& size) {
  const SliceView& now = *context.facts.slices;
  SliceView asked = now;
  bool changed = false;
  ImGui::SetNextWindowPos(from);
  ImGui::SetNextWindowSize(size);
  ImGui::Begin("slices", nullptr, kPanel);
  const float controls = kControlsPx * context.at.scale;
  const float fit =
      std::min((size.x - kMarginPx) / SliceView::kWidthPx, (size.y - controls - kMarginPx) / SliceView::kHeightPx);
  const ImVec2 shape(fit * SliceView::kWidthPx, fit * SliceView::kHeightPx);
  if (const std::uintptr_t picture = context.window.picture(LiveWindow::Slot::slices); picture != 0 && fit > 0) {
    const ImVec2 corner(from.x + (size.x - shape.x) / 2, from.y + 4);
    ImGui::SetCursorScreenPos(corner);
    ImGui::Image(texture(picture), shape);
    if (ImGui::IsItemHovered()) {
      const ImVec2 mouse = ImGui::GetIO().MousePos;
      const Eigen::Vector2d px((mouse.x - corner.x) / fit, (mouse.y - corner.y) / fit);
      const float wheel = ImGui::GetIO().MouseWheel;
      if (wheel != 0) asked.scroll(SliceView::view_at(px), wheel);
      if (ImGui::IsMouseDown(ImGuiMouseButton_Left)) asked.go_to(now.place_at(px));
      if (ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left))
        (context.operation.step == LiveStep::fiducials ? context.wishes.pick_marker : context.wishes.pick_landmark) =
            true;
      changed = wheel != 0 || ImGui::IsMouseDown(ImGuiMouseButton_Left);
    }
  }
  ImGui::SetCursorScreenPos(ImVec2(from.x + 8, from.y + size.y - controls));
  draw_controls(context, now, asked, changed);
  ImGui::End();
  if (changed) context.wishes.slice_view = asked;
}

}  // namespace birdseye::host
