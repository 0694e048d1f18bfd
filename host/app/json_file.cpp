#include "host/app/json_file.hpp"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

namespace birdseye::host {

Result<void> write_file(const std::filesystem::path& path, const std::string& text) {
  const std::filesystem::path temporary = path.string() + ".part";
  {
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    out << text;
    out.flush();
    if (!out) {
      return Error{Errc::unreadable,
                   fmt::format("{}: cannot be written; check the folder and its permissions", path.string())};
    }
  }
  std::error_code error;
  std::filesystem::rename(temporary, path, error);
  if (error) {
    std::filesystem::remove(temporary, error);
    return Error{Errc::unreadable, fmt::format("{}: cannot be replaced", path.string())};
  }
  return {};
}

Result<void> write_json(const std::filesystem::path& path, const nlohmann::json& json) {
  return write_file(path, json.dump(2) + "\n");
}

}  // namespace birdseye::host
