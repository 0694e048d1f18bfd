#include "host/doctor/machine.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <sstream>

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNames = 65'536;  // of a folder; /proc has one a process

std::optional<int> number_of(const std::string& text) {
  int number = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (failed != std::errc() || end != text.data() + text.size() || number < 0) return std::nullopt;
  return number;
}

/// "video" and 10 of "video10"; 0 where no number ends it.
std::pair<std::string, int> parted(const std::string& name) {
  const std::size_t last = name.find_last_not_of("0123456789");
  const std::size_t begin = last == std::string::npos ? 0 : last + 1;
  return {name.substr(0, begin), number_of(name.substr(begin)).value_or(0)};
}

std::string program_words(const Machine& machine, int process) {
  const std::string program = first_line(machine.at(fmt::format("/proc/{}/comm", process)));
  return program.empty() ? fmt::format("process {}", process) : fmt::format("{} (process {})", program, process);
}

/// Who has locked the node, which the kernel tells to everybody.
std::vector<int> lockers_of(const Machine& machine, const std::string& device) {
  std::vector<int> found;
  struct stat node {};
  if (::stat(machine.at(device).c_str(), &node) != 0) return found;
  const std::string id =
      fmt::format("{:02x}:{:02x}:{}", major(node.st_dev), minor(node.st_dev), static_cast<std::uint64_t>(node.st_ino));
  std::ifstream locks(machine.at("/proc/locks"));
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, way, access, process, where;
    words >> number >> kind >> way >> access >> process >> where;
    if (where == id) found.push_back(number_of(process).value_or(0));
  }
  return found;
}

/// The numbers and names of the groups in /etc/group, and who is in them.
struct Group {
  std::string name;
  std::string members;  ///< ",anna,otto,"
};
std::optional<Group> group_of(const Machine& machine, gid_t id) {
  std::ifstream file(machine.at("/etc/group"));
  for (std::string line; std::getline(file, line);) {
    std::istringstream parts(line);
    std::string name, password, number, members;
    std::getline(parts, name, ':');
    std::getline(parts, password, ':');
    std::getline(parts, number, ':');
    std::getline(parts, members);
    if (number == std::to_string(id)) return Group{name, "," + members + ","};
  }
  return std::nullopt;
}

std::string user_name(const Machine& machine) {
  const std::string id = std::to_string(::geteuid());
  std::ifstream file(machine.at("/etc/passwd"));
  for (std::string line; std::getline(file, line);) {
    std::istringstream parts(line);
    std::string name, password, number;
    std::getline(parts, name, ':');
    std::getline(parts, password, ':');
    std::getline(parts, number, ':');
    if (number == id) return name;
  }
  return "USER";
}

/// How the device comes to a group that may open it. Debian's own rules do it for serial ports, unless others undo it.
std::string group_rule(const std::string& device) {
  if (device.starts_with("/dev/tty")) {
    return fmt::format(
        "write SUBSYSTEM==\"tty\", KERNEL==\"{}\", GROUP=\"dialout\", MODE=\"0660\" into "
        "/etc/udev/rules.d/61-line.rules and start the machine again",
        device.substr(5));
  }
  return "install packaging/60-birdseye.rules as /etc/udev/rules.d/60-birdseye.rules, run \"sudo udevadm control "
         "--reload\" and plug the device in again";
}

}  // namespace

Machine this_machine() {
  Machine machine;
  machine.may_use = [](const fs::path& path) {
    return ::faccessat(AT_FDCWD, path.c_str(), R_OK | W_OK, AT_EACCESS) == 0;
  };
  return machine;
}

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  line.erase(line.find_last_not_of(" \t\r\n") + 1);
  return line;
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end && names.size() < kMostNames;
       at.increment(error))
    names.push_back(at->path().filename().string());
  std::sort(names.begin(), names.end(),
            [](const std::string& a, const std::string& b) { return parted(a) < parted(b); });
  return names;
}

Holders holders_of(const Machine& machine, const std::string& device) {
  Holders holders{{}, true};
  std::vector<int> processes = lockers_of(machine, device);
  for (const std::string& name : names_in(machine.at("/proc"))) {
    const auto process = number_of(name);
    if (!process) continue;
    std::error_code error;
    fs::directory_iterator at(machine.at(fmt::format("/proc/{}/fd", *process)), error);
    if (error == std::errc::permission_denied) holders.all_seen = false;
    for (const fs::directory_iterator end; !error && at != end; at.increment(error)) {
      std::error_code unread;
      if (fs::read_symlink(at->path(), unread) == device) processes.push_back(*process);
    }
  }
  std::sort(processes.begin(), processes.end());
  processes.erase(std::unique(processes.begin(), processes.end()), processes.end());
  for (const int process : processes)
    holders.programs.push_back(process == 0 ? "another program" : program_words(machine, process));
  return holders;
}

std::vector<int> processes_named(const Machine& machine, const std::string& program) {
  std::vector<int> processes;
  for (const std::string& name : names_in(machine.at("/proc"))) {
    const auto process = number_of(name);
    if (process && first_line(machine.at(fmt::format("/proc/{}/comm", *process))) == program)
      processes.push_back(*process);
  }
  return processes;
}

std::optional<Refusal> refusal(const Machine& machine, const std::string& device) {
  const fs::path path = machine.at(device);
  if (machine.may_use(path)) return std::nullopt;
  struct stat node {};
  if (::stat(path.c_str(), &node) != 0) return Refusal{"there is no such device", "plug it in"};
  const auto group = group_of(machine, node.st_gid);
  const std::string name = group ? group->name : std::to_string(node.st_gid);
  const bool group_may = (node.st_mode & (S_IRGRP | S_IWGRP)) == (S_IRGRP | S_IWGRP) && name != "root";
  Refusal refused;
  refused.found = fmt::format("this user may not open it (group {}, mode {:04o})", name, node.st_mode & 07777U);
  const std::string user = user_name(machine);
  if (!group_may) {
    refused.remedy = group_rule(device);
  } else if (group && group->members.find("," + user + ",") != std::string::npos) {
    refused.remedy = fmt::format("{} has been put into the group {} since this login: log in again", user, name);
  } else {
    refused.remedy = fmt::format("run \"sudo usermod -aG {} {}\" and log in again", name, user);
  }
  return refused;
}

}  // namespace birdseye::host
