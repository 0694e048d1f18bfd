#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/image_view.hpp"
#include "calibration/base/result.hpp"
#include "host/render/gl/gl_context.hpp"
#include "host/render/scene/scene.hpp"
#include "host/window/stall_cover.hpp"
#include "host/window/theme.hpp"

struct GLFWwindow;
struct ImGuiContext;

namespace birdseye::host {

/// A window with Dear ImGui's panels in it, whose OpenGL context engines may draw with, and pictures as textures.
/// One at a time, on the main thread. Between begin_frame() and end_frame(), ImGui's own calls draw.
class LiveWindow final : public GlContext {
 public:
  struct Settings {
    std::string title;
    int width_px = 1280, height_px = 720;
    double scale = 0;              ///< of text and panels; 0: as the screen asks for
    std::filesystem::path layout;  ///< where places and sizes are remembered; empty: nowhere
  };
  /// Errc::unsupported names what is missing.
  static Result<std::unique_ptr<LiveWindow>> open(const Settings& settings);
  ~LiveWindow() override;
  LiveWindow(const LiveWindow&) = delete;
  LiveWindow& operator=(const LiveWindow&) = delete;

  /// Takes what the user did, waiting for nothing.
  /// again: of the frame that was just drawn, for it is drawn another time: what has come since waits for the next.
  void begin_frame(bool again = false);
  /// Draws all panels into the back of the window, and waits until that is done; swap() shows it.
  void end_frame();
  /// Of what is shown; empty: for ever.
  using Believed = std::optional<HostTime>;
  /// What is still on the screen then is covered, as cover_when_still() says.
  void swap(Believed believe_until = std::nullopt);
  /// picture: what covers the window right of left_px then. Without an X server nothing ever does.
  void cover_when_still(int left_px, const RgbView& picture);
  /// How often it stood still.
  [[nodiscard]] int stood_still() const { return cover_ ? cover_->covered() : 0; }
  [[nodiscard]] bool closed() const;
  /// Keys that were pressed before begin_frame(), unless into a field of text: "space", "enter", "escape", "backspace",
  /// "+", "-",
  /// "?", small letters and digits.
  [[nodiscard]] std::vector<std::string> keys() const;

  /// Of any size from call to call. One that is not whole is left out.
  enum class Slot { video, inset, slices };
  void set_picture(Slot slot, const RgbView& picture);
  /// The picture's texture for ImGui::Image; 0 before the first.
  [[nodiscard]] std::uintptr_t picture(Slot slot) const { return textures_[static_cast<std::size_t>(slot)].name; }
  /// The colours of its panels, from the next frame on.
  void set_room(Room room);
  [[nodiscard]] Room room() const { return room_; }
  /// Of text and panels, against a screen of usual density.
  [[nodiscard]] float scale() const { return scale_; }
  /// What end_frame() drew, before swap(): RGB, rows from the top.
  struct Shot {
    int width_px = 0, height_px = 0;
    std::vector<std::uint8_t> rgb;
  };
  [[nodiscard]] Shot shot() const;

 private:
  LiveWindow() = default;

  GLFWwindow* window_ = nullptr;
  ImGuiContext* imgui_ = nullptr;
  std::string layout_;
  std::vector<int> pressed_;  ///< keys by GLFW's numbers, since the frame before
  std::unique_ptr<StallCover> cover_;
  struct Texture {
    std::uint32_t name = 0;
    int width_px = 0, height_px = 0;
  };
  std::array<Texture, 3> textures_;
  float scale_ = 1;
  Room room_ = Room::dark;
};

}  // namespace birdseye::host
