#pragma once

#include <span>
#include <string_view>

namespace birdseye::host {

/// The structures of TotalSegmentator 2, task "total", as its class map counts them: the first is label 1.
std::span<const std::string_view> totalsegmentator_names();

}  // namespace birdseye::host
