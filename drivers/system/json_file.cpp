#include "drivers/system/json_file.hpp"

#include <nlohmann/json.hpp>
#include <string>

#include "calibration/base/nesting.hpp"

namespace birdseye {

Result<nlohmann::json> read_json_file(const std::filesystem::path& path, std::size_t most_bytes) {
  const auto text = read_whole_file(path, most_bytes);
  if (!text) return text.error();
  auto json = nests_too_deeply(*text, Notation::json) ? nlohmann::json(nlohmann::json::value_t::discarded)
                                                      : nlohmann::json::parse(*text, nullptr, false);
  if (json.is_discarded())
    return Error{Errc::bad_format, path.string() + ": is not JSON; take a copy that is as it was written"};
  return json;
}

}  // namespace birdseye
