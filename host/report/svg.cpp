#include "host/report/svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace birdseye::host {

std::string escape_markup(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string svg_text(double x, double y, std::string_view text, Anchor anchor, const char* colour) {
  static constexpr const char* kAnchors[] = {"start", "middle", "end"};
  return fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='{}' fill='{}'>{}</text>", x, y,
                     kAnchors[static_cast<int>(anchor)], colour, escape_markup(text));
}

std::string svg_line(double x1, double y1, double x2, double y2, const char* colour, const char* more) {
  return fmt::format("<path d='M{:.1f} {:.1f}L{:.1f} {:.1f}' stroke='{}' fill='none' {}/>", x1, y1, x2, y2, colour,
                     more);
}

std::string svg_dot(double x, double y, double radius, const char* colour) {
  return fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{}' fill='{}'/>", x, y, radius, colour);
}

std::string svg_arrow(double x1, double y1, double x2, double y2, const char* colour) {
  constexpr double kShortest = 2, kHead = 4, kShare = 0.4;
  const double length = std::hypot(x2 - x1, y2 - y1);
  std::string path = fmt::format("<path d='M{:.1f} {:.1f}L{:.1f} {:.1f}", x1, y1, x2, y2);
  if (length > kShortest) {
    const double part = std::min(kHead, kShare * length) / length;
    const double along_x = part * (x2 - x1), along_y = part * (y2 - y1);
    path += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}L{:.1f} {:.1f}", x2 - along_x - along_y / 2,
                        y2 - along_y + along_x / 2, x2, y2, x2 - along_x + along_y / 2, y2 - along_y - along_x / 2);
  }
  return path + fmt::format("' stroke='{}' fill='none'/>", colour);
}

std::string svg_picture(double width, double height, const std::string& body) {
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0:.0f}' height='{1:.0f}' viewBox='0 0 {0:.0f} {1:.0f}' "
      "role='img' font-family='DejaVu Sans, sans-serif' font-size='12'><rect width='100%' height='100%' "
      "fill='white'/>\n{2}</svg>\n",
      width, height, body);
}

}  // namespace birdseye::host
