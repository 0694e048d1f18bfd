#pragma once

#include <CLI/CLI.hpp>

#include "device/wire/foreign_feed.hpp"

namespace birdseye::host {

/// Adds the options that name devices of a server that is no appliance. foreign must outlive the command's parsing.
inline void add_foreign_options(CLI::App& command, wire::ForeignSettings& foreign) {
  command
      .add_option("--scope-device", foreign.scope_device,
                  "with a server that is no appliance: whose poses are the scope's (default: the only one's there is)")
      ->type_name("NAME");
  command
      .add_option("--video-device", foreign.video_device,
                  "with a server that is no appliance: whose video is the scope's (default: the only one's there is)")
      ->type_name("NAME");
}

}  // namespace birdseye::host
