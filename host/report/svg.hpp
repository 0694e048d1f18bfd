#pragma once

#include <string>
#include <string_view>

namespace birdseye::host {

// Pieces of a report's pictures. Lengths are pixels of the page, and y grows downwards.

// Colours of M. Okabe's and K. Ito's palette, which the colour-blind tell apart. Never red against green alone.
inline constexpr const char* kBlue = "#0072b2";
inline constexpr const char* kPaleBlue = "#a9c3dd";
inline constexpr const char* kOrange = "#d55e00";
inline constexpr const char* kGreen = "#009e73";
inline constexpr const char* kPurple = "#cc79a7";
inline constexpr const char* kRed = "#b3261e";  ///< what is left out or beyond its limit; never beside kOrange alone
inline constexpr const char* kInk = "#333333";
inline constexpr const char* kGrey = "#666677";   ///< of labels
inline constexpr const char* kFaint = "#e4e4e4";  ///< of grids

/// &, <, > and quotes as HTML and SVG write them.
std::string escape_markup(std::string_view text);

enum class Anchor { start, middle, end };

std::string svg_text(double x, double y, std::string_view text, Anchor anchor = Anchor::start,
                     const char* colour = kInk);
/// more: further attributes, as "stroke-width='2'".
std::string svg_line(double x1, double y1, double x2, double y2, const char* colour, const char* more = "");
/// A further attribute of svg_line().
inline constexpr const char* kDashed = "stroke-dasharray='5 4'";
std::string svg_dot(double x, double y, double radius, const char* colour);
/// With a head where it is long enough for one.
std::string svg_arrow(double x1, double y1, double x2, double y2, const char* colour);
/// The whole picture, on white, as a file of its own or inside a page.
std::string svg_picture(double width, double height, const std::string& body);

}  // namespace birdseye::host
