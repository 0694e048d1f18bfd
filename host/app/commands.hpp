#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/system/program.hpp"

namespace birdseye::host {

/// What the command that ran came to. A command's callback sets it; main() prints the error and returns the code.
struct CommandStatus {
  ExitCode code = ExitCode::success;

  /// Takes the outcome of a command that has no verdict.
  void take(const Result<void>& outcome);
  /// Prints `birdseye: <what>` on standard error and turns the exit code to 2.
  void refuse(const Error& error);
};

/// For CLI11's check of an option that names a picture to write: what is wrong with the name, empty where it ends in
/// .png.
std::string png_name(const std::string& file);

// One file per command: each adds its subcommand, whose callback sets status.
void add_bench(CLI::App& app, CommandStatus& status);
void add_bench_device(CLI::App& bench, CommandStatus& status);  ///< under `bench`
void add_bench_similarity(CLI::App& bench, CommandStatus& status);
void add_bench_wire(CLI::App& bench, CommandStatus& status);
void add_bench_register(CLI::App& bench, CommandStatus& status);  ///< under `bench`
void add_calibrate(CLI::App& app, CommandStatus& status);
void add_convert(CLI::App& app, CommandStatus& status);
void add_demo(CLI::App& app, CommandStatus& status);
void add_doctor(CLI::App& app, CommandStatus& status);
void add_export(CLI::App& app, CommandStatus& status);
void add_live(CLI::App& app, CommandStatus& status);
void add_pair(CLI::App& app, CommandStatus& status);
void add_record(CLI::App& app, CommandStatus& status);
void add_register(CLI::App& app, CommandStatus& status);
void add_register_views(CLI::App& reg, CommandStatus& status);  ///< under `register`
void add_render(CLI::App& app, CommandStatus& status);
void add_replay(CLI::App& app, CommandStatus& status);
void add_verify(CLI::App& app, CommandStatus& status);
void add_volume(CLI::App& app, CommandStatus& status);
void add_volume_info(CLI::App& volume, CommandStatus& status);          ///< under `volume`
void add_volume_from_surface(CLI::App& volume, CommandStatus& status);  ///< under `volume`
void add_volume_markers(CLI::App& volume, CommandStatus& status);       ///< under `volume`

/// Of the app and all its commands: a file that is given to be read, or lies in a folder that is, is not written over
/// by what comes out, and no two files that come out are one. Once all commands are added.
void refuse_outputs_over_inputs(CLI::App& app);

}  // namespace birdseye::host
