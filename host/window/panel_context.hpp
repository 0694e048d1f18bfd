#pragma once

#include <imgui.h>

#include <string>
#include <vector>

#include "host/operation/operation_view.hpp"
#include "host/overlay/live_picture.hpp"
#include "host/window/live_panels.hpp"
#include "host/window/theme.hpp"

namespace birdseye::host {

/// Where the window's parts lie, in pixels.
struct PanelLayout {
  float wide, high, side, strip, scale;
};

/// What every panel is drawn from, and what it asks for.
struct PanelContext {
  const LiveWindow& window;
  const OperationView& operation;
  const ShownPicture& shown;  ///< what of the picture may be shown now
  const PanelFacts& facts;
  const Theme& theme;
  PanelLayout at;
  PanelWishes& wishes;
};

// Without a background of its own: the window's is drawn at once, which a driver in software is glad of.
inline constexpr ImGuiWindowFlags kPanel = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                           ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                                           ImGuiWindowFlags_NoBackground;

ImVec4 colour(const Eigen::Vector3f& rgb);
/// ImGui carries OpenGL's names as pointers.
ImTextureID texture(std::uintptr_t name);
/// What ImGui shows of a button or box, and what it knows it by: another language, or another state, is the same one.
std::string label_of(const std::string& text, const char* id);
/// In a colour, wrapped at the panel's edge.
void say(const Eigen::Vector3f& rgb, const std::string& text);
const Eigen::Vector3f& colour_of(Grade grade, const Theme& theme);
const char* sign_of(Grade grade);

/// A small square of a colour, of that side, beside a line of text.
void draw_colour_sign(const Eigen::Vector3f& rgb, const ImVec2& at, float side);
/// The same of a margin's colour.
void draw_margin_sign(std::size_t shell, const ImVec2& at, float side);
/// How far off the margins may be: as far as the target that they lie about.
std::string margin_error_words(const OperationView& operation);

/// What the deformation did to the target, and how far off it may be by that, in lines; empty: there is none.
std::vector<std::string> deformation_words(const OperationView& operation);

// The panels, each in a file of its own.
void draw_patient_card(PanelContext& context);
void draw_step(PanelContext& context);
void draw_look(PanelContext& context);
void draw_slices(PanelContext& context, const ImVec2& from, const ImVec2& size);
/// How much of the video's room, of that size, the slices take.
float slices_height(const PanelContext& context, const ImVec2& size);
void draw_video(PanelContext& context);

}  // namespace birdseye::host
