#include "host/doctor/computer.hpp"

#include <fmt/format.h>
#include <tbb/info.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>

#include "device/wire/clock_discipline.hpp"
#include "host/confine/confinement.hpp"
#include "host/confine/isolated.hpp"
#include "host/render/cpu/kernels.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr const char* kComputer = "this computer";
// What the window at the cart was measured on, and what it then took.
constexpr int kLeastCores = 2;
constexpr double kWindowGib = 1.5;
constexpr double kLeastDiskGib = 2;
constexpr double kGib = 1024.0 * 1024 * 1024;

std::vector<Check> check_processor() {
  const int cores = tbb::info::default_concurrency();
  const std::string isa = cpu::name_of(cpu::supported_isas().back());
  Check check{kComputer, "processor", CheckState::good,
              fmt::format("{} core{}, instructions {}", cores, cores == 1 ? "" : "s", isa), ""};
  if (cores < kLeastCores || isa == "portable") {
    check.state = CheckState::could_be_better;
    check.remedy = "two cores with AVX2 draw the overlay in time; with less, frames are skipped";
  }
  return {check};
}

/// kB of a line "MemAvailable:  123 kB".
std::optional<double> memory_gib(const Machine& machine, const std::string& key) {
  std::ifstream file(machine.at("/proc/meminfo"));
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name;
    double kib = 0;
    if (words >> name >> kib && name == key + ":") return kib * 1024 / kGib;
  }
  return std::nullopt;
}

std::vector<Check> check_memory(const Machine& machine) {
  const auto all_gib = memory_gib(machine, "MemTotal"), free_gib = memory_gib(machine, "MemAvailable");
  Check check{kComputer, "memory", CheckState::not_known, "the kernel does not say", ""};
  if (!all_gib || !free_gib) return {check};
  check.found = fmt::format("{:.1f} GiB, {:.1f} of them free", *all_gib, *free_gib);
  check.state = *free_gib < kWindowGib ? CheckState::could_be_better : CheckState::good;
  if (*free_gib < kWindowGib)
    check.remedy = fmt::format("close other programs: the window with a CT of usual size takes {:g} GiB", kWindowGib);
  return {check};
}

std::vector<Check> check_disk(const fs::path& results) {
  std::error_code error;
  fs::path folder = fs::absolute(results, error).lexically_normal();
  while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  Check check{kComputer, fmt::format("disk at {}", folder.string()), CheckState::not_known, "", ""};
  const fs::space_info space = fs::space(folder, error);
  if (error) {
    check.found = error.message();
    return {check};
  }
  const double free_gib = static_cast<double>(space.available) / kGib;
  check.found = fmt::format("{:.1f} GiB free", free_gib);
  check.state = free_gib < kLeastDiskGib ? CheckState::could_be_better : CheckState::good;
  if (free_gib < kLeastDiskGib) check.remedy = "make room, or have results go elsewhere: recordings take gigabytes";
  if (::access(folder.c_str(), W_OK) != 0) {
    check.state = CheckState::bad;
    check.found += ", and this user may not write there";
    check.remedy = "go to a folder of your own, or give another --out";
  }
  return {check};
}

std::vector<Check> check_clock() {
  const auto discipline = wire::read_clock_discipline();
  if (!discipline) return {{kComputer, "clock", CheckState::not_known, discipline.error().what, ""}};
  if (discipline->synchronised)
    return {{kComputer, "clock", CheckState::good, fmt::format("kept by {}", discipline->source), ""}};
  return {{kComputer, "clock", CheckState::could_be_better, "kept by no network protocol",
           "install chrony or systemd-timesyncd, so that files of several machines have times that agree; an overlay "
           "does not need it"}};
}

std::vector<Check> check_decoder() {
  Check check{kComputer, "decoder of CTs", CheckState::bad, "", ""};
  struct {
    int word = 0;
    bool is_confined = false, files = false;
    std::array<char, 512> fault{};
  } came;
  static constexpr int kSent = 20'261'125;
  const auto ran = run_isolated(
      [](const Send& send) {
        const auto confined = confine_to("/dev/null");
        decltype(came) sent{kSent, confined.has_value(), confined && confined->files, {}};
        if (!confined) confined.error().what.copy(sent.fault.data(), sent.fault.size() - 1);
        send(&sent, sizeof sent);
      },
      [&](const Receive& receive) { (void)receive(&came, sizeof came); }, Duration::from_ms(4000));
  if (!ran || came.word != kSent) {
    check.found = fmt::format("its process {}", ran ? "says something else than it was told" : ran.error().what);
    check.remedy = "close other programs: a process more must fit into memory and into this user's limit (ulimit -u)";
    return {check};
  }
  if (!came.is_confined) {
    const std::string fault = came.fault.data();
    const auto remedy = fault.find("; ");
    check.found = fmt::format("no CT, surface or picture is read: {}", fault.substr(0, remedy));
    check.remedy = remedy == std::string::npos ? "start birdseye on another machine" : fault.substr(remedy + 2);
    return {check};
  }
  check.state = came.files ? CheckState::good : CheckState::could_be_better;
  check.found = fmt::format(
      "its process starts and ends; a damaged file can start nothing and write nothing there, and of this user's files "
      "read {}",
      came.files ? "itself alone, and those that it may name: a header's beside it, a folder's in it"
                 : "all, for this kernel has no Landlock");
  if (!came.files) check.remedy = "run a kernel with Landlock, as Debian's, or read files you trust only";
  return {check};
}

}  // namespace

std::vector<Question> computer_questions(const Machine& machine, const fs::path& results) {
  return {{.area = kComputer, .name = "processor", .ask = check_processor},
          {.area = kComputer, .name = "memory", .ask = [machine] { return check_memory(machine); }},
          {.area = kComputer, .name = "disk", .ask = [results] { return check_disk(results); }},
          {.area = kComputer, .name = "clock", .ask = check_clock},
          {.area = kComputer, .name = "decoder of CTs", .ask = check_decoder}};
}

}  // namespace birdseye::host
