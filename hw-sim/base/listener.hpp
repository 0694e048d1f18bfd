#pragma once

#include <filesystem>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::hw_sim {

/// A non-blocking socket that listens at a path, replacing whatever was there.
Result<UniqueFd> listen_at_path(const std::filesystem::path& path);
/// The same at a TCP port of an IPv4 address. Port 0 takes a free one and is set to it.
Result<UniqueFd> listen_at_port(const std::string& host, int& port);

}  // namespace birdseye::hw_sim
