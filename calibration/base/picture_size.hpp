#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace birdseye {

struct PictureSize {
  int width_px = 0, height_px = 0;
};

/// "1280x720". Empty where the text is anything else, or a side is below 1 pixel.
inline std::optional<PictureSize> parse_picture_size(std::string_view text) {
  const auto side = [](std::string_view digits) {
    int px = 0;
    const auto [end, fault] = std::from_chars(digits.data(), digits.data() + digits.size(), px);
    return fault == std::errc() && end == digits.data() + digits.size() ? px : 0;
  };
  const std::size_t cross = text.find('x');
  if (cross == std::string_view::npos) return std::nullopt;
  const PictureSize size{side(text.substr(0, cross)), side(text.substr(cross + 1))};
  if (size.width_px < 1 || size.height_px < 1) return std::nullopt;
  return size;
}

}  // namespace birdseye
