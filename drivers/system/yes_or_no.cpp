#include "drivers/system/yes_or_no.hpp"

#include <termios.h>
#include <unistd.h>

#include <string>

#include "drivers/system/wait.hpp"

namespace birdseye {

bool says_yes(Deadline deadline) {
  constexpr std::size_t kMost = 80;
  ::tcflush(STDIN_FILENO, TCIFLUSH);  // what was typed before the question, while the other machine was waited for
  std::string line;
  while (line.size() < kMost && wait_ready(STDIN_FILENO, POLLIN, deadline) != 0) {
    char c = 0;
    if (::read(STDIN_FILENO, &c, 1) != 1 || c == '\n') return line == "y" || line == "Y" || line == "yes";
    line += c;
  }
  return false;
}

}  // namespace birdseye
