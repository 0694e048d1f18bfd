#pragma once

#include <string>
#include <vector>

#include "host/doctor/machine.hpp"
#include "host/doctor/question.hpp"

namespace birdseye::host {

/// The letters of the window; without it Dear ImGui's own, which are coarse.
inline constexpr const char* kWindowFont = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";

/// What a window at this display has. Who opens windows finds it out.
struct DisplayFacts {
  bool named = false;               ///< the environment names a display
  std::string problem;              ///< why no window can be opened; empty: one can
  std::string opengl, renderer;     ///< "4.5 (Core Profile) Mesa 22.3.6", "llvmpipe (LLVM 15.0.6, 256 bits)"
  int width_px = 0, height_px = 0;  ///< of the screen; 0: not known
  double scale = 1;                 ///< of text, as the screen asks for
};

/// What these facts come to.
std::vector<Check> display_checks(const DisplayFacts& facts);

/// Whether the window may run before other programs, and has its letters.
std::vector<Question> window_questions(const Machine& machine);

}  // namespace birdseye::host
