#include "host/window/theme.hpp"

#include <imgui.h>

namespace birdseye::host {

const Theme& theme_of(Room room) {
  // Good is bluish, bad reddish and dark or bright beside warn: the axes that are left to most who see few colours.
  static const Theme kDark{{0.09F, 0.10F, 0.11F}, {0.93F, 0.94F, 0.95F}, {0.66F, 0.70F, 0.74F},
                           {0.24F, 0.80F, 0.66F}, {0.97F, 0.83F, 0.33F}, {0.97F, 0.47F, 0.30F}};
  static const Theme kLight{{0.97F, 0.97F, 0.96F}, {0.08F, 0.09F, 0.10F}, {0.35F, 0.38F, 0.42F},
                            {0.00F, 0.42F, 0.36F}, {0.55F, 0.41F, 0.00F}, {0.58F, 0.00F, 0.16F}};
  return room == Room::light ? kLight : kDark;
}

void use_theme(Room room, float scale) {
  ImGuiStyle& style = ImGui::GetStyle();
  style = ImGuiStyle();
  room == Room::light ? ImGui::StyleColorsLight() : ImGui::StyleColorsDark();
  style.WindowRounding = 0;
  style.FrameRounding = 3;
  style.WindowBorderSize = 0;
  style.FrameBorderSize = room == Room::light ? 1 : 0;  // white boxes on white are none
  style.ScaleAllSizes(scale);
}

}  // namespace birdseye::host
