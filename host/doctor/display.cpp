#include "host/doctor/display.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "drivers/system/thread.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr const char* kDisplay = "display";
constexpr int kWidthPx = 1280, kHeightPx = 720;  // of the window, at the usual density

/// Mesa's drivers that draw with the processor, by how they call themselves.
bool draws_in_software(std::string renderer) {
  constexpr std::array kNames{"llvmpipe", "softpipe", "swrast", "software", "lavapipe"};
  for (char& c : renderer) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::any_of(kNames.begin(), kNames.end(),
                     [&](const char* name) { return renderer.find(name) != std::string::npos; });
}

Check check_size(const DisplayFacts& facts) {
  Check check{kDisplay, "screen", CheckState::not_known, "its size is not told", "", words("first_screen_unknown")};
  if (facts.width_px < 1 || facts.height_px < 1) return check;
  const double scale = std::max(1.0, facts.scale);
  check.found = fmt::format("{}x{}, text at {:g} of the usual size", facts.width_px, facts.height_px, scale);
  const bool fits = facts.width_px >= kWidthPx * scale && facts.height_px >= kHeightPx * scale;
  check.state = fits ? CheckState::good : CheckState::could_be_better;
  check.in_the_room = fits ? words("first_screen_good") : words("first_screen_small");
  if (!fits) {
    check.remedy = fmt::format(
        "the window takes {}x{} here: take a larger screen, or start live with --scale 1 and a "
        "smaller --size",
        std::lround(kWidthPx * scale), std::lround(kHeightPx * scale));
  }
  return check;
}

std::vector<Check> check_real_time() {
  // Of the thread that asks, which ends with the question.
  if (schedule_this_thread_real_time()) {
    return {{kDisplay, "real-time scheduling", CheckState::good, "this user has the right to it", ""}};
  }
  return {
      {kDisplay, "real-time scheduling", CheckState::could_be_better, "this user has no right to it",
       "write the line \"@video - rtprio 1\" into /etc/security/limits.d/birdseye.conf, put this user into the group "
       "video and log in again: a window that stands still is then covered in time on a busy machine too"}};
}

std::vector<Check> check_font(const Machine& machine) {
  std::error_code ignored;
  if (std::filesystem::exists(machine.at(kWindowFont), ignored)) {
    return {{kDisplay, "font", CheckState::good, "DejaVu Sans is installed", ""}};
  }
  return {{kDisplay, "font", CheckState::could_be_better, "DejaVu Sans is not installed: letters are coarse",
           "sudo apt install fonts-dejavu-core"}};
}

}  // namespace

std::vector<Check> display_checks(const DisplayFacts& facts) {
  if (!facts.problem.empty()) {
    const std::string begins = "window: ";
    const std::string problem = facts.problem.substr(facts.problem.starts_with(begins) ? begins.size() : 0);
    return {{kDisplay, "window", facts.named ? CheckState::bad : CheckState::missing, problem,
             "start this at the machine's own screen; over ssh set DISPLAY=:0, and on a machine without a screen use "
             "xvfb-run"}};
  }
  const std::string& good = words("first_screen_good");
  std::vector<Check> checks{{kDisplay, "window", CheckState::good, fmt::format("OpenGL {}", facts.opengl), "", good}};
  Check drawn{kDisplay, "graphics", CheckState::good, facts.renderer, "", good};
  if (draws_in_software(facts.renderer)) {
    drawn.state = CheckState::could_be_better;
    drawn.in_the_room = words("first_screen_slow");
    drawn.found = fmt::format("the processor draws, by {}", facts.renderer);
    drawn.remedy = "if there is a graphics card, install its driver; without one it works, and --engine gl is slow";
  }
  checks.push_back(drawn);
  checks.push_back(check_size(facts));
  return checks;
}

std::vector<Question> window_questions(const Machine& machine) {
  return {{.area = kDisplay, .name = "real-time scheduling", .ask = check_real_time},
          {.area = kDisplay, .name = "font", .ask = [machine] { return check_font(machine); }}};
}

}  // namespace birdseye::host
