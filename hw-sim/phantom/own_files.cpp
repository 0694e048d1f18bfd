#include "hw-sim/phantom/own_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <system_error>

#include "drivers/system/json_file.hpp"
#include "hw-sim/phantom/json_file.hpp"

namespace birdseye::hw_sim {

namespace {

namespace fs = std::filesystem;

constexpr const char* kCommand = "written_by";
constexpr const char* kFiles = "files";

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(path, ignored));
}

/// What in the folder has one of the names.
std::vector<std::string> taken_names(const OwnFiles& own) {
  const std::regex of_it(own.names);
  std::vector<std::string> subfolders = own.subfolders, taken;
  subfolders.emplace_back();
  for (const std::string& subfolder : subfolders) {
    std::error_code error;
    for (fs::directory_iterator it(own.folder / subfolder, error), end; !error && it != end; it.increment(error)) {
      std::string name = (fs::path(subfolder) / it->path().filename()).string();
      if (std::regex_match(name, of_it)) taken.push_back(std::move(name));
    }
  }
  std::ranges::sort(taken);
  return taken;
}

/// What an earlier run listed. Empty where the list is not one of this command.
std::optional<std::vector<std::string>> listed_names(const OwnFiles& own) {
  const auto json = read_json_file(own.folder / own.list);
  if (!json || !json->is_object() || !json->contains(kCommand) || (*json)[kCommand] != own.command) return std::nullopt;
  std::vector<std::string> names;
  if (const auto files = json->find(kFiles); files != json->end() && files->is_array()) {
    for (const auto& name : *files) {
      if (name.is_string()) names.push_back(name.get<std::string>());
    }
  }
  return names;
}

Error taken(const OwnFiles& own, const std::string& name) {
  return {Errc::bad_value,
          fmt::format("{}: is there, and no earlier {} lists it in {}; choose another --out, or move it "
                      "away",
                      (own.folder / name).string(), own.command, own.list)};
}

Result<void> write_list(const OwnFiles& own, std::vector<std::string> names) {
  std::ranges::sort(names);
  return write_json(own.folder / own.list, {{kCommand, own.command}, {kFiles, names}});
}

}  // namespace

Result<void> check_free(const OwnFiles& own) {
  const auto listed = listed_names(own);
  if (!listed && is_there(own.folder / own.list)) return taken(own, own.list);
  for (const std::string& name : taken_names(own)) {
    if (!listed || std::ranges::count(*listed, name) == 0) return taken(own, name);
  }
  return {};
}

Result<void> begin_files(const OwnFiles& own, const std::vector<std::string>& names) {
  std::vector<std::string> folders = own.subfolders;
  folders.emplace_back();
  for (const std::string& folder : folders) {
    std::error_code error;
    fs::create_directories(own.folder / folder, error);
    if (error) {
      return Error{Errc::unreadable,
                   fmt::format("{}: cannot be made; choose another --out", (own.folder / folder).string())};
    }
  }
  const std::vector<std::string> old = taken_names(own);
  std::vector<std::string> either = names;
  for (const std::string& name : old) {
    if (std::ranges::count(names, name) == 0) either.push_back(name);
  }
  // First: what there is if the run ends now is known as its own.
  if (auto listed = write_list(own, either); !listed) return listed;
  for (const std::string& name : old) {
    std::error_code error;
    fs::remove(own.folder / name, error);
    if (error) {
      return Error{Errc::unreadable, fmt::format("{}: is of an earlier {} and cannot be removed; choose another --out",
                                                 (own.folder / name).string(), own.command)};
    }
  }
  return old.empty() ? Result<void>() : write_list(own, names);
}

}  // namespace birdseye::hw_sim
