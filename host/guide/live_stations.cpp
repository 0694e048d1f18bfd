#include "host/guide/live_stations.hpp"

#include <fmt/format.h>

#include <utility>

#include "calibration/detect/detect.hpp"
#include "host/files/picture.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

calibration::Detection find(const calibration::Pattern& pattern, const wire::VideoFrame& frame,
                            const std::string& name) {
  const std::vector<std::uint8_t> grey = grey_of({*frame.rgb, frame.width_px, frame.height_px});
  return calibration::detect(pattern, {grey, frame.width_px, frame.height_px}, name, calibration::Search::quick);
}

}  // namespace

void LiveStations::push(const wire::Birds& birds) {
  rests_.push(birds);
  look_at_rests();
}

void LiveStations::finish() {
  rests_.finish();
  look_at_rests();
}

void LiveStations::look_at_rests() {
  while (auto rest = rests_.take()) {
    calibration::Detection found = find(pattern_, rest->frame, fmt::format("station {}", taken_ + 1));
    if (!found.view) {
      remark_ = words("guide_not_taken", found.rejected);
      continue;
    }
    ++taken_;
    stations_.push_back({*std::move(found.view), rest->tracker_from_sensor, std::move(rest->frame)});
  }
  if (std::string remark = rests_.take_remark(); !remark.empty()) remark_ = std::move(remark);
}

std::optional<LiveStation> LiveStations::take_station() {
  if (stations_.empty()) return std::nullopt;
  LiveStation station = std::move(stations_.front());
  stations_.pop_front();
  return station;
}

std::string LiveStations::take_remark() {
  return std::exchange(remark_, {});
}

std::optional<calibration::PatternView> LiveStations::look() const {
  const auto& newest = rests_.newest_frame();
  if (!newest) return std::nullopt;
  return find(pattern_, *newest, "now").view;
}

}  // namespace birdseye::host
