#include "host/dicom/series_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>

#include "calibration/base/lower_case.hpp"
#include "host/dicom/phase_words.hpp"

namespace birdseye::host {

namespace {

using Fits = std::function<bool(const SeriesInfo&)>;

std::vector<std::size_t> those_that(const std::vector<SeriesInfo>& series, const Fits& fits) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (fits(series[i])) found.push_back(i);
  }
  return found;
}

/// "1 'native', 2 'portal' and 7 more".
std::string names_of(const std::vector<SeriesInfo>& series, const std::vector<std::size_t>& some) {
  constexpr std::size_t kNamed = 8;
  std::string names;
  for (std::size_t i = 0; i < std::min(some.size(), kNamed); ++i)
    names += fmt::format("{}{}", i == 0 ? "" : ", ", series_name(series[some[i]]));
  if (some.size() > kNamed) names += fmt::format(" and {} more", some.size() - kNamed);
  return names;
}

/// Whether a series has that number, and more behind it: "3b" and "3.2" have 3, "30" has not.
bool is_of_number(const std::string& id, const std::string& number) {
  return !number.empty() && id.starts_with(number) && id.size() > number.size() &&
         (id[number.size()] < '0' || id[number.size()] > '9');
}

Result<std::size_t> choose_unnamed(const std::vector<SeriesInfo>& series) {
  auto left = those_that(series, [](const SeriesInfo& one) { return !one.passed_over; });
  if (left.empty()) left = those_that(series, [](const SeriesInfo&) { return true; });
  if (left.empty()) return Error{Errc::not_found, "holds no series; give the folder that holds one"};
  // One slice is no volume where there are volumes: a picture to plan by, or one that was kept.
  if (left.size() > 1) {
    const auto thick = those_that(series, [](const SeriesInfo& one) { return !one.passed_over && one.size[2] != 1; });
    if (!thick.empty()) left = thick;
  }
  if (left.size() == 1) return left.front();
  std::set<std::string> uids;
  for (const std::size_t i : left) uids.insert(series[i].uid);
  return Error{Errc::unsupported,
               fmt::format("holds {} {} ({}); name one with --series", left.size(),
                           uids.size() == left.size() ? "series" : "volumes", names_of(series, left))};
}

}  // namespace

std::string series_name(const SeriesInfo& series) {
  std::string words = series.description;
  if (!series.part.empty()) words += fmt::format("{}{}", words.empty() ? "" : ", ", series.part);
  return words.empty() ? series.id : fmt::format("{} '{}'", series.id, words);
}

Result<std::size_t> choose_series(const std::vector<SeriesInfo>& series, const std::string& wanted) {
  if (wanted.empty()) return choose_unnamed(series);
  const std::string text = lower_case(wanted), phase = phase_named_in(wanted);
  const Fits rules[] = {
      [&](const SeriesInfo& one) { return one.id == text || one.uid == wanted; },
      [&](const SeriesInfo& one) { return is_of_number(one.id, text); },
      [&](const SeriesInfo& one) { return lower_case(one.description) == text; },
      [&](const SeriesInfo& one) { return !phase.empty() && one.phase == phase; },
      [&](const SeriesInfo& one) { return one.part == text; },
      [&](const SeriesInfo& one) { return lower_case(one.description).find(text) != std::string::npos; },
      [&](const SeriesInfo& one) { return lower_case(one.part).find(text) != std::string::npos; },
  };
  for (const Fits& rule : rules) {
    const auto found = those_that(series, rule);
    if (found.empty()) continue;
    if (found.size() == 1) return found.front();
    // Of those that share a UID or a phase, one may be all that can be read.
    std::vector<std::size_t> sound;
    for (const std::size_t i : found) {
      if (series[i].problem.empty()) sound.push_back(i);
    }
    if (sound.size() == 1) return sound.front();
    return Error{Errc::unsupported, fmt::format("--series {} fits {} ({}); name one by its number", wanted,
                                                found.size(), names_of(series, found))};
  }
  if (series.empty()) return Error{Errc::not_found, fmt::format("--series {}: the files hold no series", wanted)};
  return Error{Errc::not_found,
               fmt::format("--series {}: there is no such series; name one of {}", wanted,
                           names_of(series, those_that(series, [](const SeriesInfo&) { return true; })))};
}

}  // namespace birdseye::host
