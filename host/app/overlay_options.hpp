#pragma once

#include <CLI/CLI.hpp>
#include <vector>

#include "host/overlay/overlay_look.hpp"
#include "host/overlay/shown_ct.hpp"

namespace birdseye::host {

/// Adds the options that say what of a CT is drawn. choice must outlive the command's parsing.
void add_shown_options(CLI::App& command, ShownChoice& choice);

/// What --operation is, in the help.
inline constexpr const char* kOperationHelp =
    "what a live window kept (--out), for this CT: its calibration, registration and deformation";

/// Adds the options that say how it is drawn over a picture, and gives them. look must outlive the command's parsing.
std::vector<CLI::Option*> add_look_options(CLI::App& command, OverlayLook& look);

}  // namespace birdseye::host
