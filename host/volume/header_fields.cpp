#include "host/volume/header_fields.hpp"

#include "calibration/base/lower_case.hpp"

namespace birdseye::host {

std::string_view without_blanks(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

HeaderFields header_fields(std::istream& file, char sign, const std::string& last) {
  constexpr int kLongestHeader = 1 << 20;
  HeaderFields fields;
  std::string line;
  for (int bytes = 0; bytes < kLongestHeader; bytes += static_cast<int>(line.size()) + 1) {
    line.clear();
    for (char c = 0; line.size() < kLongestHeader && file.get(c) && c != '\n';) line += c;
    if (without_blanks(line).empty()) break;
    const auto at = line.find(sign);
    if (at == std::string::npos) continue;
    const std::string name = lower_case(std::string(without_blanks(std::string_view(line).substr(0, at))));
    const std::string value(without_blanks(std::string_view(line).substr(at + 1)));
    const auto [known, is_new] = fields.emplace(name, value);
    if (!is_new && known->second != value) fields[name + std::string(kAgain)] = value;
    if (name == last) break;
  }
  return fields;
}

std::string field_of(const HeaderFields& fields, const char* name) {
  const auto found = fields.find(name);
  return found == fields.end() ? std::string() : found->second;
}

bool says_true(const HeaderFields& fields, const char* name) {
  const std::string value = field_of(fields, name);
  return !value.empty() && (value[0] == 'T' || value[0] == 't' || value[0] == '1');
}

}  // namespace birdseye::host
