#pragma once

#include <filesystem>
#include <string>

#include "host/operation/operation.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Whether the text of an operation.json is of 0.1.0, which had no format.
bool is_of_010(const std::string& text);

/// What the window of 0.1.0 kept in a folder: operation.json, camera.yaml, camera_from_sensor.txt,
/// patient_from_tracker.txt and field.mha. Nothing bound these files together, so nobody can tell whether one was
/// changed since. What they do not say is not known: instruments, labels, the record, the scope's name, and hand-eye's
/// held-out error, in whose place 0.1.0 kept what its fit left. Refuses, naming the file, what is missing or damaged,
/// and a CT other than the operation's.
Result<Operation> read_operation_010(const std::filesystem::path& folder, const Volume& ct);

}  // namespace birdseye::host
