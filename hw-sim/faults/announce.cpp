#include "hw-sim/faults/announce.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>

#include "drivers/system/part_file.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::hw_sim {

namespace {

/// To a pipe or a device, which is not waited for.
Result<void> write_at_once(const std::filesystem::path& path, const std::string& text) {
  const UniqueFd fd(::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  if (!fd && errno == ENXIO)
    return Error{Errc::unreadable, fmt::format("{}: nobody reads this pipe; start its reader first", path.string())};
  if (fd && ::write(fd.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size())) return {};
  return Error{Errc::unreadable, fmt::format("{}: cannot be written; does its reader take what comes?", path.string())};
}

}  // namespace

void announce(const nlohmann::json& event) {
  const std::string line = event.dump() + '\n';
  std::fwrite(line.data(), 1, line.size(), stdout);
  std::fflush(stdout);
}

void announce(const FaultEvent& event) {
  announce({{"event", "fault"},
            {"name", fault_name(event.kind)},
            {"of", target_name(event.target)},
            {"phase", event.begin ? "begin" : "end"},
            {"monotonic_ns", event.at_ns}});
}

Result<void> replace_json(const std::filesystem::path& path, const nlohmann::json& json) {
  const std::string text = json.dump(2) + '\n';
  std::error_code error;
  if (std::filesystem::is_other(path, error)) return write_at_once(path, text);
  const auto part = PartFile::make(path);
  if (!part) return part.error();
  std::ofstream out(part->path());
  out << text;
  out.close();
  error.clear();
  // It is not brought onto the disk: an instrument that runs has no time for that.
  if (out) std::filesystem::rename(part->path(), path, error);
  if (!out || error)
    return Error{Errc::unreadable, fmt::format("{}: cannot be written; is the disk full?", path.string())};
  return {};
}

}  // namespace birdseye::hw_sim
