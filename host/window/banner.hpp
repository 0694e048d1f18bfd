#pragma once

#include <optional>
#include <string>

#include "calibration/base/verdict.hpp"
#include "host/operation/operation_view.hpp"
#include "host/overlay/live_picture.hpp"
#include "host/window/live_panels.hpp"

namespace birdseye::host {

/// What is said over the picture, and how good it is: green, amber or red; no grade: somebody has asked for it, and
/// nothing is wrong.
struct Banner {
  std::string text;
  std::optional<Grade> grade = Grade::marginal;
};

Banner banner_of(const OperationView& operation, const ShownPicture& shown, const PanelFacts& facts);

/// What watches whether patient, transmitter and organ move. good: all of it does, and could tell lately that nothing
/// has.
struct WatchLine {
  std::string text;
  bool good = false;
};
WatchLine watch_line_of(const OperationView& operation);

}  // namespace birdseye::host
