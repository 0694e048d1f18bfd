#include "host/overlay/live_picture.hpp"

#include <fmt/format.h>

#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

/// The picture without colour, so that nobody takes it for live. Darker too where nobody has asked for it: who has
/// frozen it wants to see what is in it.
std::vector<std::uint8_t> greyed(const std::vector<std::uint8_t>& rgb, bool asked_for) {
  const int shift = asked_for ? 8 : 9;
  std::vector<std::uint8_t> out(rgb.size());
  for (std::size_t i = 0; i + 2 < rgb.size(); i += 3) {
    const int grey = (77 * rgb[i] + 150 * rgb[i + 1] + 29 * rgb[i + 2]) >> shift;  // ITU-R BT.601 luma
    out[i] = out[i + 1] = out[i + 2] = static_cast<std::uint8_t>(grey);
  }
  return out;
}

}  // namespace

void LivePicture::set_setup(std::optional<Setup> setup, const TrustFigures& figures, const std::string& why_none) {
  painter_.set_setup(std::move(setup), figures);
  why_no_setup_ = why_none;
  // What the setup before allowed is not allowed by this one.
  decision_ = frame_ ? painter_.decide(*frame_) : OverlayGate::Decision();
  overlaid_.clear();
  kind_ = -1;
}

void LivePicture::take(const wire::VideoFrame& frame, const Exposure& exposed) {
  frame_ = frame;
  exposed_ = exposed;
  decision_ = painter_.decide(frame);
  if (dirty_) ++skipped_;
  dirty_ = true;
}

void LivePicture::draw() {
  if (!dirty_) return;
  dirty_ = false;
  overlaid_.clear();
  stopped_.clear();
  kind_ = -1;
  if (engine_ == nullptr || hidden_) return;
  auto painted = painter_.paint(*frame_, decision_, *engine_, look_);
  if (painted) overlaid_ = std::move(painted->rgb);
}

std::optional<Transform<Camera, Patient>> LivePicture::camera_from_patient() const {
  return frame_ && engine_ && !hidden_ ? painter_.camera_from_patient(*frame_, decision_) : std::nullopt;
}

std::optional<TargetMark> LivePicture::target() const {
  return frame_ && engine_ && !hidden_ ? painter_.target(*frame_, decision_) : std::nullopt;
}

std::optional<Transform<Camera, Patient>> LivePicture::seen_from() const {
  return frame_ && engine_ ? painter_.seen_from(*frame_, decision_) : std::nullopt;
}

std::string LivePicture::why_bare(const Freshness& fresh) const {
  if (fresh.stopped) return fresh.why_too_old;  // whatever else there is: what is seen is not what is
  if (!setup()) return why_no_setup_;
  if (engine_ == nullptr) return words("why_no_ct");
  if (hidden_) return words("why_hidden");
  if (!painter_.fits(*frame_)) {
    return words("why_other_size", frame_->width_px, frame_->height_px, setup()->camera().width_px,
                 setup()->camera().height_px);
  }
  return fresh.why_too_old;
}

ShownPicture LivePicture::at(HostTime now) {
  ShownPicture out;
  if (!frame_) {
    out.reason = words("why_no_video");
    return out;
  }
  out.any = true;
  out.width_px = frame_->width_px;
  out.height_px = frame_->height_px;
  const Freshness fresh = freshness_at(now, exposed_, frame_->info.pose.age, settings_.freshness);
  out.age_ms = fresh.age.seconds() * 1e3;
  out.stale = fresh.stopped;
  out.reason = why_bare(fresh);
  if (out.reason.empty()) {
    out.reason = decision_.reason;
    out.overlaid = !overlaid_.empty();
    out.strength = out.overlaid ? decision_.strength : 0;
    // What it is drawn by has changed since.
    if (!out.overlaid && out.reason.empty()) out.reason = words("why_next_picture");
  }
  if (out.stale && stopped_.empty()) stopped_ = greyed(*frame_->rgb, frozen_);
  const int kind = out.overlaid ? 2 : out.stale ? 1 : 0;
  if (kind != kind_) ++changes_;
  kind_ = kind;
  out.changes = changes_;
  if (!out.stale) out.believe_until = out.overlaid ? fresh.overlaid_until : fresh.bare_until;
  out.rgb = out.overlaid ? &overlaid_ : out.stale ? &stopped_ : frame_->rgb.get();
  return out;
}

}  // namespace birdseye::host
