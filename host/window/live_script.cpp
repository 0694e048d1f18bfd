#include "host/window/live_script.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "drivers/system/whole_file.hpp"

namespace birdseye::host {

namespace {

std::optional<LiveStep> step_of(const std::string& name) {
  for (std::size_t i = 0; i < kLiveSteps; ++i) {
    if (name == name_of(static_cast<LiveStep>(i))) return static_cast<LiveStep>(i);
  }
  return std::nullopt;
}

constexpr const char* kOverlay = "overlay";

/// Whether LiveWindow::keys() may say it.
bool is_key(const std::string& name) {
  constexpr std::array kNamed{"space", "enter", "backspace", "escape", "pageup", "pagedown", "+", "-", "?"};
  if (std::ranges::find(kNamed, name) != kNamed.end()) return true;
  return name.size() == 1 && ((name[0] >= 'a' && name[0] <= 'z') || (name[0] >= '0' && name[0] <= '9'));
}

/// Whether what a line waits for has come.
bool came(const OperationView& operation, const std::string& awaited) {
  return awaited == kOverlay ? operation.target.has_value() : operation.note(*step_of(awaited)).done;
}

std::string late(const OperationView& operation, const std::string& awaited, double seconds) {
  if (awaited == kOverlay) {
    return fmt::format(
        "no frame bore an overlay within {:g} s; give the line more seconds, or have the steps done "
        "before it and the target in view",
        seconds);
  }
  const std::string& says = operation.note(*step_of(awaited)).line;
  return fmt::format(
      "the step {} was not done within {:g} s{}{}; give the line more seconds, or do before it what the "
      "step asks for (docs/manual/live.md, The steps)",
      awaited, seconds, says.empty() ? "" : ": ", says);
}

std::string names_of_steps() {
  std::string names;
  for (std::size_t i = 0; i < kLiveSteps; ++i) names += fmt::format("{}, ", name_of(static_cast<LiveStep>(i)));
  return names + kOverlay;
}

}  // namespace

Result<LiveScript> LiveScript::read(const std::filesystem::path& path) {
  constexpr std::size_t kMostBytes = 1U << 20U;
  const auto whole = read_whole_file(path, kMostBytes);
  if (!whole) return whole.error();
  std::istringstream file(*whole);
  LiveScript script;
  script.name_ = path.string();
  std::string text;
  for (int number = 1; std::getline(file, text); ++number) {
    std::istringstream words(text.substr(0, text.find('#')));
    Line line;
    line.number = number;
    if (!(words >> line.verb)) continue;
    bool sound = false;
    if (line.verb == "wait") sound = static_cast<bool>(words >> line.step >> line.seconds);
    if (line.verb == "press")
      sound = static_cast<bool>(words >> line.what >> line.every_s >> line.step >> line.seconds);
    if (line.verb == "sleep") sound = static_cast<bool>(words >> line.seconds);
    if (line.verb == "key" || line.verb == "shot") sound = static_cast<bool>(words >> line.what);
    if (line.verb == "look")
      sound = static_cast<bool>(words >> line.place_mm.x() >> line.place_mm.y() >> line.place_mm.z());
    if (line.verb == "end") sound = true;
    std::string more;
    sound = sound && !(words >> more) && line.seconds >= 0 && line.every_s >= 0 &&
            (line.step.empty() || line.step == kOverlay || step_of(line.step));
    if (line.seconds > 0 && !line.step.empty() && line.step != kOverlay && !step_of(line.step)) {
      return Error{Errc::bad_format, fmt::format("{}:{}: there is no step {}: give one of {}", path.string(), number,
                                                 line.step, names_of_steps())};
    }
    if (sound && (line.verb == "key" || line.verb == "press") && !is_key(line.what)) {
      return Error{Errc::bad_format,
                   fmt::format("{}:{}: there is no key {}: give space, enter, backspace, escape, pageup, pagedown, a "
                               "letter, a digit, +, - or ?",
                               path.string(), number, line.what)};
    }
    if (!sound) {
      return Error{Errc::bad_format, fmt::format("{}:{}: is no \"wait STEP SECONDS\" (or \"wait overlay SECONDS\"), "
                                                 "\"press NAME SECONDS STEP SECONDS\", \"sleep "
                                                 "SECONDS\", \"key NAME\", \"look X Y Z\", \"shot FILE\" or \"end\"",
                                                 path.string(), number)};
    }
    script.lines_.push_back(std::move(line));
  }
  return script;
}

Result<LiveScript::Act> LiveScript::next(const OperationView& operation, HostTime now) {
  if (lines_.empty()) return Act{};
  if (!since_) since_ = now;
  const Line& line = lines_.front();
  const double waited_s = Duration{now.ns - since_->ns}.seconds();
  if (!line.step.empty()) {
    const bool done = came(operation, line.step);
    if (!done && waited_s >= line.seconds) {
      return Error{Errc::timeout,
                   fmt::format("{}:{}: {}", name_, line.number, late(operation, line.step, line.seconds))};
    }
    const bool due = line.verb == "press" && (!pressed_ || Duration{now.ns - pressed_->ns}.seconds() >= line.every_s);
    if (!done && due) {
      pressed_ = now;
      return Act{line.what, {}, {}, false};
    }
    if (!done) return Act{};
  }
  if (line.verb == "sleep" && waited_s < line.seconds) return Act{};
  Act act;
  if (line.verb == "key") act.key = line.what;
  if (line.verb == "look") act.place_mm = line.place_mm;
  if (line.verb == "shot") act.shot = line.what;
  act.end = line.verb == "end";
  lines_.pop_front();
  since_.reset();
  pressed_.reset();
  return act;
}

}  // namespace birdseye::host
