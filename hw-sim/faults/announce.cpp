#include "hw-sim/faults/announce.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

namespace birdseye::hw_sim {

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
  const std::filesystem::path fresh = path.string() + ".new";
  std::ofstream out(fresh);
  out << json.dump(2) << '\n';
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(fresh, path, error);
  if (!out || error) return Error{Errc::unreadable, fmt::format("{}: cannot be written", path.string())};
  return {};
}

}  // namespace birdseye::hw_sim
