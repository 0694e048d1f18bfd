#include "hw-sim/video/program.hpp"

#include <sys/prctl.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "drivers/system/clock.hpp"
#include "drivers/system/whole_file.hpp"
#include "hw-sim/faults/announce.hpp"
#include "hw-sim/video/frame_sink.hpp"
#include "hw-sim/video/post_view.hpp"
#include "hw-sim/video/strobe.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr std::int64_t kLongestWaitNs = 20'000'000;

Result<std::unique_ptr<FrameSink>> open_sink(const CameraProgram& program) {
  if (!program.socket.empty()) return listen_for_frames(program.socket, program.timing.seed);
  return open_video_output(program.device, program.format, program.width_px, program.height_px, program.timing.rate_hz,
                           program.timing.seed);
}

/// Half of a length, even, and enough for the frame's number.
int half(int length_px) {
  return std::max(64, length_px / 2 / 2 * 2);
}

/// When the bird began its circle, and how long it takes.
struct Round {
  std::int64_t zero_ns = 0;
  double period_s = 0;
};

Result<Round> read_round(const std::filesystem::path& truth) {
  const auto text = read_whole_file(truth, kMostTextBytes);
  if (!text && text.error().code != Errc::not_found) return text.error().with_context("--post");
  const auto said = text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
  const auto number = [&said](const char* key) {
    return said.is_object() && said.contains(key) && said[key].is_number() ? said[key].get<double>() : 0.0;
  };
  if (number("zero_monotonic_ns") > 0 && number("period_s") > 0) {
    return Round{said["zero_monotonic_ns"].get<std::int64_t>(), number("period_s")};
  }
  return Error{
      Errc::bad_value,
      fmt::format("--post: {} is no truth of a miniBIRD on its circle; start birdseye-sim minibird with --truth "
                  "{} before the camera",
                  truth.string(), truth.string())};
}

class Camera {
 public:
  Camera(const CameraProgram& program, std::unique_ptr<FrameSink> sink, std::int64_t zero_ns,
         std::optional<Round> round)
      : program_(program),
        sink_(std::move(sink)),
        script_(program.timing, zero_ns),
        zero_ns_(zero_ns),
        round_(round),
        whole_(program.format, program.width_px, program.height_px),
        half_(program.format, half(program.width_px), half(program.height_px)) {
    if (round_) post_.emplace(program.width_px, program.height_px);
  }

  void run(const std::atomic<bool>& stop) {
    const std::int64_t end_ns =
        program_.seconds > 0 ? zero_ns_ + static_cast<std::int64_t>(program_.seconds * 1e9) : INT64_MAX;
    while (!stop) {
      const FramePlan plan = script_.next();
      if (plan.due_ns > end_ns) return;
      wait(plan.due_ns, stop, false);
      // Jitter brings frames close together; the one before may need some of this one's time.
      if (sink_->busy()) wait(plan.due_ns + std::llround(1e9 / script_.rate_hz()), stop, true);
      if (plan.lost || stop) continue;
      if (sink_->busy()) {
        ++skipped_;  // the reader is slow: the camera has no memory for another frame
      } else if (sink_->connected()) {
        show(plan);
      }
    }
  }
  [[nodiscard]] std::uint64_t sent() const { return sent_; }
  [[nodiscard]] std::uint64_t skipped() const { return skipped_; }
  [[nodiscard]] double rate_hz() const { return script_.rate_hz(); }

 private:
  void show(const FramePlan& plan) {
    if (post_ && !plan.half_size) {
      const double turns = static_cast<double>(plan.exposed_ns - round_->zero_ns) * 1e-9 / round_->period_s;
      sink_->begin(
          plan, {post_->draw(2 * std::numbers::pi * turns), FrameFormat::rgb3, program_.width_px, program_.height_px});
      ++sent_;
      return;
    }
    TestPattern& pattern = plan.half_size ? half_ : whole_;
    const double exposed_s = static_cast<double>(plan.exposed_ns - zero_ns_) * 1e-9;
    const double readout_s = program_.rolling ? 1.0 / program_.timing.rate_hz : 0;
    const auto pixels = pattern.draw(plan.number, exposed_s, readout_s);
    sink_->begin(plan, {pixels, pattern.format(), pattern.width_px(), pattern.height_px()});
    ++sent_;
  }
  void wait(std::int64_t until_ns, const std::atomic<bool>& stop, bool only_while_busy) {
    // Once at least: a camera that is late still sends, and hears that its reader has gone.
    std::int64_t now_ns = 0;
    do {
      now_ns = device_now().ns;
      if (sink_->connected()) script_.watched(now_ns);
      script_.advance(now_ns);
      if (script_.plugged() != plugged_) {
        if (plugged_) sink_->unplug();
        plugged_ = script_.plugged() && sink_->replug().has_value();
      }
      for (const FaultEvent& event : script_.take_events()) announce(event);
      sink_->work(std::min(until_ns, now_ns + kLongestWaitNs));
    } while (device_now().ns < until_ns && !stop && (!only_while_busy || sink_->busy()));
  }

  const CameraProgram& program_;
  std::unique_ptr<FrameSink> sink_;
  CameraScript script_;
  std::int64_t zero_ns_;
  std::optional<Round> round_;
  std::optional<PostView> post_;  ///< in place of the test picture
  TestPattern whole_, half_;
  bool plugged_ = true;
  std::uint64_t sent_ = 0, skipped_ = 0;
};

}  // namespace

Result<void> run_camera(const CameraProgram& program, const std::atomic<bool>& stop) {
  std::optional<Round> round;
  if (!program.post.empty()) {
    auto read = read_round(program.post);
    if (!read) return read.error();
    round = *read;
  }
  auto sink = open_sink(program);
  if (!sink) return sink.error();
  std::optional<Strobe> strobe;
  if (!program.strobe.empty()) {
    auto opened = Strobe::open(program.strobe);
    if (!opened) return std::move(opened).error();
    strobe = *std::move(opened);
  }
  ::prctl(PR_SET_TIMERSLACK, 1000UL, 0UL, 0UL, 0UL);  // frames leave on time, not when it suits the power supply
  const std::int64_t zero_ns = device_now().ns;
  Camera camera(program, *std::move(sink), zero_ns, round);
  const nlohmann::json truth{{"zero_monotonic_ns", zero_ns},
                             {"rate_hz", camera.rate_hz()},
                             {"width_px", program.width_px},
                             {"height_px", program.height_px},
                             {"format", fourcc_of(program.format)},
                             {"rolling", program.rolling},
                             {"exposure_ms", program.timing.exposure_ms},
                             {"bar_period_s", TestPattern::kBarPeriodS}};
  if (!program.truth.empty()) {
    if (auto written = replace_json(program.truth, truth); !written) return written;
  }
  announce({{"event", "ready"}, {"camera", program.socket.empty() ? program.device : program.socket}});
  if (strobe) strobe->start(program.timing, camera.rate_hz(), zero_ns);
  camera.run(stop);
  announce({{"event", "end"}, {"frames_sent", camera.sent()}, {"frames_skipped", camera.skipped()}});
  return {};
}

}  // namespace birdseye::hw_sim
