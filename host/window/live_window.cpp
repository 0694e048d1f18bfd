#include "host/window/live_window.hpp"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "host/doctor/display.hpp"
#include "host/texts/texts.hpp"
#include "host/window/glfw_window.hpp"

// GLFW's header of it would want those of Xlib and Xrandr, and a GLFW without X11 does not have it.
extern "C" __attribute__((weak)) unsigned long glfwGetX11Window(GLFWwindow* window);

namespace birdseye::host {

namespace {

constexpr float kUsualHeightPx = 864;  // of a window that has letters of the usual size
constexpr float kFontPx = 16;          // readable from the other side of the table

void use_font(float scale) {
  ImGuiIO& io = ImGui::GetIO();
  if (std::filesystem::exists(kWindowFont)) {
    // Of all letters that the texts and the signs have, and patients' names in Europe; ImGui keeps the pointer.
    static ImVector<ImWchar> ranges;
    ranges.clear();
    ImFontGlyphRangesBuilder glyphs;
    static constexpr std::array<ImWchar, 3> kLatinExtended{0x0100, 0x024F, 0}, kGreek{0x0370, 0x03FF, 0};
    for (const ImWchar* letters :
         {io.Fonts->GetGlyphRangesDefault(), io.Fonts->GetGlyphRangesCyrillic(), kGreek.data(), kLatinExtended.data()})
      glyphs.AddRanges(letters);
    glyphs.AddText(language_text().c_str());
    for (const char* sign : {kGoodSign, kWarnSign, kBadSign}) glyphs.AddText(sign);
    glyphs.BuildRanges(&ranges);
    io.Fonts->AddFontFromFileTTF(kWindowFont, std::round(kFontPx * scale), nullptr, ranges.Data);
  } else {
    io.FontGlobalScale = scale;
  }
}

}  // namespace

Result<std::unique_ptr<LiveWindow>> LiveWindow::open(const Settings& settings) {
  hush_drivers();
  std::unique_ptr<LiveWindow> made(new LiveWindow);  // from here on its end is GLFW's
  auto window = open_glfw_window(settings.title, settings.width_px, settings.height_px, "");
  if (!window) return window.error();
  made->window_ = *window;
  glfwSwapInterval(0);  // the video paces us, and a hidden window must not hold us
  made->begin();
  float wide = 1, high = 1;
  glfwGetWindowContentScale(made->window_, &wide, &high);
  made->scale_ = settings.scale > 0
                     ? static_cast<float>(settings.scale)
                     : std::max({1.0F, wide, high, static_cast<float>(settings.height_px) / kUsualHeightPx});
  made->imgui_ = ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  made->layout_ = settings.layout.string();
  io.IniFilename = made->layout_.empty() ? nullptr : made->layout_.c_str();
  use_font(made->scale_);
  use_theme(made->room_, made->scale_);
  // ImGui's own state of keys misses those that are let go before it looks, as a pedal may. It calls this one too.
  glfwSetWindowUserPointer(made->window_, made.get());
  glfwSetKeyCallback(made->window_, [](GLFWwindow* at, int key, int /*scancode*/, int action, int /*mods*/) {
    if (action == GLFW_PRESS) static_cast<LiveWindow*>(glfwGetWindowUserPointer(at))->pressed_.push_back(key);
  });
  ImGui_ImplGlfw_InitForOpenGL(made->window_, true);
  ImGui_ImplOpenGL3_Init("#version 450");
  return made;
}

LiveWindow::~LiveWindow() {
  cover_.reset();  // before the window that it lies on
  if (imgui_ != nullptr) {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext(imgui_);
  }
  if (window_ != nullptr) {
    for (const Texture& texture : textures_) glDeleteTextures(1, &texture.name);
    glfwDestroyWindow(window_);
  }
  glfwTerminate();
}

void LiveWindow::begin_frame(bool again) {
  pressed_.clear();
  if (!again) glfwPollEvents();
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

void LiveWindow::end_frame() {
  ImGui::Render();
  int wide = 0, high = 0;
  glfwGetFramebufferSize(window_, &wide, &high);
  glViewport(0, 0, wide, high);
  const Eigen::Vector3f& ground = theme_of(room_).background;
  glClearColor(ground.x(), ground.y(), ground.z(), 1);
  glClear(GL_COLOR_BUFFER_BIT);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  glFinish();
}

void LiveWindow::swap(Believed believe_until) {
  if (cover_) {
    cover_->lift();
    // A driver may show it at once or much later, and come back later still: until then the earlier time holds.
    if (believe_until) cover_->believe_no_longer_than(*believe_until);
  }
  glfwSwapBuffers(window_);
  if (cover_) cover_->believe_until(believe_until);
}

void LiveWindow::cover_when_still(int left_px, const RgbView& picture) {
  if (glfwGetX11Window == nullptr) return;
  const auto window = static_cast<std::uint32_t>(glfwGetX11Window(window_));
  cover_ = StallCover::over(window, left_px, picture);
}

void LiveWindow::set_room(Room room) {
  room_ = room;
  use_theme(room, scale_);
}

bool LiveWindow::closed() const {
  return glfwWindowShouldClose(window_) == GLFW_TRUE;
}

std::vector<std::string> LiveWindow::keys() const {
  std::vector<std::string> pressed;
  if (ImGui::GetIO().WantTextInput) return pressed;
  constexpr std::array<std::pair<int, const char*>, 13> kNamed{{{GLFW_KEY_SPACE, "space"},
                                                                {GLFW_KEY_ESCAPE, "escape"},
                                                                {GLFW_KEY_PAGE_UP, "pageup"},
                                                                {GLFW_KEY_PAGE_DOWN, "pagedown"},
                                                                {GLFW_KEY_ENTER, "enter"},
                                                                {GLFW_KEY_KP_ENTER, "enter"},
                                                                {GLFW_KEY_BACKSPACE, "backspace"},
                                                                {GLFW_KEY_EQUAL, "+"},
                                                                {GLFW_KEY_KP_ADD, "+"},
                                                                {GLFW_KEY_MINUS, "-"},
                                                                {GLFW_KEY_SLASH, "?"},
                                                                {GLFW_KEY_F1, "?"},
                                                                {GLFW_KEY_KP_SUBTRACT, "-"}}};
  for (const int code : pressed_) {
    for (const auto& [named, name] : kNamed) {
      if (code == named) pressed.emplace_back(name);
    }
    if (code >= GLFW_KEY_0 && code <= GLFW_KEY_9) pressed.emplace_back(1, static_cast<char>(code));
    if (code >= GLFW_KEY_A && code <= GLFW_KEY_Z) pressed.emplace_back(1, static_cast<char>(code - GLFW_KEY_A + 'a'));
  }
  return pressed;
}

void LiveWindow::set_picture(Slot slot, const RgbView& picture) {
  if (picture.width_px < 1 || picture.height_px < 1 || !picture.whole()) return;
  Texture& texture = textures_[static_cast<std::size_t>(slot)];
  if (picture.width_px != texture.width_px || picture.height_px != texture.height_px) {
    glDeleteTextures(1, &texture.name);
    glCreateTextures(GL_TEXTURE_2D, 1, &texture.name);
    glTextureStorage2D(texture.name, 1, GL_RGBA8, picture.width_px, picture.height_px);
    glTextureParameteri(texture.name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(texture.name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    texture.width_px = picture.width_px;
    texture.height_px = picture.height_px;
  }
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(texture.name, 0, 0, 0, picture.width_px, picture.height_px, GL_RGB, GL_UNSIGNED_BYTE,
                      picture.pixels.data());
}

LiveWindow::Shot LiveWindow::shot() const {
  Shot out;
  glfwGetFramebufferSize(window_, &out.width_px, &out.height_px);
  const auto row = 3 * static_cast<std::ptrdiff_t>(out.width_px);
  out.rgb.resize(static_cast<std::size_t>(row) * static_cast<std::size_t>(out.height_px));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadBuffer(GL_BACK);
  glReadPixels(0, 0, out.width_px, out.height_px, GL_RGB, GL_UNSIGNED_BYTE, out.rgb.data());
  for (int y = 0; y < out.height_px / 2; ++y) {
    const auto top = out.rgb.begin() + y * row;
    std::swap_ranges(top, top + row, out.rgb.begin() + (out.height_px - 1 - y) * row);
  }
  return out;
}

}  // namespace birdseye::host
