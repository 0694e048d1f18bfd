#include "device/birdseyed/safe_mode.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <system_error>

#include "drivers/system/clock.hpp"
#include "drivers/system/crash_note.hpp"
#include "drivers/system/part_file.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye::device {

namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 4> kParts{"tracker", "camera", "gpio", "recording"};
constexpr std::ptrdiff_t kBadEnds = 3;
// Longer than it takes to find that a tracker's thread hangs, for which the watchdog gives it 35 s.
constexpr Duration kSoonOver = Duration::from_ms(120'000);

bool is_part(const std::string& name) {
  return std::find(kParts.begin(), kParts.end(), name) != kParts.end();
}

std::optional<RunMemory> read(const fs::path& path) {
  const auto text = read_whole_file(path, kMostTextBytes);
  if (!text) return std::nullopt;
  return parse_run_memory(*text);
}

}  // namespace

RunMemory after_bad_end(RunMemory run, const std::string& by, DeviceTime now) {
  RunMemory next{now.ns, std::move(run.ended_by), std::move(run.left_out)};
  if (now - DeviceTime{run.began_ns} > kSoonOver) next.ended_by.clear();
  if (!is_part(by)) return next;
  next.ended_by.push_back(by);
  if (std::count(next.ended_by.begin(), next.ended_by.end(), by) < kBadEnds) return next;
  next.ended_by.clear();
  if (std::find(next.left_out.begin(), next.left_out.end(), by) == next.left_out.end()) next.left_out.push_back(by);
  return next;
}

std::string text_of(const RunMemory& run) {
  std::string text = fmt::format("began {}\n", run.began_ns);
  for (const std::string& part : run.ended_by) text += fmt::format("ended {}\n", part);
  for (const std::string& part : run.left_out) text += fmt::format("without {}\n", part);
  return text += "whole -\n";
}

std::optional<RunMemory> parse_run_memory(const std::string& text) {
  RunMemory run;
  std::istringstream in(text);
  std::string key, value;
  if (!(in >> key >> run.began_ns) || key != "began") return std::nullopt;
  while (in >> key >> value) {
    if (key == "whole") return run;
    if (!is_part(value) || (key != "ended" && key != "without")) return std::nullopt;
    (key == "ended" ? run.ended_by : run.left_out).push_back(value);
  }
  return std::nullopt;
}

SafeMode SafeMode::begin(const fs::path& folder) {
  SafeMode safe;
  if (folder.empty()) return safe;
  const fs::path memory = folder / "run", note = folder / "crash";
  RunMemory run{device_now().ns, {}, {}};
  if (auto former = read(memory)) {
    const std::string by = CrashNote::read(note);
    run = after_bad_end(*std::move(former), by, device_now());
    spdlog::warn("the run before ended badly, by {}", is_part(by) ? "the " + by : "nobody knows what");
  }
  safe.left_out_ = run.left_out;
  if (auto kept = CrashNote::keep_in(note); !kept) {
    spdlog::warn("crashes are not remembered: {}", kept.error().what);
  } else if (auto written = write_durably(memory, text_of(run)); !written) {
    spdlog::warn("crashes are not remembered: {}", written.error().what);
  } else {
    safe.memory_ = memory;
  }
  return safe;
}

void SafeMode::note_hang(const std::string& part) {
  if (memory_.empty() || part == hangs_) return;
  hangs_ = part;
  CrashNote::write(part);
}

void SafeMode::end_in_order() {
  std::error_code error;
  if (!memory_.empty()) fs::remove(memory_, error);
}

std::string why_left_out(const std::string& part) {
  return fmt::format(
      "the {} is left out, for it ended birdseyed {} times soon after a start; restart birdseyed to try it", part,
      kBadEnds);
}

}  // namespace birdseye::device
