#include "drivers/video/camera_offers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace birdseye::drivers {

namespace {

// In the order of what they cost to make RGB of; grey last, for it has no colours.
constexpr std::array kLiked = {PixelFormat::rgb8, PixelFormat::bgr8,  PixelFormat::yuyv, PixelFormat::uyvy,
                               PixelFormat::nv12, PixelFormat::mjpeg, PixelFormat::grey8};
constexpr double kRateTolerance = 0.005;
constexpr std::size_t kMostListed = 8;

bool in_steps(int value, int least, int most, int step) {
  return value >= least && value <= most && (value - least) % std::max(step, 1) == 0;
}
bool has_size(const SizeOffer& size, const CameraSettings& asked) {
  return in_steps(asked.width_px, size.least_width_px, size.most_width_px, size.step_width_px) &&
         in_steps(asked.height_px, size.least_height_px, size.most_height_px, size.step_height_px);
}

/// The offered rate that is what was asked for.
std::optional<double> met_rate(const RateOffer& offer, double asked_hz) {
  if (offer.rates_hz.empty() && offer.highest_hz <= 0) return asked_hz;
  if (asked_hz >= offer.lowest_hz * (1 - kRateTolerance) && asked_hz <= offer.highest_hz * (1 + kRateTolerance)) {
    return std::clamp(asked_hz, offer.lowest_hz, offer.highest_hz);
  }
  std::optional<double> best;
  for (const double rate_hz : offer.rates_hz) {
    if (std::abs(rate_hz - asked_hz) > kRateTolerance * asked_hz) continue;
    if (!best || std::abs(rate_hz - asked_hz) < std::abs(*best - asked_hz)) best = rate_hz;
  }
  return best;
}

/// Each once, in order, no more than a line holds.
class Listing {
 public:
  void add(const std::string& entry) {
    if (std::find(seen_.begin(), seen_.end(), entry) == seen_.end()) seen_.push_back(entry);
  }
  [[nodiscard]] std::string text() const {
    const std::size_t listed = std::min(seen_.size(), kMostListed);
    std::string text = fmt::format("{}", fmt::join(seen_.begin(), seen_.begin() + static_cast<long>(listed), ", "));
    if (seen_.size() > listed) text += fmt::format(" and {} more", seen_.size() - listed);
    return text;
  }
  [[nodiscard]] bool empty() const { return seen_.empty(); }

 private:
  std::vector<std::string> seen_;
};

std::string text_of(const SizeOffer& s) {
  if (s.least_width_px == s.most_width_px && s.least_height_px == s.most_height_px) {
    return fmt::format("{}x{}", s.least_width_px, s.least_height_px);
  }
  const bool stepped = s.step_width_px > 1 || s.step_height_px > 1;
  return fmt::format("{}x{} to {}x{}{}", s.least_width_px, s.least_height_px, s.most_width_px, s.most_height_px,
                     stepped ? fmt::format(" in steps of {}x{}", s.step_width_px, s.step_height_px) : "");
}

void list_rates(const RateOffer& offer, Listing& listing) {
  if (offer.highest_hz > 0) listing.add(fmt::format("{:.4g} to {:.4g}", offer.lowest_hz, offer.highest_hz));
  std::vector<double> rates_hz = offer.rates_hz;
  std::sort(rates_hz.begin(), rates_hz.end());
  for (const double rate_hz : rates_hz) listing.add(fmt::format("{:.4g}", rate_hz));
}

std::optional<CameraPlan> plan_of(const FormatOffer& offer, PixelFormat format, const CameraSettings& asked) {
  CameraPlan plan{format, offer.fourcc, asked.width_px, asked.height_px, asked.rate_hz};
  if (offer.sizes.empty()) return plan;
  for (const SizeOffer& size : offer.sizes) {
    if (!has_size(size, asked)) continue;
    if (const auto rate_hz = met_rate(size.rates, asked.rate_hz)) {
      plan.rate_hz = *rate_hz;
      return plan;
    }
  }
  return std::nullopt;
}

/// Of what could be used, why none will do.
Error refusal(const std::vector<FormatOffer>& usable, const CameraSettings& asked) {
  Listing rates;
  Listing sizes;
  for (const FormatOffer& offer : usable) {
    for (const SizeOffer& size : offer.sizes) {
      sizes.add(text_of(size));
      if (has_size(size, asked)) list_rates(size.rates, rates);
    }
  }
  const std::string as = asked.format.empty() ? "" : fmt::format(" as {}", asked.format);
  if (!rates.empty()) {
    return {Errc::unsupported, fmt::format("gives {}x{}{} at {} Hz, not {:.4g}; set [camera] rate_hz", asked.width_px,
                                           asked.height_px, as, rates.text(), asked.rate_hz)};
  }
  return {Errc::unsupported, fmt::format("gives {}{}, not {}x{}; set [camera] width and height", sizes.text(), as,
                                         asked.width_px, asked.height_px)};
}

}  // namespace

Result<CameraPlan> choose(const std::vector<FormatOffer>& offers, const CameraSettings& asked) {
  const auto only = pixel_format_of_name(asked.format);
  std::vector<FormatOffer> usable;
  Listing formats;
  for (const PixelFormat format : kLiked) {
    for (const FormatOffer& offer : offers) {
      if (pixel_format_of_fourcc(offer.fourcc) != format) continue;
      if (!asked.format.empty() && format != only) continue;
      if (const auto plan = plan_of(offer, format, asked)) return *plan;
      usable.push_back(offer);
    }
  }
  if (!usable.empty()) return refusal(usable, asked);
  for (const FormatOffer& offer : offers) formats.add(fourcc_name(offer.fourcc));
  return Error{Errc::unsupported,
               fmt::format("gives {}, not {}", formats.empty() ? "no format at all" : "the format(s) " + formats.text(),
                           asked.format.empty() ? "RGB3, BGR3, YUYV, UYVY, NV12, MJPG or GREY"
                                                : asked.format + "; set [camera] format")};
}

}  // namespace birdseye::drivers
