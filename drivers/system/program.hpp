#pragma once

#include <signal.h>

#include <cstdio>
#include <exception>
#include <new>
#include <string>

namespace birdseye {

/// What a program of ours tells whoever started it.
enum class ExitCode : int { success = 0, unusable_input = 2, verdict_fail = 3 };

/// Names and texts come from elsewhere: a line stays one line, and nothing in it moves a terminal's cursor or is longer
/// than somebody reads. Control characters become blanks, what is no UTF-8 a question mark, and of a text of more than
/// 2000 bytes the middle is left out.
std::string in_one_line(std::string text);

/// Prints that and the line's end on standard output.
void print_line(std::string text);

/// Prints "program: what" as the one line on standard error that an error is, whatever names it holds.
void print_error(const std::string& program, const std::string& what);

/// What every program's main() ends in: parses, runs the callbacks, then `finish`, whose value is the exit code. Wrong
/// usage, and whatever a library throws, becomes one line on standard error, "name: what", and unusable_input. App and
/// ParseError are CLI11's, which is heavy to compile: only files that hold a main() include it, and this one does not.
template <typename ParseError, typename App, typename Finish>
int run_program(App& app, int argc, char** argv, const Finish& finish) {
  constexpr int kUnusable = static_cast<int>(ExitCode::unusable_input);
  // Whoever reads our pipes may go first. Writing then fails with an error, which is said; it does not end us unheard.
  ::signal(SIGPIPE, SIG_IGN);
  // A limit on the size of files (ulimit -f) is told as a full disk is.
  ::signal(SIGXFSZ, SIG_IGN);
  const std::string name = app.get_name();
  app.failure_message(
      [name](const App*, const auto& error) { return name + ": " + error.what() + "; --help says what there is\n"; });
  try {
    app.parse(argc, argv);
    const int code = finish();
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    print_error(name, "standard output: cannot be written; is the disk full?");
    return kUnusable;
  } catch (const ParseError& error) {
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
