#include "host/calibrate/tip_phases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>

namespace birdseye::host {

namespace {

std::optional<Phase> parse_phase(std::string_view text) {
  Phase phase;
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, phase.first);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != '-') return std::nullopt;
  const auto last = std::from_chars(first.ptr + 1, end, phase.last);
  if (last.ec != std::errc() || last.ptr != end || phase.last < phase.first) return std::nullopt;
  return phase;
}

}  // namespace

Result<std::vector<Phase>> parse_phases(const std::string& text) {
  std::vector<Phase> phases;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.size(), text.find(',', at));
    const std::string item = text.substr(at, comma - at);
    const auto phase = parse_phase(item);
    if (!phase) {
      return Error{Errc::bad_value,
                   fmt::format("--phases: \"{}\" is no first-last; give them as 77-162,172-253", item)};
    }
    for (const Phase& other : phases) {
      if (phase->first <= other.last && other.first <= phase->last)
        return Error{Errc::bad_value, fmt::format("--phases: {} overlaps {}-{}", item, other.first, other.last)};
    }
    phases.push_back(*phase);
    at = comma + 1;
  }
  return phases;
}

Result<std::vector<std::optional<std::size_t>>> divots_of(const std::vector<Phase>& phases, const PoseSet& set) {
  const std::vector<TimedPose>& poses = set.poses;
  // Those at the end may be among the rejected.
  const std::size_t count = std::max(poses.empty() ? 0 : poses.back().index + 1, poses.size() + set.rejected.size());
  std::vector<std::optional<std::size_t>> divots(poses.size());
  for (std::size_t k = 0; k < phases.size(); ++k) {
    bool any = false;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (poses[i].index < phases[k].first || poses[i].index > phases[k].last) continue;
      divots[i] = k;
      any = true;
    }
    if (phases[k].last >= count) {
      return Error{Errc::bad_value, fmt::format("--phases: {}-{} goes beyond the {} poses, counted from 0",
                                                phases[k].first, phases[k].last, count)};
    }
    if (!any) {
      return Error{Errc::bad_value,
                   fmt::format("--phases: {}-{} holds no poses that can be used", phases[k].first, phases[k].last)};
    }
  }
  return divots;
}

}  // namespace birdseye::host
