#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "drivers/system/program.hpp"
#include "host/volume/volume.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// Adds the options that say which CT of a folder is meant, and where its voxels lie where its file does not. source
/// must outlive the command's parsing.
inline void add_ct_options(CLI::App& command, VolumeSource& source) {
  command
      .add_option(
          "--series", source.series,
          "of a folder of several series: which, by number, description, contrast phase or UID, as `volume info` "
          "lists them")
      ->type_name("NAME");
  command.add_flag("--untilt", source.untilt,
                   "resample slices of a tilted gantry onto a straight stack; `volume info` says what it costs");
  command
      .add_option_function<std::vector<double>>(
          "--spacing",
          [&source](const std::vector<double>& mm) { source.stated.spacing_mm = Eigen::Vector3d(mm[0], mm[1], mm[2]); },
          "how far apart the voxels are along i, j, k, mm; only for a file that does not say it, or says two")
      ->type_name("X,Y,Z")
      ->expected(3)
      ->delimiter(',')
      ->check(CLI::Range(0.02, 20.0));
  command
      .add_option("--orientation", source.stated.orientation,
                  "which way i, j, k grow: three of R or L, A or P, I or S, as LPS; only for a file that does not say "
                  "it, or says two")
      ->type_name("LETTERS")
      ->check([](const std::string& letters) {
        return axes_of_letters(letters)
                   ? std::string()
                   : fmt::format(
                         "\"{}\" names no three axes: give one of R and L, one of A and P and one of I and S, "
                         "in the order of i, j, k, as LPS",
                         letters);
      });
}

/// On standard error, where they are in no other program's way.
inline void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) print_error("birdseye", "note: " + note);
}

}  // namespace birdseye::host
