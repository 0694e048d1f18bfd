#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// A folder that a command fills with files by names of its own. One of them, the sheet, is JSON and lists the others
/// under "files": what an earlier run wrote is known by it, and all else there is somebody's own.
struct ResultFolder {
  std::filesystem::path path;
  std::string command;  ///< as "register views", for messages
  std::string sheet;    ///< as "result.json"
  std::string names;    ///< a regular expression for those of the others
  /// A key that every sheet of the command has. Needed where sheets may lack a verdict, or a list of files; a sheet
  /// without a list owns all files whose names match. Empty: there are no such sheets.
  std::string key = {};
  const char* option = "--out";  ///< that names the folder, for messages
};

/// Before the work. Refuses, naming the file and the remedy, where one of its names is taken in the folder: by a file
/// that no earlier run wrote, by one of inputs, which may be files, folders, or empty, or by one of outputs: what the
/// command writes besides, as with --json; empty paths are passed over.
Result<void> check_free(const ResultFolder& folder, const std::vector<std::filesystem::path>& inputs,
                        const std::vector<std::filesystem::path>& outputs = {});

/// Whether its sheet is an earlier run's, also of one that did not end. For folders with a key.
bool is_of_earlier_run(const ResultFolder& folder);

/// Checks that, makes the folder, and removes what an earlier run wrote there, for nobody must take it for this one's.
/// Until the command writes its own sheet there is one that says that the run did not end. Answers what was removed.
Result<std::vector<std::string>> make_empty(const ResultFolder& folder,
                                            const std::vector<std::filesystem::path>& inputs);

/// What lies there by one of its names, but for the sheet: after make_empty(), all that the run wrote so far.
std::vector<std::string> files_of(const ResultFolder& folder);

}  // namespace birdseye::host
