#include "host/window/line_breaks.hpp"

#include <sstream>

namespace birdseye::host {

std::string broken_at_spaces(const std::string& text, float wide,
                             const std::function<float(const std::string&)>& width_of) {
  if (width_of(text) <= wide) return text;
  std::string out, line;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, ' ');) {
    std::string longer = line;
    if (!longer.empty()) longer += ' ';
    longer += word;
    if (!line.empty() && width_of(longer) > wide) {
      out += line + '\n';
      line = word;
    } else {
      line = longer;
    }
  }
  return out + line;
}

}  // namespace birdseye::host
