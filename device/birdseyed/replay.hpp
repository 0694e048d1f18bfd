#pragma once

#include <filesystem>
#include <stop_token>

#include "device/birdseyed/recording.hpp"
#include "device/wire/server.hpp"

namespace birdseye::device {

/// Publishes again, byte for byte and at the pace of the events, what the appliance said during a recording. Where the
/// recording is damaged: an error, after all that is sound was published.
Result<void> replay(const std::filesystem::path& recording, wire::Server& server, const std::stop_token& stop);

}  // namespace birdseye::device
