#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>

#include "calibration/base/result.hpp"
#include "host/confine/isolated.hpp"
#include "host/dicom/dicom_tree.hpp"

namespace birdseye::host {

/// Sends what was decoded.
using SendDecoded = std::function<void(const Send&)>;

/// Runs decode in a process of its own (docs/decisions/0012-isolated-import.md) that is confined to the path
/// (confine_to), and that lasts no longer than five minutes, and meanwhile take in this one. decode: gives what sends
/// its outcome, or why there is none. take: whether all that was sent came. Errors name the path, or the file that
/// decode announced last.
Result<void> run_decoder(const std::filesystem::path& path,
                         const std::function<Result<SendDecoded>(const Announce&)>& decode,
                         const std::function<bool(const Receive&)>& take, const std::stop_token& stop = {});

/// Whether there is a file or folder that can be opened.
Result<void> check_can_be_opened(const std::filesystem::path& path);

/// Texts of any length, as JSON is; empty where not all of it comes.
void send_long_text(const Send& send, const std::string& text);
std::optional<std::string> receive_long_text(const Receive& receive);

}  // namespace birdseye::host
