#include "host/doctor/first_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "host/doctor/cameras.hpp"
#include "host/doctor/lines.hpp"
#include "host/doctor/service.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr const char* kFirstRun = "to start with";

/// The tracker's lines and the cameras that are plugged in here.
std::vector<std::string> instruments_here(const Machine& machine) {
  std::vector<std::string> here;
  for (const std::string& port : serial_ports(machine)) here.push_back(port);
  for (const std::string& camera : camera_nodes(machine)) here.push_back(camera);
  return here;
}

Check source_check(const Machine& machine, const FirstRun& given) {
  Check check{kFirstRun,
              words("first_cart"),
              CheckState::not_known,
              fmt::format("{} is named. The window says whether it answers.", given.source),
              "",
              words("first_cart_named")};
  if (!given.source.empty()) return check;
  check.state = CheckState::missing;
  const std::vector<std::string> here = instruments_here(machine);
  if (!listening_at(machine, kAppliancePort).empty()) {
    check.in_the_room = words("first_cart_listens");
    check.found = "No appliance is named. One listens on this machine.";
    check.remedy = fmt::format("Start with --server 127.0.0.1:{}.", kAppliancePort);
  } else if (!here.empty()) {
    check.in_the_room = words("first_cart_idle");
    check.found =
        fmt::format("No appliance is named. This machine has {}, and no appliance runs on it.", fmt::join(here, ", "));
    check.remedy = "Start birdseyed here, or name the appliance with --server HOST:PORT.";
  } else {
    check.in_the_room = words("first_cart_none");
    check.found = "No appliance is named. This machine has no tracker and no camera of its own.";
    check.remedy = "Name the appliance with --server HOST:PORT, or a recording with --recording PATH.";
  }
  return check;
}

Check ct_check(const FirstRun& given) {
  Check check{kFirstRun,
              words("first_ct"),
              CheckState::missing,
              "None is named.",
              "Name it with --ct PATH: a folder of DICOM files, or a NIfTI or NRRD file.",
              words("first_ct_none")};
  std::error_code ignored;
  if (given.ct.empty()) return check;
  if (!fs::exists(given.ct, ignored)) {
    check.state = CheckState::bad;
    check.found = fmt::format("{} is not there.", given.ct.string());
    check.in_the_room = words("first_ct_gone");
    return check;
  }
  return {kFirstRun, words("first_ct"),      CheckState::good, fmt::format("{} is named.", given.ct.string()),
          "",        words("first_ct_named")};
}

Check organ_check(const FirstRun& given) {
  Check check{
      kFirstRun, words("first_organs"),      CheckState::good, fmt::format("{} is named.", given.labels.string()),
      "",        words("first_organs_named")};
  if (given.labels.empty()) {
    check.state = CheckState::could_be_better;
    check.in_the_room = words("first_organs_none");
    check.found = "No segmentation is named. All of the CT is drawn, and all of it is matched with the video.";
    check.remedy = "Name it with --labels FILE, and in it the organ that the video shows with --organ NAMES.";
  } else if (!given.organ_named) {
    check.state = CheckState::bad;
    check.in_the_room = words("first_organs_which");
    check.found = "The segmentation is named, and the organ in it is not.";
    check.remedy = "Name the organ that the video shows with --organ NAMES.";
  }
  return check;
}

Check record_check() {
  return {kFirstRun,
          words("first_calibration"),
          CheckState::not_known,
          "The appliance tells the calibration record once it is connected.",
          "The appliance's configuration names the scope's record under [calibration].",
          words("first_calibration_later")};
}

Check board_check(const FirstRun& given) {
  if (!given.board.empty()) {
    return {kFirstRun, words("first_board"),      CheckState::good, fmt::format("{} is named.", given.board),
            "",        words("first_board_named")};
  }
  return {kFirstRun,
          words("first_board"),
          CheckState::could_be_better,
          "None is named. Without one the scope cannot be calibrated in this window.",
          "Where the appliance has no record, name the board, as --board chessboard:14x10:3mm.",
          words("first_board_none")};
}

int badness(CheckState state) {
  switch (state) {
    case CheckState::bad:
      return 4;
    case CheckState::missing:
      return 3;
    case CheckState::could_be_better:
      return 2;
    case CheckState::not_known:
      return 1;
    case CheckState::good:
      break;
  }
  return 0;
}

/// "it works" -> "It works."
std::string sentence(std::string words) {
  if (words.empty()) return words;
  words.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(words.front())));
  return words.ends_with('.') ? words : words + ".";
}

}  // namespace

std::vector<Question> first_run_questions(const Machine& machine, const FirstRun& given) {
  const auto question = [](const std::string& name, auto check) {
    return Question{.area = kFirstRun, .name = name, .ask = [check] { return std::vector<Check>{check()}; }};
  };
  return {question(words("first_cart"), [machine, given] { return source_check(machine, given); }),
          question(words("first_ct"), [given] { return ct_check(given); }),
          question(words("first_organs"), [given] { return organ_check(given); }),
          question(words("first_calibration"), record_check),
          question(words("first_board"), [given] { return board_check(given); })};
}

Check display_row(const std::vector<Check>& checks) {
  const auto worst = std::max_element(
      checks.begin(), checks.end(), [](const Check& a, const Check& b) { return badness(a.state) < badness(b.state); });
  Check row = worst == checks.end() ? Check{} : *worst;
  row.name = words("first_screen");
  row.found = sentence(row.found);
  row.remedy = sentence(row.remedy);
  return row;
}

}  // namespace birdseye::host
