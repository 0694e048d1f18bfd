#include "host/volume/label_names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "calibration/base/lower_case.hpp"
#include "host/volume/totalsegmentator_names.hpp"

namespace birdseye::host {

namespace {

std::string plain_name(std::string_view name) {
  std::string plain = lower_case(name);
  std::replace_if(
      plain.begin(), plain.end(), [](char c) { return c == ' ' || c == '-'; }, '_');
  return plain;
}

std::optional<int> number_in(const std::string& text) {
  int number = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  return read.ec == std::errc() && read.ptr == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

std::vector<NamedLabel> those_of_totalsegmentator() {
  std::vector<NamedLabel> names;
  for (const std::string_view name : totalsegmentator_names()) {
    const auto number = static_cast<int>(names.size()) + 1;
    names.push_back({number, std::string(name), {number}});
  }
  return names;
}

std::string some_of(const std::vector<NamedLabel>& names) {
  constexpr std::size_t kSome = 12;
  std::string some;
  for (std::size_t i = 0; i < std::min(names.size(), kSome); ++i)
    some += fmt::format("{}{}", i == 0 ? "" : ", ", names[i].name);
  return names.size() > kSome ? fmt::format("{} and {} more", some, names.size() - kSome) : some;
}

}  // namespace

std::vector<LabelChoice> all_of(std::initializer_list<std::vector<LabelChoice>> choices) {
  std::vector<LabelChoice> all;
  for (const auto& some : choices) all.insert(all.end(), some.begin(), some.end());
  return all;
}

std::string joined(std::span<const LabelChoice> labels, std::string_view between) {
  std::string words;
  for (const LabelChoice& label : labels) words += fmt::format("{}{}", words.empty() ? "" : between, label.text);
  return words;
}

bool is_chosen(const LabelChoice& choice, const NamedLabel& label) {
  const auto number = number_in(choice.text);
  return number ? label.number == *number : plain_name(label.name) == plain_name(choice.text);
}

Result<std::vector<int>> values_of_labels(const std::vector<NamedLabel>& names, std::span<const LabelChoice> wanted,
                                          std::vector<std::string>* notes) {
  const bool has_names =
      std::any_of(names.begin(), names.end(), [](const NamedLabel& label) { return !label.name.empty(); });
  const std::vector<NamedLabel> known = names.empty() ? those_of_totalsegmentator() : names;
  std::vector<int> values;
  for (const auto& [one] : wanted) {
    const auto number = number_in(one);
    bool found = false;
    for (const NamedLabel& label : number ? names : known) {
      if (!is_chosen({one}, label)) continue;
      values.insert(values.end(), label.values.begin(), label.values.end());
      found = true;
    }
    if (!found && number) values.push_back(*number);
    if (found && !number && names.empty() && notes != nullptr) {
      std::string note = fmt::format("the labels have no names: '{}' is taken for {}, as TotalSegmentator 2 counts",
                                     one, values.back());
      if (std::find(notes->begin(), notes->end(), note) == notes->end()) notes->push_back(std::move(note));
    }
    if (found || number) continue;
    return Error{Errc::not_found,
                 has_names
                     ? fmt::format("has no label '{}'; it has {}", one, some_of(known))
                     : fmt::format("names none of its labels{}; give the label's number",
                                   names.empty() ? fmt::format(", and '{}' is none of TotalSegmentator's", one) : "")};
  }
  return values;
}

}  // namespace birdseye::host
