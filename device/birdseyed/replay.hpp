#pragma once

#include <filesystem>
#include <stop_token>
#include <string>

#include "device/birdseyed/recording.hpp"
#include "device/wire/server.hpp"

namespace birdseye::device {

/// Refuses a recording that was changed since it was signed, and, unless it is to be accepted all the same, one that is
/// not signed, or by a machine that is not known here, and one whose poses rest on a map that no known machine had
/// signed. Answers the SHA-256 of what it admitted.
Result<std::string> admit_replay(const std::filesystem::path& recording, bool accept_unsigned);

/// Publishes again, byte for byte and at the pace of the events, what the appliance said during a recording. Where the
/// recording is damaged, or was changed since admit_replay() answered `sha256`: an error, after what could be read was
/// published. Where its poses rest on a map that no known machine had signed, health says so once a second, and nothing
/// else.
Result<void> replay(const std::filesystem::path& recording, const std::string& sha256, wire::Server& server,
                    const std::stop_token& stop);

}  // namespace birdseye::device
