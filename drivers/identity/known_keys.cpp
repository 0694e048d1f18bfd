#include "drivers/identity/known_keys.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "drivers/identity/identity_folder.hpp"
#include "drivers/system/durable.hpp"
#include "drivers/system/part_file.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye {

namespace fs = std::filesystem;

bool KnownKeys::is_name(std::string_view name) {
  return !name.empty() && name.size() <= kMostNameBytes && name.front() != '#' && name != "own" && name != "." &&
         name != ".." && std::none_of(name.begin(), name.end(), [](char c) {
           return static_cast<unsigned char>(c) <= ' ' || c == 127 || c == '/';
         });
}

std::string KnownKeys::objection(const Machine& machine) const {
  if (!is_name(machine.name)) {
    return fmt::format(
        "\"{}\" is no name of a machine: give one word of at most {} bytes without spaces, # before it or / in it, and "
        "not \"own\", \".\" or \"..\"",
        machine.name, kMostNameBytes);
  }
  for (const Machine& known : machines_) {
    if (known.name == machine.name && known.key != machine.key)
      return fmt::format("another key has the name {} already: give another name, as {}", machine.name,
                         free_name(machine.name));
  }
  return {};
}

std::string KnownKeys::free_name(const std::string& name) const {
  std::string free = name;
  const auto has_it = [&free](const Machine& known) { return known.name == free; };
  for (int number = 2; std::ranges::any_of(machines_, has_it); ++number) {
    const std::string behind = fmt::format("-{}", number);
    free = name.substr(0, kMostNameBytes - behind.size()) + behind;
  }
  return free;
}

Result<KnownKeys> KnownKeys::read(const fs::path& folder, const std::optional<Machine>& own) {
  KnownKeys out(folder / "known");
  // First, so that its key has its own name whatever a line says.
  const auto with_own = [&] {
    if (own) out.machines_.insert(out.machines_.begin(), Machine{out.free_name(own->name), own->key});
    return out;
  };
  struct stat status = {};
  if (::stat(out.file_.c_str(), &status) != 0) {
    if (errno == ENOENT || errno == ENOTDIR) return with_own();
    return Error{Errc::unreadable, fmt::format("{}: cannot be read ({}); see whose file and folder it is, and its disk",
                                               out.file_.string(), std::strerror(errno))};
  }
  if (const auto checked = check_owner(out.file_, status); !checked) return checked.error();
  if ((status.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    return Error{Errc::bad_value, fmt::format("{}: others than its owner may say in it which machines are known: chmod "
                                              "644 {}, and look whether each line is yours",
                                              out.file_.string(), out.file_.string())};
  }
  const auto text = read_whole_file(out.file_, kMostTextBytes);
  if (!text) return text.error();
  std::istringstream in(*text);
  std::string line;
  int number = 1;
  for (; std::getline(in, line); ++number) {
    if (line.empty() || line.front() == '#') continue;
    std::istringstream words(line);
    Machine machine;
    std::string hex, more;
    words >> machine.name >> hex;
    const auto key = PublicKey::of_hex(hex);
    if (key) machine.key = *key;
    std::string why = key ? out.objection(machine) : "is no machine's name and key";
    if (words >> more) why = "is more than a machine's name and key";
    if (!why.empty())
      return Error{Errc::bad_format,
                   fmt::format("{}: line {}: {}; mend or remove the line", out.file_.string(), number, why)};
    out.machines_.push_back(std::move(machine));
  }
  return with_own();
}

KnownKeys KnownKeys::of_own(const Machine& own) {
  KnownKeys out{fs::path()};
  out.machines_.push_back(own);
  return out;
}

std::optional<std::string> KnownKeys::name_of(const PublicKey& key) const {
  const auto found = std::find_if(machines_.begin(), machines_.end(), [&](const Machine& m) { return m.key == key; });
  if (found == machines_.end()) return std::nullopt;
  return found->name;
}

Result<void> KnownKeys::add(const std::string& name, const PublicKey& key) {
  if (name_of(key)) return {};
  if (file_.empty()) return Error{Errc::unsupported, "there is no file of known keys"};
  const Machine machine{name, key};
  if (const std::string why = objection(machine); !why.empty()) return Error{Errc::bad_value, why};
  if (auto made = make_folder_durably(file_.parent_path()); !made) return made;
  std::string text;
  if (auto there = read_whole_file(file_, kMostTextBytes)) {
    text = *std::move(there);
  } else if (there.error().code != Errc::not_found) {
    return there.error();
  }
  if (!text.empty() && text.back() != '\n') text += '\n';
  text += fmt::format("{} {}\n", name, key.hex());
  if (auto written = write_durably(file_, text, fs::perms::owner_read | fs::perms::owner_write); !written)
    return written;
  machines_.push_back(machine);
  return {};
}

}  // namespace birdseye
