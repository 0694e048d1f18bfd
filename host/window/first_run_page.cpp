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
#include "host/window/ask_display.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kPageEvery = Duration::from_ms(30);
constexpr const char* kSimulateKey = "space";
constexpr const char* kCloseKey = "q";
const ImVec4 kPageText(0.92F, 0.93F, 0.94F, 1), kPageQuiet(0.62F, 0.66F, 0.70F, 1);

ImVec4 colour_of(CheckState state) {
  switch (state) {
    case CheckState::good:
      return {0.45F, 0.80F, 0.45F, 1};
    case CheckState::could_be_better:
      return {0.96F, 0.74F, 0.30F, 1};
    case CheckState::missing:
    case CheckState::bad:
      return {0.96F, 0.38F, 0.34F, 1};
    case CheckState::not_known:
      break;
  }
  return kPageQuiet;
}

void write_wrapped(const ImVec4& colour, const std::string& text) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour);
  ImGui::TextWrapped("%s", text.c_str());
  ImGui::PopStyleColor();
}

/// State, name, and what was found over what to do.
void draw_rows(const std::vector<Check>& checks, float scale) {
  if (!ImGui::BeginTable("checks", 3)) return;
  ImGui::TableSetupColumn("state", ImGuiTableColumnFlags_WidthFixed, 125 * scale);
  ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed, 155 * scale);
  ImGui::TableSetupColumn("words");
  for (const Check& check : checks) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    write_wrapped(colour_of(check.state), name_of(check.state));
    ImGui::TableNextColumn();
    write_wrapped(kPageText, check.name);
    ImGui::TableNextColumn();
    write_wrapped(kPageText, check.found);
    if (!check.remedy.empty()) write_wrapped(kPageQuiet, check.remedy);
    ImGui::Dummy(ImVec2(0, 12 * scale));
  }
  ImGui::EndTable();
}

/// What a person asked for by a button.
std::optional<FirstRunChoice> draw_buttons(float scale) {
  std::optional<FirstRunChoice> asked;
  const float high = 44 * scale;
  if (ImGui::Button("Start the simulated cart  (Space)", ImVec2(330 * scale, high))) asked = FirstRunChoice::simulate;
  ImGui::SameLine(0, 16 * scale);
  if (ImGui::Button("Close  (Q)", ImVec2(150 * scale, high))) asked = FirstRunChoice::close;
  return asked;
}

std::optional<FirstRunChoice> draw_foot(float scale) {
  ImGui::Separator();
  ImGui::Dummy(ImVec2(0, 6 * scale));
  write_wrapped(kPageQuiet,
                "All at once:  birdseye live --server HOST:PORT --ct PATH --labels FILE --organ NAMES --board SPEC");
  write_wrapped(kPageQuiet, "More about this machine:  birdseye doctor");
  write_wrapped(kPageQuiet,
                "The simulated cart needs none of this: it brings a patient, a tracker and a scope of its own.");
  ImGui::Dummy(ImVec2(0, 8 * scale));
  return draw_buttons(scale);
}

/// What the page shows, and how high its parts were when they were last drawn: the rows scroll where there is no room,
/// the buttons stay in view.
struct Page {
  std::string lacking;
  std::vector<Check> checks;
  float rows_high = 0, foot_high = 0;
};

std::optional<FirstRunChoice> draw_page(const LiveWindow& window, Page& page) {
  const float scale = window.scale();
  const ImGuiViewport* const view = ImGui::GetMainViewport();
  const float margin = std::max(24 * scale, (view->Size.x - 1100 * scale) / 2);
  const float top = std::max(12 * scale, (view->Size.y - 620 * scale) / 3);
  ImGui::SetNextWindowPos(ImVec2(margin, top));
  ImGui::SetNextWindowSize(ImVec2(view->Size.x - 2 * margin, view->Size.y - top - 8 * scale));
  ImGui::Begin("first run", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoScrollWithMouse);
  write_wrapped(kPageText, "Birdseye needs a little more to begin.");
  write_wrapped(kPageQuiet, page.lacking);
  ImGui::Dummy(ImVec2(0, 4 * scale));
  ImGui::Separator();
  const float room = ImGui::GetContentRegionAvail().y - page.foot_high;
  ImGui::BeginChild("rows", ImVec2(0, std::max(40 * scale, std::min(page.rows_high, room))));
  ImGui::Dummy(ImVec2(0, 8 * scale));
  if (page.checks.empty()) write_wrapped(kPageQuiet, "This machine is asked what it has ...");
  draw_rows(page.checks, scale);
  page.rows_high = ImGui::GetCursorPosY();
  ImGui::EndChild();
  const float above = ImGui::GetCursorPosY();
  const auto asked = draw_foot(scale);
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
  for (const std::string& key : window.keys()) asked = asked ? asked : choice_of_key(key);
  if (!asked) asked = act.end ? FirstRunChoice::close : choice_of_key(act.key);
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
