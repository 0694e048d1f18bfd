#include "host/window/ask_display.hpp"

#include <GLFW/glfw3.h>
#include <epoxy/gl.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "host/volume/decoder_process.hpp"
#include "host/window/glfw_window.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kOpens = Duration::from_ms(15'000);  // a driver in software compiles what it draws with
constexpr Duration kAsks = Duration::from_ms(20'000);

bool names_display() {
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY"}) {
    const char* const value = std::getenv(name);
    if (value != nullptr && *value != 0) return true;
  }
  return false;
}

std::string gl_text(GLenum name) {
  const auto* const text = reinterpret_cast<const char*>(glGetString(name));
  return text == nullptr ? "" : text;
}

DisplayFacts facts_of_hidden_window() {
  DisplayFacts facts;
  glfwInit();
  glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
  const auto window = open_glfw_window("birdseye doctor", 64, 64, "");
  if (window) {
    facts = facts_of_open_window();
  } else {
    facts.problem = window.error().what;
  }
  glfwTerminate();
  return facts;
}

std::string json_text(const DisplayFacts& facts) {
  return nlohmann::json{{"problem", facts.problem},   {"opengl", facts.opengl},       {"renderer", facts.renderer},
                        {"width_px", facts.width_px}, {"height_px", facts.height_px}, {"scale", facts.scale}}
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

DisplayFacts facts_of_json(const nlohmann::json& json) {
  DisplayFacts facts;
  facts.problem = json.value("problem", "");
  facts.opengl = json.value("opengl", "");
  facts.renderer = json.value("renderer", "");
  facts.width_px = json.value("width_px", 0);
  facts.height_px = json.value("height_px", 0);
  facts.scale = json.value("scale", 1.0);
  return facts;
}

DisplayFacts ask_display() {
  std::optional<std::string> text;
  const auto ran = run_isolated([](const Send& send) { send_long_text(send, json_text(facts_of_hidden_window())); },
                                [&](const Receive& receive) { text = receive_long_text(receive); }, kOpens);
  DisplayFacts facts;
  if (text) {
    facts = facts_of_json(nlohmann::json::parse(*text, nullptr, false));
  } else {
    facts.problem = "who opens a window " + (ran ? std::string("says nothing") : ran.error().what);
  }
  facts.named = names_display();
  return facts;
}

}  // namespace

DisplayFacts facts_of_open_window() {
  DisplayFacts facts;
  facts.named = true;
  facts.opengl = gl_text(GL_VERSION);
  facts.renderer = gl_text(GL_RENDERER);
  if (GLFWmonitor* const monitor = glfwGetPrimaryMonitor(); monitor != nullptr) {
    if (const GLFWvidmode* const mode = glfwGetVideoMode(monitor); mode != nullptr) {
      facts.width_px = mode->width;
      facts.height_px = mode->height;
    }
  }
  float wide = 1, high = 1;
  if (GLFWwindow* const window = glfwGetCurrentContext(); window != nullptr)
    glfwGetWindowContentScale(window, &wide, &high);
  facts.scale = wide > high ? wide : high;
  return facts;
}

Question display_question() {
  return {.area = "display", .name = "window", .within = kAsks, .ask = [] { return display_checks(ask_display()); }};
}

}  // namespace birdseye::host
