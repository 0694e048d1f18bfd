#include "host/window/first_run_page.hpp"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>

#include "drivers/system/background.hpp"
#include "drivers/system/interrupt.hpp"
#include "drivers/system/wait.hpp"
#include "host/doctor/first_run.hpp"
#include "host/files/picture.hpp"
#include "host/files/write_files.hpp"
#include "host/texts/texts.hpp"
#include "host/window/ask_display.hpp"
#include "host/window/panel_context.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kPageEvery = Duration::from_ms(30);
constexpr const char* kSimulateKey = "space";
constexpr const char* kCloseKey = "q";
constexpr const char* kKeysKey = "?";  // F1, as LiveWindow::keys names it
constexpr const char* kRoomKey = "l";
constexpr const char* kHowKey = "e";

struct Seen {
  Eigen::Vector3f colour;
  const char* sign;
  const std::string& word;
};
Seen seen_as(CheckState state, const Theme& theme) {
  switch (state) {
    case CheckState::good:
      return {theme.good, kGoodSign, words("first_good")};
    case CheckState::could_be_better:
      return {theme.warn, kWarnSign, words("first_could_be_better")};
    case CheckState::missing:
      return {theme.bad, kBadSign, words("first_missing")};
    case CheckState::bad:
      return {theme.bad, kBadSign, words("first_bad")};
    case CheckState::not_known:
      break;
  }
  return {theme.quiet, "?", words("first_not_known")};
}

/// State, name, and what the people in the room do; how: below it what whoever set the cart up reads.
void draw_rows(const std::vector<Check>& checks, const Theme& theme, float scale, bool how) {
  if (!ImGui::BeginTable("checks", 3)) return;
  ImGui::TableSetupColumn("state", ImGuiTableColumnFlags_WidthFixed, 125 * scale);
  ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed, 155 * scale);
  ImGui::TableSetupColumn("words");
  for (const Check& check : checks) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    const Seen seen = seen_as(check.state, theme);
    say(seen.colour, fmt::format("{} {}", seen.sign, seen.word));
    ImGui::TableNextColumn();
    say(theme.text, check.name);
    ImGui::TableNextColumn();
    say(theme.text, check.in_the_room.empty() ? words("first_no_answer") : check.in_the_room);
    if (how) say(theme.quiet, check.remedy.empty() ? check.found : fmt::format("{} {}", check.found, check.remedy));
    ImGui::Dummy(ImVec2(0, 12 * scale));
  }
  ImGui::EndTable();
}

/// What a person asked for by a button.
std::optional<FirstRunChoice> draw_buttons(float scale) {
  std::optional<FirstRunChoice> asked;
  const float high = 44 * scale;
  if (ImGui::Button(label_of(words("first_start"), "start").c_str(), ImVec2(330 * scale, high)))
    asked = FirstRunChoice::simulate;
  ImGui::SameLine(0, 16 * scale);
  if (ImGui::Button(label_of(words("first_close"), "close").c_str(), ImVec2(150 * scale, high)))
    asked = FirstRunChoice::close;
  return asked;
}

std::optional<FirstRunChoice> draw_foot(const Theme& theme, float scale, bool keys, bool how) {
  ImGui::Separator();
  ImGui::Dummy(ImVec2(0, 6 * scale));
  if (keys) say(theme.text, words("first_keys"));
  if (how) {
    say(theme.quiet,
        words("first_all", "birdseye live --server HOST:PORT --ct PATH --labels FILE --organ NAMES --board SPEC"));
    say(theme.quiet, words("first_doctor", "birdseye doctor"));
  } else {
    say(theme.text, words("first_who"));
  }
  say(theme.quiet, words("first_simulated"));
  ImGui::Dummy(ImVec2(0, 8 * scale));
  return draw_buttons(scale);
}

/// What the page shows, and how high its parts were when they were last drawn: the rows scroll where there is no room,
/// the buttons stay in view.
struct Page {
  std::string lacking;
  std::vector<Check> checks;
  bool keys = false;  ///< all of them are shown
  bool how = false;   ///< what is missing is given, for whoever set the cart up
  float rows_high = 0, foot_high = 0;
};

std::optional<FirstRunChoice> draw_page(const LiveWindow& window, Page& page) {
  const float scale = window.scale();
  const Theme& theme = theme_of(window.room());
  const ImGuiViewport* const view = ImGui::GetMainViewport();
  const float margin = std::max(24 * scale, (view->Size.x - 1100 * scale) / 2);
  const float top = std::max(12 * scale, (view->Size.y - 620 * scale) / 3);
  ImGui::SetNextWindowPos(ImVec2(margin, top));
  ImGui::SetNextWindowSize(ImVec2(view->Size.x - 2 * margin, view->Size.y - top - 8 * scale));
  ImGui::Begin("first run", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoScrollWithMouse);
  say(theme.text, words("first_more"));
  say(theme.quiet, page.lacking);
  ImGui::Dummy(ImVec2(0, 4 * scale));
  ImGui::Separator();
  const float room = ImGui::GetContentRegionAvail().y - page.foot_high;
  ImGui::BeginChild("rows", ImVec2(0, std::max(40 * scale, std::min(page.rows_high, room))));
  ImGui::Dummy(ImVec2(0, 8 * scale));
  if (page.checks.empty()) say(theme.quiet, words("first_asking"));
  draw_rows(page.checks, theme, scale, page.how);
  page.rows_high = ImGui::GetCursorPosY();
  ImGui::EndChild();
  const float above = ImGui::GetCursorPosY();
  const auto asked = draw_foot(theme, scale, page.keys, page.how);
  page.foot_high = ImGui::GetCursorPosY() - above;
  ImGui::End();
  return asked;
}

std::optional<FirstRunChoice> choice_of_key(const std::string& key) {
  if (key == kSimulateKey) return FirstRunChoice::simulate;
  if (key == kCloseKey) return FirstRunChoice::close;
  return std::nullopt;
}

/// One picture of the page. What was asked for by hand or by the script's act.
Result<std::optional<FirstRunChoice>> turn(LiveWindow& window, Page& page, const LiveScript::Act& act) {
  window.begin_frame();
  auto asked = draw_page(window, page);
  std::vector<std::string> keys = window.keys();
  keys.push_back(act.key);
  for (const std::string& key : keys) {
    if (!asked) asked = choice_of_key(key);
    if (key == kHowKey) page.how = !page.how;
    if (key == kKeysKey) page.keys = !page.keys;
    if (key == kRoomKey) window.set_room(window.room() == Room::dark ? Room::light : Room::dark);
  }
  if (!asked && act.end) asked = FirstRunChoice::close;
  window.end_frame();
  if (!act.shot.empty()) {
    const LiveWindow::Shot shot = window.shot();
    const auto written = write_file(act.shot, png_of(RgbView{shot.rgb, shot.width_px, shot.height_px}));
    if (!written) return written.error();
  }
  window.swap();
  return asked;
}

}  // namespace

Result<FirstRunChoice> show_first_run_page(LiveWindow& window, const std::string& lacking,
                                           std::vector<Question> questions, std::optional<LiveScript>& script) {
  note_interrupts();
  const Check display = display_row(display_checks(facts_of_open_window()));
  Background<std::vector<Check>> asking(Duration::from_ms(1000));
  asking.start([questions = std::move(questions)](const std::stop_token&, const auto&) { return ask_all(questions); });
  Page page;
  page.lacking = lacking;
  while (!window.closed() && !interrupted()) {
    if (auto found = asking.take()) {
      page.checks = *std::move(found);
      page.checks.push_back(display);
    }
    LiveScript::Act act;
    if (script && !page.checks.empty()) {  // the script's person reads before acting
      auto next = script->next({}, host_now());
      if (!next) return next.error();
      act = *std::move(next);
    }
    const auto asked = turn(window, page, act);
    if (!asked) return asked.error();
    if (*asked) return **asked;
    sleep_for(kPageEvery);
  }
  return FirstRunChoice::close;
}

}  // namespace birdseye::host
