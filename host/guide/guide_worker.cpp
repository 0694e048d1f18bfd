#include "host/guide/guide_worker.hpp"

#include <utility>

#include "host/link/drops.hpp"

namespace birdseye::host {

namespace {

constexpr std::size_t kMostLines = 40;

Result<GuidedCalibration> solve(GuidedStations stations, const GuidePlan& plan) {
  GuidedCalibration out;
  out.stations = std::move(stations);
  if (!out.stations.input.camera) {
    out.verdict.add(Grade::fail, "no lens was found: " + out.stations.lens_fault,
                    "hold the scope still at more stations, tilted another way at each");
    return out;
  }
  auto solved = calibration::calibrate_hand_eye(out.stations.input);
  if (!solved) return solved.error();
  out.hand_eye = *std::move(solved);
  out.verdict = calibration::judge(out.hand_eye);
  if (!plan.camera && out.stations.lens) {
    const Verdict lens = calibration::judge_camera(*out.stations.lens);
    for (const std::string& reason : lens.reasons) out.verdict.add(lens.grade, "lens: " + reason);
  }
  return out;
}

}  // namespace

GuideWorker::GuideWorker(GuidePlan plan)
    : thread_([this, plan = std::move(plan)](const std::stop_token& stop) { work(stop, plan); }) {}

void GuideWorker::push(const wire::Event& event) {
  if (std::holds_alternative<wire::VideoFrame>(event)) events_.push(kFrames, event);
  if (std::holds_alternative<wire::Birds>(event)) events_.push(kPoses, event);
}

void GuideWorker::end(const std::string& why) {
  {
    const std::lock_guard lock(mutex_);
    if (end_.empty()) end_ = why;
  }
  events_.close();
}

GuideState GuideWorker::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::vector<std::string> GuideWorker::lines() const {
  const std::lock_guard lock(mutex_);
  return {lines_.begin(), lines_.end()};
}

std::optional<Result<GuidedCalibration>> GuideWorker::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(result_, std::nullopt);
}

void GuideWorker::tell(const std::string& line) {
  const std::lock_guard lock(mutex_);
  lines_.push_back(line);
  if (lines_.size() > kMostLines) lines_.pop_front();
}

std::optional<wire::Event> GuideWorker::next(const std::stop_token& stop) {
  auto event = events_.pop(stop);
  const std::lock_guard lock(mutex_);
  return end_.empty() ? std::move(event) : std::nullopt;
}

void GuideWorker::work(const std::stop_token& stop, const GuidePlan& plan) {
  HandEyeGuide guide(plan, {[](const std::string&) {}, [this](const std::string& line) { tell(line); }});
  std::optional<Error> fault;
  while (!guide.ended() && !fault) {
    const auto event = next(stop);
    if (stop.stop_requested()) return;
    if (event) {
      if (auto taken = guide.take(*event); !taken) fault = taken.error();
    } else {
      const std::lock_guard lock(mutex_);
      guide.end(end_);
    }
    const std::lock_guard lock(mutex_);
    state_ = guide.state();
  }
  const Drops drops{events_.dropped(kFrames), events_.dropped(kPoses)};
  if (const std::string words = drops.words(); !words.empty()) tell(words);
  if (!fault) {
    const std::lock_guard lock(mutex_);
    state_.collecting = false;
    state_.next = "that is enough, and is being worked out; fiducials may be touched meanwhile";
  }
  auto result = fault ? Result<GuidedCalibration>(*fault) : solve(guide.finish(), plan);
  const std::lock_guard lock(mutex_);
  result_ = std::move(result);
}

}  // namespace birdseye::host
