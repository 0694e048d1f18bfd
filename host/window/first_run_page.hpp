#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/doctor/question.hpp"
#include "host/window/live_script.hpp"
#include "host/window/live_window.hpp"

namespace birdseye::host {

enum class FirstRunChoice { simulate, close };

/// Shows in the window what is lacking to show an operation, and what to do about it, and offers the simulated cart
/// instead; the window is as it was after that, but for its room, which a person may change there. lacking: in a few
/// words, for the page's head. questions: asked on a thread of their own, a row each; the display that the window is on
/// is one more. script: is followed while the page is there (`key`, `shot`, `sleep`, `end`); what is left of it is the
/// operation's. Errors are the script's.
Result<FirstRunChoice> show_first_run_page(LiveWindow& window, const std::string& lacking,
                                           std::vector<Question> questions, std::optional<LiveScript>& script);

}  // namespace birdseye::host
