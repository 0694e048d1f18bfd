#include "host/operation/replay_player.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "host/files/picture.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

/// Of the table: a frame, why it carries the overlay that it does, and from where it was drawn.
std::string row_of(const wire::VideoFrame& frame, const OverlayGate::Decision& decision,
                   const std::optional<FramePainter::Painted>& painted) {
  std::string reason = decision.reason;
  std::replace(reason.begin(), reason.end(), ',', ';');
  std::string row = fmt::format("{},{},{},{},{},", frame.info.sequence, frame.info.acquired.ns,
                                to_string(frame.info.pose.kind), decision.strength, reason);
  if (painted) {
    const Eigen::Matrix4d m = painted->camera_from_patient.matrix();
    for (int i = 0; i < 16; ++i) row += fmt::format("{}{}", i > 0 ? " " : "", m(i / 4, i % 4));
  }
  return row + "\n";
}

}  // namespace

ReplayPlayer::ReplayPlayer(ReplayOutput output, const Setup& setup, const TrustFigures& figures, Engine& engine,
                           std::optional<Margins> margins)
    : output_(std::move(output)), engine_(engine) {
  painter_.set_setup(setup, figures);
  if (margins) painter_.set_margins(std::make_shared<const Margins>(*std::move(margins)));
}

void ReplayPlayer::take(const wire::Birds& birds, const std::string& scope) {
  for (const wire::Bird& bird : birds.birds) {
    if (bird.name == scope) painter_.take(birds.acquired, bird.tracker_from_sensor);
  }
}

Result<void> ReplayPlayer::take(const wire::VideoFrame& frame) {
  ++done_.frames;
  if (!painter_.fits(frame)) {
    ++done_.other_size;
    return {};
  }
  const OverlayGate::Decision decision = painter_.decide(frame);
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
