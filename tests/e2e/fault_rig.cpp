#include "tests/e2e/fault_rig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "drivers/system/clock.hpp"
#include "tests/support/programs_folder.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::testing {

namespace {

constexpr Duration kStartsWithin = Duration::from_ms(20'000);

std::vector<std::string> simulator(const std::string& words) {
  std::vector<std::string> all;
  std::istringstream in(BIRDSEYE_EMULATOR " " + testing::programs_folder() + "/birdseye-sim " + words);
  for (std::string word; in >> word;) all.push_back(word);
  return all;
}

void add_faults(const std::string& output, std::vector<FaultSpan>& spans) {
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);) {
    const auto said = nlohmann::json::parse(line, nullptr, false);
    if (!said.is_object() || said.value("event", "") != "fault") continue;
    const auto at_ns = said.at("monotonic_ns").get<std::int64_t>();
    const auto name = said.at("name").get<std::string>();
    if (said.at("phase") == "begin") {
      spans.push_back({name, at_ns, 0});
      continue;
    }
    for (FaultSpan& span : spans) {
      if (span.name == name && span.end_ns == 0) span.end_ns = at_ns;
    }
  }
}

}  // namespace

std::int64_t monotonic_ns() {
  return device_now().ns;
}

FaultRig::FaultRig(Settings settings) : settings_(std::move(settings)) {
  std::filesystem::create_directories(settings_.folder);
  if (settings_.tracker) start_tracker();
  if (settings_.camera) start_camera();
  const std::string device = settings_.tracker_device.empty() ? this->device() : settings_.tracker_device;
  const auto cross = settings_.size.find('x');
  write("cart.toml",
        fmt::format("[tracker]\ndevice = \"{}\"\n[camera]\nsource = \"socket:{}\"\nwidth = {}\nheight = {}\nrate_hz = "
                    "{}\n[wire]\nport = 0\n{}",
                    device, (settings_.folder / "camera").string(), settings_.size.substr(0, cross),
                    settings_.size.substr(cross + 1), kFrameRateHz, settings_.more));
  std::vector<std::string> words = settings_.within;
  std::istringstream in(BIRDSEYE_EMULATOR " " + testing::programs_folder() + "/birdseyed --config " + config_path());
  for (std::string word; in >> word;) words.push_back(word);
  birdseyed_ = std::make_unique<Child>(words);
  connect();
}

void FaultRig::connect() {
  const std::string before_port = "publishing on 127.0.0.1 port ";
  if (!birdseyed_->says({before_port}, Deadline::after(kStartsWithin))) return fail("birdseyed: " + log());
  const std::string& said = birdseyed_->output();
  port_ = std::atoi(said.c_str() + said.find(before_port) + before_port.size());
  auto client = wire::Client::connect("127.0.0.1", port_, Deadline::after(kStartsWithin));
  if (!client) return fail(client.error().what);
  client_ = *std::move(client);
}

void FaultRig::fail(const std::string& what) {
  if (failure_.empty()) failure_ = what;
}

void FaultRig::write(const std::string& name, const std::string& text) const {
  std::ofstream(settings_.folder / name) << text;
}

void FaultRig::start_tracker() {
  write("tracker.toml", settings_.tracker_faults);
  const std::string folder = settings_.folder.string();
  tracker_ = std::make_unique<Child>(simulator(
      fmt::format("minibird --tty {0}/tty --boot-ms 100 --position-noise-mm {1} --angle-noise-deg {2} --faults "
                  "{0}/tracker.toml --truth {0}/truth.json",
                  folder, kNoiseMm, kNoiseDeg)));
  if (!tracker_->says({"ready"}, Deadline::after(kStartsWithin)))
    fail("the tracker's simulator: " + tracker_->output());
}

void FaultRig::start_camera() {
  write("camera.toml", settings_.camera_faults);
  camera_ = std::make_unique<Child>(simulator(
      fmt::format("camera --socket {0}/camera --size {1} --rate {2} --format {3} --faults {0}/camera.toml --truth "
                  "{0}/camera.json",
                  settings_.folder.string(), settings_.size, kFrameRateHz, settings_.format)));
  if (!camera_->says({"ready"}, Deadline::after(kStartsWithin))) fail("the camera's simulator: " + camera_->output());
}

bool FaultRig::listen(double seconds, const std::function<bool()>& until) {
  const auto end = Deadline::after(Duration::from_seconds(seconds));
  while (failure_.empty() && !end.passed()) {
    auto event = client_->next(std::min(end, Deadline::after(Duration::from_ms(100))));
    if (!event) {
      fail(event.error().what + "; birdseyed: " + log());
      break;
    }
    if (*event) {
      if (auto* frame = std::get_if<wire::VideoFrame>(&**event)) frame->rgb.reset();
      seen_.push_back({monotonic_ns(), **std::move(event)});
    }
    if (until && until()) return true;
  }
  return failure_.empty() && !until;
}

std::vector<FaultSpan> FaultRig::faults() {
  std::vector<FaultSpan> spans;
  for (Child* child : {tracker_.get(), camera_.get()}) {
    if (child == nullptr) continue;
    child->catch_up();
    add_faults(child->output(), spans);
  }
  std::erase_if(spans, [](const FaultSpan& span) { return span.end_ns == 0; });
  std::sort(spans.begin(), spans.end(), [](const FaultSpan& a, const FaultSpan& b) { return a.begin_ns < b.begin_ns; });
  return spans;
}

std::string FaultRig::log() {
  birdseyed_->catch_up();
  return birdseyed_->output();
}

std::int64_t FaultRig::circle_zero_ns() const {
  return zero_of("truth.json");
}

std::int64_t FaultRig::first_frame_ns() const {
  return zero_of("camera.json");
}

std::int64_t FaultRig::zero_of(const std::string& name) const {
  const auto truth = nlohmann::json::parse(contents_of(settings_.folder / name), nullptr, false);
  return truth.is_object() ? truth.value("zero_monotonic_ns", std::int64_t{0}) : 0;
}

}  // namespace birdseye::testing
