#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "drivers/gpio/gpio_lines.hpp"
#include "drivers/minibird/stream_layout.hpp"
#include "drivers/video/frame_source.hpp"

/// What the instruments' threads hand over, as it came. Everything the appliance says follows from the order of these
/// and from nothing else: that is what makes a recording of them worth having.
namespace birdseye::device {

enum class Instrument : std::uint8_t { tracker, camera, gpio };
inline constexpr std::size_t kInstruments = 3;
const char* name_of(Instrument instrument);

enum class InstrumentState : std::uint8_t {
  unused,    ///< the configuration does not name it
  absent,    ///< cannot be opened; looked for again
  starting,  ///< found, being reset and configured
  running,
  silent,  ///< there, and says nothing
};
const char* name_of(InstrumentState state);

struct InstrumentChanged {
  Instrument instrument = Instrument::tracker;
  InstrumentState state = InstrumentState::absent;
  std::string text = {};  ///< what it is, or what is wrong, in words
  DeviceTime at = {};
  /// For a tracker that runs: how its bytes are to be read.
  std::optional<drivers::minibird::StreamLayout> layout = std::nullopt;
  /// For a camera that runs: its rate; 0: it does not say.
  double rate_hz = 0;
  std::optional<Duration> exposure = std::nullopt;
  /// For an instrument that runs: what distinguishes it from others of its kind.
  std::map<std::string, std::string> identity = {};
};

struct TrackerBytes {
  drivers::minibird::Chunk chunk;
};

struct FrameCame {
  drivers::Frame frame;
};

struct EdgesCame {
  std::vector<drivers::GpioEdge> edges;
  DeviceTime at;
};

/// Time has passed without anything else.
struct Tick {
  DeviceTime at;
};

using RawEvent = std::variant<InstrumentChanged, TrackerBytes, FrameCame, EdgesCame, Tick>;

/// When the event was handed over, on the appliance's clock.
DeviceTime time_of(const RawEvent& event);
/// The instrument that it came from, by its name; null: none.
const char* origin_of(const RawEvent& event);

}  // namespace birdseye::device
