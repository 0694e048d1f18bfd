#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// Adds the options that say which CT of a folder is meant. source must outlive the command's parsing.
inline void add_ct_options(CLI::App& command, VolumeSource& source) {
  command
      .add_option(
          "--series", source.series,
          "of a folder of several series: which, by number, description, contrast phase or UID, as `volume info` "
          "lists them")
      ->type_name("NAME");
  command.add_flag("--untilt", source.untilt,
                   "resample slices of a tilted gantry onto a straight stack; `volume info` says what it costs");
}

/// On standard error, where they are in no other program's way.
inline void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) fmt::print(stderr, "birdseye: note: {}\n", note);
}

}  // namespace birdseye::host
