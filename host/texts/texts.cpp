#include "host/texts/texts.hpp"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <vector>

#include "drivers/system/whole_file.hpp"

namespace birdseye::host {

namespace {

std::vector<std::string>& present() {
  static std::vector<std::string> patterns = [] {
    std::vector<std::string> english;
    english.reserve(kEnglish.size());
    for (const EnglishText& text : kEnglish) english.emplace_back(text.english);
    return english;
  }();
  return patterns;
}

/// How the figures are written: "{:.2f}" and so on, without the numbers that put them in order.
std::multiset<std::string> figures_of(const std::string& pattern) {
  static const std::regex kPlace(R"(\{[0-9]*(:[^{}]*)?\})");
  std::multiset<std::string> out;
  for (std::sregex_iterator at(pattern.begin(), pattern.end(), kPlace), end; at != end; ++at)
    out.insert((*at)[1].str());
  return out;
}

/// Whether the words hold what the English ones hold, and nothing else that a format could stumble over.
bool takes_the_same(const std::string& words, const std::string& english) {
  const auto figures = figures_of(words);
  const auto braces = [&words](char brace) {
    return static_cast<std::size_t>(std::count(words.begin(), words.end(), brace));
  };
  return places_in(words) == places_in(english) && figures == figures_of(english) && braces('{') == figures.size() &&
         braces('}') == figures.size();
}

}  // namespace

const std::string& pattern_of(std::size_t index) {
  return present()[index];
}

Result<void> speak(const std::filesystem::path& file) {
  constexpr std::size_t kMostBytes = 1'000'000;
  const auto written = read_whole_file(file, kMostBytes);
  if (!written) return written.error();
  const auto json = nlohmann::json::parse(*written, nullptr, false);
  const auto wrong = [&file](const std::string& why) {
    return Error{Errc::bad_format, fmt::format("{}: {}", file.string(), why)};
  };
  if (!json.is_object()) return wrong("is no language's file; --list-texts writes one to begin with");
  std::vector<std::string> patterns = present();
  for (const auto& [key, value] : json.items()) {
    const auto* const found = std::find_if(kEnglish.begin(), kEnglish.end(),
                                           [&key = key](const EnglishText& text) { return text.key == key; });
    if (found == kEnglish.end()) return wrong(fmt::format("{}: there is no such text", key));
    const std::string english(found->english);
    if (!value.is_string() || !takes_the_same(value.get<std::string>(), english))
      return wrong(fmt::format("{}: needs words with the same figures as \"{}\"", key, english));
    patterns[static_cast<std::size_t>(found - kEnglish.begin())] = value.get<std::string>();
  }
  present() = std::move(patterns);
  return {};
}

std::string language_text() {
  nlohmann::ordered_json json;
  for (std::size_t i = 0; i < kEnglish.size(); ++i) json[std::string(kEnglish[i].key)] = present()[i];
  return json.dump(2) + "\n";
}

}  // namespace birdseye::host
