#pragma once

#include <signal.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>

namespace birdseye {

/// What every program's main() ends in: parses, runs the callbacks, then `finish`, whose value is the exit code. Wrong
/// usage, and whatever a library throws, becomes one line on standard error, "name: what", and exit code 2.
template <typename Finish>
int run_program(CLI::App& app, int argc, char** argv, const Finish& finish) {
  constexpr int kUnusable = 2;
  // Whoever reads our pipes may go first. Writing then fails with an error, which is said; it does not end us unheard.
  ::signal(SIGPIPE, SIG_IGN);
  const std::string name = app.get_name();
  app.failure_message([name](const CLI::App*, const CLI::Error& error) {
    return name + ": " + error.what() + "; --help says what there is\n";
  });
  try {
    app.parse(argc, argv);
    return finish();
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUnusable;
  } catch (const std::exception& error) {
    std::string what = error.what();
    for (char& c : what) {
      if (c == '\n') c = ' ';
    }
    std::fprintf(stderr, "%s: %s\n", name.c_str(), what.c_str());
    return kUnusable;
  }
}

}  // namespace birdseye
