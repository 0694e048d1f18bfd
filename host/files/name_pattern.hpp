#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// Whether name holds a * or a ?, which stand for any letters and for one.
bool is_pattern(std::string_view name);
/// Whether name is what pattern says. A pattern without * and ? says one name.
bool matches(std::string_view name, std::string_view pattern);

/// The files and folders in a folder whose names match, in the order of their names, numbers in them by value. Refuses
/// a folder that cannot be read; none that match are no error.
Result<std::vector<std::filesystem::path>> files_matching(const std::filesystem::path& folder,
                                                          std::string_view pattern);

}  // namespace birdseye::host
