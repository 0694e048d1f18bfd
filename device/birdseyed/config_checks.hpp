#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace birdseye::device {

/// What is wrong with a value of the configuration, in words; empty: nothing.
std::string fault_of_bird_names(const std::vector<std::string>& names);
/// Of a socket's path, where the value begins with `kind`, as "socket:"; of any other value nothing.
std::string fault_of_socket(const std::string& value, const std::string& kind);
/// Of a folder that is there, or will be made.
std::string fault_of_folder(const std::filesystem::path& folder);

}  // namespace birdseye::device
