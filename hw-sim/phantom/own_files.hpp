#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::hw_sim {

/// The files that a command writes into a folder by names of its own. They are listed in a file there, which is written
/// before any of them: what an earlier run wrote is known by it, and all else is somebody's own.
struct OwnFiles {
  std::filesystem::path folder;
  std::string command;                  ///< as "birdseye-sim case", for messages
  std::string list;                     ///< as "birdseye-sim-case.json"
  std::vector<std::string> subfolders;  ///< that some of them lie in, as "truth"
  std::string names;                    ///< a regular expression for them, as "case\\.toml|truth/truth\\.json"
};

/// Before the work. Refuses, naming the file and the remedy, where one of the names is taken by a file that no earlier
/// run lists.
Result<void> check_free(const OwnFiles& own);
/// After it: makes the folders, lists the names that are to be written, and removes what an earlier run wrote by any of
/// its names.
Result<void> begin_files(const OwnFiles& own, const std::vector<std::string>& names);

}  // namespace birdseye::hw_sim
