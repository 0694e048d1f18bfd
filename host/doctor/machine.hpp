#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace birdseye::host {

/// The machine that is asked, as the kernel shows it in files.
struct Machine {
  std::filesystem::path root = "/";  ///< where /dev, /sys, /proc and /etc are: a test's own folder has what it likes
  /// Whether this user may read and write a device node, as the kernel says without opening it.
  std::function<bool(const std::filesystem::path&)> may_use;

  /// path: from the root, as "/dev/video0".
  [[nodiscard]] std::filesystem::path at(const std::string& path) const { return root / path.substr(1); }
};
Machine this_machine();

/// A file's first line without blanks at its end; empty where there is none.
std::string first_line(const std::filesystem::path& file);
/// The names in a folder, "video2" before "video10"; none where there is no such folder. Bounded.
std::vector<std::string> names_in(const std::filesystem::path& folder);

/// Who has a device open, as far as this user is shown.
struct Holders {
  std::vector<std::string> programs;  ///< "birdseyed (process 812)"
  bool all_seen = false;              ///< false: programs of other users may hold it without being seen
};
Holders holders_of(const Machine& machine, const std::string& device);

/// The processes whose program is called so, by number.
std::vector<int> processes_named(const Machine& machine, const std::string& program);

/// Why this user may not use a device node, and what to do about it.
struct Refusal {
  std::string found, remedy;
};
/// Empty where he may.
std::optional<Refusal> refusal(const Machine& machine, const std::string& device);

}  // namespace birdseye::host
