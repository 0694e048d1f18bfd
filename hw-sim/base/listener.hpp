#pragma once

#include <filesystem>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::hw_sim {

/// A socket, not blocking, that listens at a path, whatever was there before.
Result<drivers::UniqueFd> listen_at_path(const std::filesystem::path& path);
/// Likewise at a TCP port of an IPv4 address; port 0 takes a free one, and says which.
Result<drivers::UniqueFd> listen_at_port(const std::string& host, int& port);

}  // namespace birdseye::hw_sim
