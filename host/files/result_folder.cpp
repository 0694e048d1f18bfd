#include "host/files/result_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>
#include <system_error>

#include "drivers/system/durable.hpp"
#include "drivers/system/json_file.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr const char* kUnended = "did_not_end";

/// By its key, or as one that did not end.
bool is_sheet_of(const ResultFolder& folder, const nlohmann::json& sheet) {
  return (sheet.contains("verdict") && sheet.contains(kUnended)) || (!folder.key.empty() && sheet.contains(folder.key));
}

/// What in the folder is of an earlier run by its sheet: a list of names, or an object by name.
std::vector<std::string> written_before(const ResultFolder& folder) {
  const auto sheet = read_json_file(folder.path / folder.sheet);
  if (!sheet || !sheet->is_object() || !(sheet->contains("verdict") || is_sheet_of(folder, *sheet))) return {};
  std::vector<std::string> written{folder.sheet};
  if (const auto listed = sheet->find("files"); listed != sheet->end()) {
    for (const auto& [key, value] : listed->items()) {
      if (!listed->is_array())
        written.push_back(key);
      else if (value.is_string())
        written.push_back(value.get<std::string>());
    }
    return written;
  }
  // Where it began, none of its names was taken.
  if (!is_sheet_of(folder, *sheet)) return {};
  for (std::string& name : files_of(folder)) written.push_back(std::move(name));
  return written;
}

/// What the command writes besides may not be one of the folder's own files.
Result<void> check_besides(const ResultFolder& folder, const std::vector<fs::path>& outputs) {
  const std::regex of_it(folder.names);
  for (const fs::path& output : outputs) {
    if (output.empty()) continue;
    std::error_code ignored;
    if (fs::is_directory(output, ignored))
      return Error{Errc::bad_value, fmt::format("{}: is a folder; give a file", output.string())};
    const std::string name = output.filename().string();
    if ((name == folder.sheet || std::regex_match(name, of_it)) && same_file(output, folder.path / name)) {
      return Error{Errc::bad_value, fmt::format("{}: the folder of {} holds this file by itself; give --json another "
                                                "name",
                                                output.string(), folder.command)};
    }
  }
  return {};
}

/// All in the folder that has one of its names, the sheet, too.
std::vector<std::string> taken_names(const ResultFolder& folder) {
  std::vector<std::string> names = files_of(folder);
  std::error_code ignored;
  if (fs::exists(fs::symlink_status(folder.path / folder.sheet, ignored))) names.push_back(folder.sheet);
  return names;
}

}  // namespace

Result<void> check_free(const ResultFolder& folder, const std::vector<fs::path>& inputs,
                        const std::vector<fs::path>& outputs) {
  if (auto besides = check_besides(folder, outputs); !besides) return besides;
  const std::vector<std::string> written = written_before(folder);
  for (const std::string& name : taken_names(folder)) {
    const fs::path file = folder.path / name;
    std::error_code ignored;
    const auto is_this = [&](const fs::path& input) { return !input.empty() && fs::equivalent(input, file, ignored); };
    if (std::ranges::any_of(inputs, is_this)) {
      return Error{Errc::bad_value, fmt::format("{}: is read, and would be written over by {}; give another {}",
                                                file.string(), folder.command, folder.option)};
    }
    if (std::ranges::count(written, name) == 0) {
      return Error{Errc::bad_value,
                   fmt::format("{}: is there, and not of an earlier {}; give another {}, or move the file away",
                               file.string(), folder.command, folder.option)};
    }
  }
  return {};
}

bool is_of_earlier_run(const ResultFolder& folder) {
  const auto sheet = read_json_file(folder.path / folder.sheet);
  return sheet && sheet->is_object() && is_sheet_of(folder, *sheet);
}

Result<std::vector<std::string>> make_empty(const ResultFolder& folder, const std::vector<fs::path>& inputs) {
  if (auto is_free = check_free(folder, inputs); !is_free) return is_free.error();
  if (auto made = make_folder_durably(folder.path); !made) return made.error();
  const std::vector<std::string> old = taken_names(folder);
  const nlohmann::json unended{
      {"verdict", "fail"}, {"reasons", {folder.command + " did not come to its end"}}, {kUnended, true}};
  // First: what is left, if the power goes now, is known as an earlier run's.
  if (auto written = write_file(folder.path / folder.sheet, text_of(unended)); !written) return written.error();
  for (const std::string& name : old) {
    if (name == folder.sheet) continue;
    std::error_code error;
    fs::remove(folder.path / name, error);
    if (error) {
      return Error{Errc::unreadable, fmt::format("{}: is of an earlier {} and cannot be removed; give another {}",
                                                 (folder.path / name).string(), folder.command, folder.option)};
    }
  }
  return old;
}

std::vector<std::string> files_of(const ResultFolder& folder) {
  const std::regex of_it(folder.names);
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder.path, error), end; !error && it != end; it.increment(error)) {
    std::string name = it->path().filename().string();
    if (name != folder.sheet && std::regex_match(name, of_it)) names.push_back(std::move(name));
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace birdseye::host
