#pragma once

#include <string>

#include "host/operation/operation_view.hpp"
#include "host/overlay/live_picture.hpp"
#include "host/window/age_strip.hpp"
#include "host/window/appearance.hpp"
#include "host/window/live_window.hpp"

namespace birdseye::host {

/// What a person asked for in a frame of the window.
struct PanelWishes {
  bool primary = false, next = false, undo = false, stroke = false, freeze = false, snapshot = false;
  std::optional<LiveStep> step;
  std::optional<double> opacity;
  std::optional<bool> clip, surface_in_front;
  std::optional<CuttingPlane> plane;
  std::optional<std::vector<TransferPoint>> transfer;
  std::string preset;
};

/// What the panels show beside the operation.
struct PanelFacts {
  const AgeStrip* ages = nullptr;
  double frames_per_s = 0;
  std::uint64_t frames_skipped = 0;
  double opacity = 1;
  bool clip = false, surface_in_front = false;
  CuttingPlane plane;
  const HuHistogram* histogram = nullptr;
  bool recorded = false;   ///< the source is a recording
  bool simulated = false;  ///< it is the simulated cart, whose operator touches the fiducials and nothing else
  std::string said;        ///< a remark of the window's own: where a snapshot went
};

/// How wide the workflow beside the video is.
int side_px(float scale);
/// Draws workflow, picture and strip, and reads keys and buttons. shown: what of the picture may be shown now.
PanelWishes draw_panels(const LiveWindow& window, const OperationView& operation, const ShownPicture& shown,
                        const PanelFacts& facts, TransferEditor& editor);
/// The wish that a key stands for: "space", "enter", "backspace", "t", "f", "s", "1" to "7", "+", "-", "c", "g".
void add_key(const std::string& key, const PanelFacts& facts, PanelWishes& wishes);

}  // namespace birdseye::host
