#include "hw-sim/phantom/json_file.hpp"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace birdseye::hw_sim {

nlohmann::json json_of(const Eigen::Vector3d& v) {
  return nlohmann::json::array({v.x(), v.y(), v.z()});
}

nlohmann::json json_of(const Eigen::Matrix4d& m) {
  nlohmann::json rows = nlohmann::json::array();
  for (int i = 0; i < 4; ++i) rows.push_back({m(i, 0), m(i, 1), m(i, 2), m(i, 3)});
  return rows;
}

Result<void> write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream out(path);
  out << text;
  out.close();
  if (!out) return Error{Errc::unreadable, fmt::format("{}: cannot be written; choose another --out", path.string())};
  return {};
}

Result<void> write_json(const std::filesystem::path& path, const nlohmann::json& json) {
  return write_text(path, json.dump(2) + "\n");
}

}  // namespace birdseye::hw_sim
