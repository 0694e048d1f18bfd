#pragma once

#include <filesystem>
#include <stop_token>

#include "device/birdseyed/recording.hpp"
#include "device/wire/server.hpp"

namespace birdseye::device {

/// Publishes what a recording's appliance said, byte for byte, at the pace of its events. An error where the recording
/// is damaged, after all that is sound.
Result<void> replay(const std::filesystem::path& recording, wire::Server& server, const std::stop_token& stop);

}  // namespace birdseye::device
