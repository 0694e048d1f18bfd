#pragma once

#include <string>
#include <string_view>

namespace birdseye::host {

// Pieces of a report's pictures. Lengths are pixels of the page, and y grows downwards.

inline constexpr const char* kBlue = "#1b5e9e";
inline constexpr const char* kPaleBlue = "#a9c3dd";
inline constexpr const char* kOrange = "#d1622b";
inline constexpr const char* kGreen = "#2c8a4b";
inline constexpr const char* kRed = "#b3261e";  ///< what is left out or beyond its limit
inline constexpr const char* kInk = "#333";
inline constexpr const char* kGrey = "#667";      ///< of labels
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
/// The whole picture, on white, as a file of its own or inside a page.
std::string svg_picture(double width, double height, const std::string& body);

}  // namespace birdseye::host
