#include "drivers/system/program.hpp"

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <utility>

namespace birdseye {

namespace {

constexpr std::size_t kLongest = 2000;

bool follows(char c) {
  return (static_cast<unsigned char>(c) & 0xC0U) == 0x80;
}

/// The bytes of the UTF-8 character that begins there; 0: there is none.
std::size_t character_at(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  const std::size_t bytes = first < 0x80   ? 1
                            : first < 0xC2 ? 0
                            : first < 0xE0 ? 2
                            : first < 0xF0 ? 3
                            : first < 0xF5 ? 4
                                           : 0;
  if (bytes == 0 || text.size() < bytes || !std::ranges::all_of(text.substr(1, bytes - 1), follows)) return 0;
  return bytes;
}

}  // namespace

std::string in_one_line(std::string text) {
  if (text.size() > kLongest) {
    std::size_t end = kLongest / 2, from = text.size() - kLongest / 2;
    while (end > 0 && follows(text[end])) --end;
    while (from < text.size() && follows(text[from])) ++from;
    text.replace(end, from - end, " [...] ");
  }
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t bytes = character_at(std::string_view(text).substr(i));
    const auto first = static_cast<unsigned char>(text[i]);
    const bool c1 = bytes == 2 && first == 0xC2 && static_cast<unsigned char>(text[i + 1]) < 0xA0;
    if (bytes == 0) text[i] = '?';
    if ((bytes == 1 && first < 32) || first == 127) text[i] = ' ';
    if (c1) text.replace(i, 2, "  ");
    i += std::max<std::size_t>(bytes, 1);
  }
  return text;
}

void print_line(std::string text) {
  std::printf("%s\n", in_one_line(std::move(text)).c_str());
}

void print_error(const std::string& program, const std::string& what) {
  std::fprintf(stderr, "%s: %s\n", program.c_str(), in_one_line(what).c_str());
}

}  // namespace birdseye
