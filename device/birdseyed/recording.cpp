#include "device/birdseyed/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "calibration/record/strict_json.hpp"
#include "device/birdseyed/byte_codec.hpp"
#include "device/birdseyed/layout_json.hpp"
#include "device/wire/igtl_bytes.hpp"
#include "device/wire/json.hpp"

namespace birdseye::device {

namespace {

enum Kind : std::uint32_t { kSettings = 1, kChanged, kTrackerBytes, kFrame, kEdges, kTick, kSignature };
constexpr std::size_t kBlockHead = 12;  // kind, size
constexpr std::uint64_t kLargestPayload = 64U << 20U;

Bytes block(std::uint32_t kind, const Bytes& payload) {
  ByteWriter out;
  out.put(kind);
  out.put<std::uint64_t>(payload.size());
  Bytes bytes = out.take();
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  ByteWriter tail;
  tail.put(wire::checksum(bytes));
  const Bytes crc = tail.take();
  bytes.insert(bytes.end(), crc.begin(), crc.end());
  return bytes;
}

Bytes payload_of(const InstrumentChanged& changed) {
  ByteWriter out;
  out.put(changed.instrument);
  out.put(changed.state);
  out.put_text(changed.text);
  out.put(changed.at.ns);
  out.put_text(changed.layout ? wire::text_of(*changed.layout) : "");
  out.put(changed.rate_hz);
  out.put<std::uint8_t>(changed.exposure ? 1 : 0);
  out.put(changed.exposure.value_or(Duration{}).ns);
  out.put_text(wire::text_of(changed.identity));
  return out.take();
}

Bytes payload_of(const TrackerBytes& bytes) {
  ByteWriter out;
  out.put(bytes.chunk.arrived.ns);
  out.put(bytes.chunk.after_line_error);
  out.put(bytes.chunk.after_restart);
  out.put_bytes(bytes.chunk.bytes);
  return out.take();
}

Bytes payload_of(const FrameCame& came) {
  const drivers::Frame& frame = came.frame;
  ByteWriter out;
  out.put(frame.width_px);
  out.put(frame.height_px);
  out.put(frame.sequence);
  out.put(frame.acquired.ns);
  out.put(frame.acquired_sigma.ns);
  out.put(frame.acquired_known);
  out.put(frame.arrived.ns);
  out.put(frame.stamp_ahead.ns);
  out.put_bytes(*frame.rgb);
  return out.take();
}

Bytes payload_of(const EdgesCame& came) {
  ByteWriter out;
  out.put(came.at.ns);
  out.put<std::uint64_t>(came.edges.size());
  for (const drivers::GpioEdge& edge : came.edges) {
    out.put<std::uint8_t>(edge.input == drivers::GpioInput::pedal ? 1 : 0);
    out.put(edge.active);
    out.put(edge.at.ns);
  }
  return out.take();
}

Bytes payload_of(const Tick& tick) {
  ByteWriter out;
  out.put(tick.at.ns);
  return out.take();
}

InstrumentChanged changed_of(ByteReader& in) {
  InstrumentChanged changed;
  changed.instrument = static_cast<Instrument>(in.get<std::uint8_t>());
  changed.state = static_cast<InstrumentState>(in.get<std::uint8_t>());
  changed.text = in.get_text();
  changed.at.ns = in.get<std::int64_t>();
  const std::string layout = in.get_text();
  if (!layout.empty()) changed.layout = nlohmann::json::parse(layout).get<drivers::minibird::StreamLayout>();
  changed.rate_hz = in.get<double>();
  const bool exposed = in.get<std::uint8_t>() != 0;
  const Duration exposure{in.get<std::int64_t>()};
  if (exposed) changed.exposure = exposure;
  nlohmann::json::parse(in.get_text()).get_to(changed.identity);
  return changed;
}

TrackerBytes tracker_bytes_of(ByteReader& in) {
  TrackerBytes bytes;
  bytes.chunk.arrived.ns = in.get<std::int64_t>();
  bytes.chunk.after_line_error = in.get<std::uint8_t>() != 0;
  bytes.chunk.after_restart = in.get<std::uint8_t>() != 0;
  bytes.chunk.bytes = in.get_bytes();
  return bytes;
}

FrameCame frame_of(ByteReader& in) {
  drivers::Frame frame;
  frame.width_px = in.get<int>();
  frame.height_px = in.get<int>();
  frame.sequence = in.get<std::uint64_t>();
  frame.acquired.ns = in.get<std::int64_t>();
  frame.acquired_sigma.ns = in.get<std::int64_t>();
  frame.acquired_known = in.get<std::uint8_t>() != 0;
  frame.arrived.ns = in.get<std::int64_t>();
  frame.stamp_ahead.ns = in.get<std::int64_t>();
  frame.rgb = std::make_shared<const Bytes>(in.get_bytes());
  return {std::move(frame)};
}

EdgesCame edges_of(ByteReader& in) {
  EdgesCame came;
  came.at.ns = in.get<std::int64_t>();
  const auto count = in.get<std::uint64_t>();
  for (std::uint64_t i = 0; i < count && in.good(); ++i) {
    drivers::GpioEdge edge;
    edge.input = in.get<std::uint8_t>() != 0 ? drivers::GpioInput::pedal : drivers::GpioInput::strobe;
    edge.active = in.get<std::uint8_t>() != 0;
    edge.at.ns = in.get<std::int64_t>();
    came.edges.push_back(edge);
  }
  return came;
}

std::optional<RawEvent> event_of(std::uint32_t kind, const Bytes& payload) {
  ByteReader in(payload);
  std::optional<RawEvent> event;
  if (kind == kChanged) event = changed_of(in);
  if (kind == kTrackerBytes) event = tracker_bytes_of(in);
  if (kind == kFrame) event = frame_of(in);
  if (kind == kEdges) event = edges_of(in);
  if (kind == kTick) event = Tick{{in.get<std::int64_t>()}};
  return in.good() ? event : std::nullopt;
}

// A checksum says that a block is as it was written, not that a birdseyed wrote it. So what the core relies on, because
// configuration and drivers see to it, is looked at again.

constexpr std::size_t kMostBirds = 14;
constexpr Duration kLongest = Duration::from_ms(10'000);

bool is_rate(double hz) {
  return hz >= 1e-3 && hz <= 1e6;  // false of NaN
}

bool is_wait(Duration duration) {
  return duration.ns >= 0 && duration <= kLongest;
}

bool is_limit(double value) {
  return value >= 0 && std::isfinite(value);
}

/// What is wrong, in words; empty where nothing is.
std::string fault_of(const drivers::minibird::BirdLayout& bird) {
  using drivers::minibird::RecordFormat;
  switch (bird.format) {
    case RecordFormat::position:
    case RecordFormat::angles:
    case RecordFormat::matrix:
    case RecordFormat::position_angles:
    case RecordFormat::position_matrix:
    case RecordFormat::quaternion:
    case RecordFormat::position_quaternion:
      break;
    default:
      return "a bird's records of no known format";
  }
  if (!(bird.mm_per_count > 0) || !std::isfinite(bird.mm_per_count)) return "a bird's scale that is none";
  return bird.into_hemisphere.allFinite() ? "" : "a hemisphere that is none";
}

std::string fault_of(const drivers::minibird::StreamLayout& layout, std::size_t names) {
  if (layout.birds.empty() || layout.birds.size() > kMostBirds)
    return fmt::format("a tracker of {} birds; there are 1 to {}", layout.birds.size(), kMostBirds);
  if (layout.birds.size() != names)
    return fmt::format("a tracker of {} birds for {} names", layout.birds.size(), names);
  for (const auto& bird : layout.birds) {
    if (auto fault = fault_of(bird); !fault.empty()) return fault;
  }
  if (!is_rate(layout.rate_hz)) return fmt::format("a tracker's rate of {} Hz", layout.rate_hz);
  if (layout.baud <= 0) return fmt::format("a line of {} baud", layout.baud);
  if (!is_wait(layout.delay)) return "a tracker's delay that is none";
  const auto& limits = layout.plausibility;
  for (const double limit : {limits.most_speed_mm_s, limits.most_turn_deg_s, limits.most_acceleration_mm_s2,
                             limits.slack_mm, limits.slack_deg, limits.frozen_moved_mm, limits.hemisphere_border_mm}) {
    if (!is_limit(limit)) return "a limit of plausibility that is none";
  }
  const bool counts = limits.step_confirms >= 0 && limits.start_confirms >= 0 && limits.frozen_after >= 0;
  return counts && is_wait(limits.gap) && is_wait(limits.flip_memory) ? "" : "a limit of plausibility that is none";
}

std::string fault_of(const CoreSettings& settings) {
  const auto& names = settings.bird_names;
  if (names.empty() || names.size() > kMostBirds)
    return fmt::format("{} names of birds; there are 1 to {}", names.size(), kMostBirds);
  if (std::any_of(names.begin(), names.end(), [](const std::string& name) { return name.empty(); }))
    return "a bird without a name";
  std::set<std::string> as_sent;
  for (const std::string& name : names) {
    if (!as_sent.insert(name.substr(0, wire::kMostBirdNameBytes)).second)
      return fmt::format("two birds of one name, by the first {} bytes, which are all that hosts are told",
                         wire::kMostBirdNameBytes);
  }
  const PoseHistory::Settings& pose = settings.pose;
  if (pose.capacity == 0 || !is_limit(pose.acceleration_mm_s2)) return "limits of poses that are none";
  for (const Duration wait :
       {pose.max_gap, pose.max_prediction, pose.max_time_sigma, pose.smoothing, settings.pose_wait,
        settings.frame_clock.exposure, settings.frame_clock.delay.value_or(Duration{})}) {
    if (!is_wait(wait)) return fmt::format("a time of {:g} s", wait.seconds());
  }
  const double rate_hz = settings.frame_clock.rate_hz;
  return is_rate(rate_hz) ? "" : fmt::format("a camera's rate of {} Hz", rate_hz);
}

std::string fault_of(const InstrumentChanged& changed, std::size_t names) {
  if (static_cast<std::size_t>(changed.instrument) >= kInstruments || changed.state > InstrumentState::silent)
    return "an instrument or a state that is unknown";
  if (changed.rate_hz != 0 && !is_rate(changed.rate_hz))
    return fmt::format("a camera's rate of {} Hz", changed.rate_hz);
  if (changed.exposure && !is_wait(*changed.exposure))
    return fmt::format("an exposure of {:g} s", changed.exposure->seconds());
  return changed.layout ? fault_of(*changed.layout, names) : "";
}

std::string fault_of(const drivers::Frame& frame) {
  const bool sized = frame.width_px > 0 && frame.height_px > 0 &&
                     std::int64_t{frame.width_px} * frame.height_px <= drivers::kMostPixels;
  const auto pixels = std::uint64_t{3} * static_cast<unsigned>(frame.width_px) * static_cast<unsigned>(frame.height_px);
  if (frame.sequence > drivers::kMostSequence) return fmt::format("a frame of number {}", frame.sequence);
  if (sized && frame.rgb->size() == pixels) return "";
  return fmt::format("a frame of {} x {} pixels in {} bytes", frame.width_px, frame.height_px, frame.rgb->size());
}

/// Every time and every span of time that the event holds.
std::vector<std::int64_t> times_ns_of(const RawEvent& event) {
  std::vector<std::int64_t> out{time_of(event).ns};
  if (const auto* came = std::get_if<FrameCame>(&event)) {
    const drivers::Frame& frame = came->frame;
    out.insert(out.end(), {frame.acquired.ns, frame.acquired_sigma.ns, frame.arrived.ns, frame.stamp_ahead.ns});
  }
  if (const auto* came = std::get_if<EdgesCame>(&event)) {
    for (const drivers::GpioEdge& edge : came->edges) out.push_back(edge.at.ns);
  }
  return out;
}

std::string fault_of(const RawEvent& event, std::size_t names) {
  for (const std::int64_t ns : times_ns_of(event)) {
    if (ns < -kFarthest_ns || ns > kFarthest_ns) return fmt::format("a time of {:g} s", Duration{ns}.seconds());
  }
  if (const auto* changed = std::get_if<InstrumentChanged>(&event)) return fault_of(*changed, names);
  if (const auto* came = std::get_if<FrameCame>(&event)) return fault_of(came->frame);
  return "";
}

}  // namespace

Bytes recording_magic() {
  return {'B', 'E', 'R', 'E', 'C', '0', '0', '2'};
}

Bytes block_of(const CoreSettings& settings) {
  const std::string text = wire::text_of(settings);
  return block(kSettings, {text.begin(), text.end()});
}

Bytes block_of(const RawEvent& event) {
  const auto kind = static_cast<std::uint32_t>(kChanged + event.index());
  return block(kind, std::visit([](const auto& what) { return payload_of(what); }, event));
}

Bytes block_of(const calibration::FileSignature& signature) {
  const std::string text = calibration::text_of_json(json_of_signature(signature));
  return block(kSignature, {text.begin(), text.end()});
}

Result<RawEventReader> RawEventReader::open(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::ifstream in(path, std::ios::binary);
  if (!in) return Error{Errc::not_found, fmt::format("{}: no such recording, or not to be read", name)};
  Bytes magic(kMagicBytes);
  in.read(reinterpret_cast<char*>(magic.data()), kMagicBytes);
  if (magic != recording_magic())
    return Error{Errc::bad_format, fmt::format("{}: is no recording of birdseyed, or one of another version", name)};
  RawEventReader reader(std::move(in), name);
  reader.sum_.add(magic);
  const auto first = reader.next_block();
  if (!first) return first.error();
  try {
    if (*first && (*first)->kind == kSettings) {
      reader.settings_ = nlohmann::json::parse((*first)->payload).get<CoreSettings>();
      const std::string fault = fault_of(reader.settings_);
      if (fault.empty()) return reader;
      return Error{Errc::bad_format, fmt::format("{}: was recorded with what makes no sense: {}", name, fault)};
    }
  } catch (const std::exception&) {  // the parser's, or a map's that is none
  }
  return Error{Errc::bad_format, fmt::format("{}: does not say what it was recorded with", name)};
}

Result<std::optional<RawEventReader::Block>> RawEventReader::next_block() {
  Bytes bytes(kBlockHead);
  const auto read = [&](std::size_t from) {
    in_.read(reinterpret_cast<char*>(bytes.data() + from), static_cast<std::streamsize>(bytes.size() - from));
    return static_cast<std::size_t>(in_.gcount()) == bytes.size() - from;
  };
  if (!read(0)) {
    cut_short_ = in_.gcount() != 0;
    return std::optional<Block>();
  }
  ByteReader head(bytes);
  Block block;
  block.kind = head.get<std::uint32_t>();
  const auto size = head.get<std::uint64_t>();
  const auto damaged = [&] { return Error{Errc::bad_format, fmt::format("{}: is damaged from here on", name_)}; };
  if (size > kLargestPayload) return damaged();
  bytes.resize(kBlockHead + size + sizeof(std::uint64_t));
  if (!read(kBlockHead)) {
    cut_short_ = true;
    return std::optional<Block>();
  }
  const std::span all(bytes);
  ByteReader tail(all.last(sizeof(std::uint64_t)));
  if (tail.get<std::uint64_t>() != wire::checksum(all.first(kBlockHead + size))) return damaged();
  if (block.kind != kSignature) sum_.add(bytes);
  block.payload.assign(bytes.begin() + kBlockHead, bytes.end() - sizeof(std::uint64_t));
  return std::optional<Block>(std::move(block));
}

Result<std::optional<RawEvent>> RawEventReader::next() {
  auto block = next_block();
  if (!block) return block.error();
  if (!*block || (*block)->kind == kSignature) return std::optional<RawEvent>();
  try {
    if (auto event = event_of((*block)->kind, (*block)->payload)) {
      const std::string fault = fault_of(*event, settings_.bird_names.size());
      if (fault.empty()) return event;
      return Error{Errc::bad_format, fmt::format("{}: holds an event that makes no sense: {}", name_, fault)};
    }
  } catch (const nlohmann::json::exception&) {
  }
  return Error{Errc::bad_format, fmt::format("{}: holds an event that makes no sense", name_)};
}

}  // namespace birdseye::device
