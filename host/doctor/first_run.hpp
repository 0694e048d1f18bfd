#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/doctor/machine.hpp"
#include "host/doctor/question.hpp"

namespace birdseye::host {

/// What the window at the cart was started with; empty where it was not named.
struct FirstRun {
  std::string source;  ///< an appliance's address, or a recording
  std::filesystem::path ct, labels;
  bool organ_named = false;
  std::string board;
};

/// What the window needs, one thing each and in the order in which a person would see to it: what was named, and where
/// it was not, what of it this machine has. Names and what the people in the room read are the window's texts.
std::vector<Question> first_run_questions(const Machine& machine, const FirstRun& given);

/// The display's row: the worst of its checks, in sentences.
Check display_row(const std::vector<Check>& checks);

}  // namespace birdseye::host
