#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>

#include "calibration/base/result.hpp"
#include "host/confine/run_confined_to.hpp"
#include "host/dicom/dicom_tree.hpp"

namespace birdseye::host {

/// Sends what was decoded.
using SendDecoded = std::function<void(const Send&)>;

/// What a decoder does: gives what sends its outcome, or why there is none. copies: of its process, to work with.
using Decode = std::function<Result<SendDecoded>(const Announce&, std::span<ProcessCopy> copies)>;

/// Runs decode in a process of its own (docs/decisions/0012-isolated-import.md) that is confined to the path
/// (run_confined_to), and that is silent for no longer than five minutes, and meanwhile take in this one. take: whether
/// all that was sent came. Errors name the path, or the file that decode announced last.
Result<void> run_decoder(const std::filesystem::path& path, const ConfinedCopies& copies, const Decode& decode,
                         const std::function<bool(const Receive&)>& take, const std::stop_token& stop = {});

/// Why a file was not decoded, by how its decoder ended (how_it_ended); empty: it sent what cannot be.
Error not_decoded(const std::filesystem::path& file, const std::optional<Error>& how);

/// Whether there is a file or folder that can be opened.
Result<void> check_can_be_opened(const std::filesystem::path& path);

/// Texts of any length, as JSON is; empty where not all of it comes.
void send_long_text(const Send& send, const std::string& text);
std::optional<std::string> receive_long_text(const Receive& receive);

}  // namespace birdseye::host
