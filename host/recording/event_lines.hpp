#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "device/wire/messages.hpp"

namespace birdseye::host {

/// Where the pixels of a frame are.
struct FramePlace {
  std::string file;  ///< of the recording, without its extensions
  std::size_t index = 0;
};

/// One event as a line of JSON, without the line's end: {"Birds": {...}}. What comes over the wire as JSON is written
/// as it is there; of a frame, its place stands for its pixels. Reads back the same to the bit.
std::string event_line(const wire::Event& event, const FramePlace& place = {});

struct EventOfLine {
  wire::Event event;  ///< a frame without pixels
  FramePlace place;
};
/// Reads such a line. Errc::bad_format says what is wrong, without the file's name.
Result<EventOfLine> parse_event_line(const std::string& line);

}  // namespace birdseye::host
