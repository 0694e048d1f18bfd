#pragma once

// For files that hold a main(), which link CLI11 themselves: it is heavy to compile, and nothing else needs it.

#include <signal.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include "drivers/system/program.hpp"

namespace birdseye {

/// What every program's main() ends in: parses, runs the callbacks, then `finish`, whose value is the exit code. Wrong
/// usage, and whatever a library throws, becomes one line on standard error, "name: what", and unusable_input.
template <typename Finish>
int run_program(CLI::App& app, int argc, char** argv, const Finish& finish) {
  constexpr int kUnusable = static_cast<int>(ExitCode::unusable_input);
  // Whoever reads our pipes may go first. Writing then fails with an error, which is said; it does not end us unheard.
  ::signal(SIGPIPE, SIG_IGN);
  const std::string name = app.get_name();
  app.failure_message([name](const CLI::App*, const CLI::Error& error) {
    return name + ": " + error.what() + "; --help says what there is\n";
  });
  try {
    app.parse(argc, argv);
    const int code = finish();
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    print_error(name, "standard output: cannot be written; is the disk full?");
    return kUnusable;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUnusable;
  } catch (const std::bad_alloc&) {
    print_error(name, "there is not enough memory for this; close other programs, or give it less");
    return kUnusable;
  } catch (const std::exception& error) {
    print_error(name, error.what());
    return kUnusable;
  }
}

}  // namespace birdseye
