#include "host/operation/replay_player.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <memory>
#include <regex>
#include <utility>
#include <vector>

#include "host/files/picture.hpp"
#include "host/files/write_files.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

OverlayGate::Decision refused_for(const std::string& reason) {
  OverlayGate::Decision out;
  out.reason = reason;
  return out;
}

/// The reason with ".." in place of each number. What holds a letter beside its digits, as a name, is none.
std::string without_figures(const std::string& reason) {
  static const std::regex kFigure(R"((^|[\s(])-?\d+(\.\d+)?(?=$|[\s,;:)]))");
  return std::regex_replace(reason, kFigure, "$1..");
}

}  // namespace

std::map<std::string, std::size_t> alike_reasons(const std::map<std::string, std::size_t>& reasons) {
  std::map<std::string, std::map<std::string, std::size_t>> alike;
  for (const auto& [reason, frames] : reasons) alike[without_figures(reason)][reason] = frames;
  std::map<std::string, std::size_t> out;
  for (const auto& [shared, each] : alike) {
    std::size_t all = 0;
    for (const auto& [reason, frames] : each) all += frames;
    out[each.size() == 1 ? each.begin()->first : shared] += all;
  }
  return out;
}

/// Of the table: a frame, why it carries the overlay that it does, and from where it was drawn.
std::string ReplayPlayer::row_of(const wire::VideoFrame& frame, const OverlayGate::Decision& decision,
                                 const std::optional<FramePainter::Painted>& painted) const {
  std::string reason = decision.reason;
  std::replace(reason.begin(), reason.end(), ',', ';');
  std::string row = fmt::format("{},{},{},{},{},", frame.info.sequence, frame.info.acquired.ns,
                                to_string(frame.info.pose.kind), decision.strength, reason);
  const auto& expected = decision.expected;
  row += expected && output_.error_known ? fmt::format("{:.3f},{:.3f},", expected->rms_mm(), expected->radius95_mm())
                                         : ",,";
  const auto live = output_.live.find(frame.info.sequence);
  row += live == output_.live.end()
             ? ",,,"
             : fmt::format("{:.3f},{},{},", live->second.strength, live->second.reason, live->second.said);
  if (painted) {
    const Eigen::Matrix4d m = painted->camera_from_patient.matrix();
    for (int i = 0; i < 16; ++i) row += fmt::format("{}{}", i > 0 ? " " : "", m(i / 4, i % 4));
  }
  return row + "\n";
}

ReplayPlayer::ReplayPlayer(ReplayOutput output, const ReplaySetup& setup, const TrustFigures& figures, Engine& engine,
                           std::optional<Margins> margins)
    : output_(std::move(output)), engine_(engine), scope_(setup.scope) {
  painter_.set_setup(setup.setup(), figures);
  if (margins) painter_.set_margins(std::make_shared<const Margins>(*std::move(margins)));
}

void ReplayPlayer::take(const wire::Birds& birds) {
  for (const wire::Bird& bird : birds.birds) {
    if (bird.name != output_.scope) continue;
    painter_.take(birds.acquired, bird.tracker_from_sensor);
    video_.take(birds.acquired, bird.tracker_from_sensor);
  }
}

/// The video is asked as in the window, with one difference: before the video has shown anything, the overlay is drawn.
/// Nobody operates by a replay, and the replay's verdict says where the video never showed anything.
void ReplayPlayer::watch(const wire::VideoFrame& frame) {
  if (!video_.take(frame, scope_, painter_.target_in_camera_mm(frame)).any()) return;
  done_.video_told = done_.video_told || video_.motion() != VideoAgreement::untold;
  TrustFigures figures = painter_.figures();
  video_.enter(figures);
  if (!output_.motion_check || !done_.video_told) figures.video.reset();
  painter_.set_setup(painter_.setup(), figures);
}

OverlayGate::Decision ReplayPlayer::decide(const wire::VideoFrame& frame, const std::string& other_hardware) {
  if (!other_hardware.empty()) {
    held_back_ = true;
    ++done_.other_hardware;
    return refused_for(other_hardware);
  }
  // As in the window: what was believed before has nothing to fade from.
  if (std::exchange(held_back_, false)) painter_.set_setup(painter_.setup(), painter_.figures());
  return painter_.decide(frame);
}

Result<void> ReplayPlayer::take(const wire::VideoFrame& frame, const std::string& other_hardware) {
  ++done_.frames;
  if (!painter_.fits(frame)) {
    ++done_.other_size;
    const CameraModel& camera = painter_.setup()->camera();
    const OverlayGate::Decision none =
        refused_for(words("why_other_size", frame.width_px, frame.height_px, camera.width_px, camera.height_px));
    ++done_.reasons[none.reason];
    done_.table += row_of(frame, none, std::nullopt);
    return {};
  }
  watch(frame);
  const OverlayGate::Decision decision = decide(frame, other_hardware);
  const auto painted = painter_.paint(frame, decision, engine_, output_.look);
  const std::vector<std::uint8_t>& rgb = painted ? painted->rgb : *frame.rgb;
  if (painted) ++done_.overlaid;
  if (decision.strength >= 1) ++done_.whole;
  if (!decision.reason.empty()) ++done_.reasons[decision.reason];
  done_.checksum = static_cast<std::uint32_t>(::crc32(done_.checksum, rgb.data(), static_cast<uInt>(rgb.size())));
  done_.table += row_of(frame, decision, painted);
  if ((done_.frames - 1) % static_cast<std::size_t>(output_.every) == 0) {
    const std::filesystem::path file = output_.folder / fmt::format("overlay-{:06}.png", frame.info.sequence);
    if (auto put = write_file(file, png_of(RgbView{rgb, frame.width_px, frame.height_px})); !put) return put;
    ++done_.pictures;
  }
  if (output_.film_hz <= 0) return {};
  if (!film_) {
    auto film = Film::open(output_.folder / "overlay.mp4", frame.width_px, frame.height_px, output_.film_hz);
    if (!film) return film.error();
    film_ = *std::move(film);
  }
  return film_->add(rgb);
}

Result<void> ReplayPlayer::finish() {
  return film_ ? film_->finish() : Result<void>();
}

}  // namespace birdseye::host
