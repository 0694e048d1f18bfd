#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>

#include "calibration/base/result.hpp"
#include "host/texts/english.hpp"

/// What the window says. Code names a text by its key, and the compiler knows the key; the words come from the table,
/// or from a language's file.
namespace birdseye::host {

/// How many figures and names a text takes: its {}, or the highest of {0} {1} and one. -1: it has both kinds, or an
/// end is missing.
constexpr int places_in(std::string_view text) {
  int unnumbered = 0, numbered = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '{') continue;
    const std::size_t end = text.find('}', i);
    if (end == std::string_view::npos) return -1;
    const bool digit = text[i + 1] >= '0' && text[i + 1] <= '9';
    if (digit) {
      numbered = numbered > text[i + 1] - '0' + 1 ? numbered : text[i + 1] - '0' + 1;
    } else {
      ++unnumbered;
    }
    i = end;
  }
  return unnumbered > 0 && numbered > 0 ? -1 : unnumbered + numbered;
}

/// A text of the table that takes so many figures and names. Another key, or another count, does not compile.
template <std::size_t kCount>
struct TextKey {
  std::size_t index;
  consteval TextKey(const char* key) : index(0) {  // NOLINT(google-explicit-constructor): a key is a text
    while (kEnglish[index].key != std::string_view(key)) ++index;
    if (places_in(kEnglish[index].english) != static_cast<int>(kCount)) throw "the text takes another count of figures";
  }
};

/// The text's words in the present language, as a format.
const std::string& pattern_of(std::size_t index);

/// The text in the present language.
inline const std::string& words(TextKey<0> text) {
  return pattern_of(text.index);
}
template <typename... Figures>
std::string words(std::type_identity_t<TextKey<sizeof...(Figures)>> text, const Figures&... figures) {
  return fmt::vformat(pattern_of(text.index), fmt::make_format_args(figures...));
}

/// From now on the window speaks this language: JSON, {"key": "words", ...}. What the file leaves out stays English. To
/// be called once, before anybody asks for words. Errors name the file and the key: one that there is not, or words
/// that take other figures than the English ones.
Result<void> speak(const std::filesystem::path& file);
/// The table as such a file, in the present language: what a translator begins with.
std::string language_text();

}  // namespace birdseye::host
