#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json_fwd.hpp>

namespace birdseye::testing {

/// A template, so that who includes this without reading any JSON need not compile it.
template <typename Json = nlohmann::json>
Json read_json(const std::filesystem::path& path) {
  return Json::parse(std::ifstream(path));
}

}  // namespace birdseye::testing
