#include "host/calibrate/view_pairs.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "host/files/name_order.hpp"

namespace birdseye::host {

namespace {

using calibration::PatternView;
using Key = std::vector<std::string>;

std::string stem_of(const PatternView& view) {
  return std::filesystem::path(view.name).stem().string();
}

/// The runs of digits in a name, without leading zeros.
Key numbers_in(const std::string& name) {
  Key numbers;
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t from = at;
    while (at < name.size() && is_digit(name[at])) ++at;
    if (at == from) {
      ++at;
      continue;
    }
    const std::string run = name.substr(from, at - from);
    numbers.push_back(run.substr(std::min(run.find_first_not_of('0'), run.size())));
  }
  return numbers;
}

std::vector<Key> numbers_of(const std::vector<PatternView>& views) {
  std::vector<Key> keys;
  keys.reserve(views.size());
  for (const PatternView& view : views) keys.push_back(numbers_in(stem_of(view)));
  return keys;
}

std::vector<Key> stems_of(const std::vector<PatternView>& views) {
  std::vector<Key> keys;
  keys.reserve(views.size());
  for (const PatternView& view : views) keys.push_back({stem_of(view)});
  return keys;
}

/// Takes out the numbers that are one and the same in all names of the left and in all of the right: the cameras' own
/// numbers, or a date.
void drop_what_tells_nothing(std::vector<Key>& left, std::vector<Key>& right) {
  const std::size_t count = left.front().size();
  const auto as_many = [count](const Key& key) { return key.size() == count; };
  if (!std::all_of(left.begin(), left.end(), as_many) || !std::all_of(right.begin(), right.end(), as_many)) return;
  for (std::size_t i = count; i-- > 0;) {
    const auto constant = [i](const std::vector<Key>& keys) {
      return std::all_of(keys.begin(), keys.end(), [&](const Key& key) { return key[i] == keys.front()[i]; });
    };
    if (!constant(left) || !constant(right)) continue;
    for (std::vector<Key>* keys : {&left, &right}) {
      for (Key& key : *keys) key.erase(key.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

using Places = std::map<Key, std::size_t>;

/// Where each key is; empty if two are alike.
std::optional<Places> places_of(const std::vector<Key>& keys) {
  Places places;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (!places.emplace(keys[i], i).second) return std::nullopt;
  }
  return places;
}

Error named_alike(const std::vector<PatternView>& views, const char* side) {
  std::map<std::string, std::string> names;
  for (const PatternView& view : views) {
    const auto [first, fresh] = names.emplace(stem_of(view), view.name);
    if (!fresh)
      return {Errc::bad_value, fmt::format("{} pictures {} and {}: left and right pair by name, and these are named "
                                           "alike: name each by its view's number",
                                           side, first->second, view.name)};
  }
  return {Errc::bad_value, fmt::format("the {} pictures' names do not tell them apart", side)};
}

/// "left4.png, left7.png and 3 more (left)", or nothing.
std::string words_for(const std::vector<std::string>& names, const char* side) {
  constexpr std::size_t kMost = 5;
  if (names.empty()) return {};
  const std::vector<std::string> first(names.begin(),
                                       names.begin() + static_cast<std::ptrdiff_t>(std::min(names.size(), kMost)));
  const std::string more = names.size() > kMost ? fmt::format(" and {} more", names.size() - kMost) : "";
  return fmt::format("{}{} ({})", fmt::join(first, ", "), more, side);
}

}  // namespace

Result<void> pair_by_name(const std::vector<PatternView>& left, std::vector<PatternView>& right) {
  if (left.empty() || right.empty()) return Error{Errc::bad_value, "no pictures of one of the two cameras"};
  std::vector<Key> left_keys = numbers_of(left), right_keys = numbers_of(right);
  drop_what_tells_nothing(left_keys, right_keys);
  auto left_at = places_of(left_keys), right_at = places_of(right_keys);
  if (!left_at || !right_at) {
    left_keys = stems_of(left);
    left_at = places_of(left_keys);
    if (!left_at) return named_alike(left, "left");
    right_at = places_of(stems_of(right));
    if (!right_at) return named_alike(right, "right");
  }
  std::vector<std::string> left_alone, right_alone;
  for (const auto& [key, place] : *left_at) {
    if (!right_at->contains(key)) left_alone.push_back(left[place].name);
  }
  for (const auto& [key, place] : *right_at) {
    if (!left_at->contains(key)) right_alone.push_back(right[place].name);
  }
  if (!left_alone.empty() || !right_alone.empty()) {
    for (auto* names : {&left_alone, &right_alone}) std::sort(names->begin(), names->end(), before_by_number);
    return Error{Errc::bad_value,
                 fmt::format("without a partner of the same number or name: {}{}{}: left and right "
                             "pair by name; give both pictures of each view, or neither",
                             words_for(left_alone, "left"), left_alone.empty() || right_alone.empty() ? "" : ", ",
                             words_for(right_alone, "right"))};
  }
  std::vector<PatternView> ordered;
  ordered.reserve(right.size());
  for (const Key& key : left_keys) ordered.push_back(std::move(right[right_at->at(key)]));
  right = std::move(ordered);
  return {};
}

}  // namespace birdseye::host
