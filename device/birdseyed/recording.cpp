#include "device/birdseyed/recording.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "device/birdseyed/byte_codec.hpp"
#include "device/birdseyed/layout_json.hpp"
#include "device/wire/igtl_bytes.hpp"

namespace birdseye::device {

namespace {

enum Kind : std::uint32_t { kSettings = 1, kChanged, kTrackerBytes, kFrame, kEdges, kTick };
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
  out.put_text(changed.layout ? nlohmann::json(*changed.layout).dump() : "");
  out.put(changed.rate_hz);
  out.put<std::uint8_t>(changed.exposure ? 1 : 0);
  out.put(changed.exposure.value_or(Duration{}).ns);
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
  changed.instrument = static_cast<Instrument>(in.get<std::uint8_t>() % kInstruments);
  changed.state = static_cast<InstrumentState>(in.get<std::uint8_t>() % 5);
  changed.text = in.get_text();
  changed.at.ns = in.get<std::int64_t>();
  const std::string layout = in.get_text();
  if (!layout.empty()) changed.layout = nlohmann::json::parse(layout).get<drivers::minibird::StreamLayout>();
  changed.rate_hz = in.get<double>();
  const bool exposed = in.get<std::uint8_t>() != 0;
  const Duration exposure{in.get<std::int64_t>()};
  if (exposed) changed.exposure = exposure;
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

}  // namespace

Bytes recording_magic() {
  return {'B', 'E', 'R', 'E', 'C', '0', '0', '1'};
}

Bytes block_of(const CoreSettings& settings) {
  const std::string text = nlohmann::json(settings).dump();
  return block(kSettings, {text.begin(), text.end()});
}

Bytes block_of(const RawEvent& event) {
  const auto kind = static_cast<std::uint32_t>(kChanged + event.index());
  return block(kind, std::visit([](const auto& what) { return payload_of(what); }, event));
}

Result<RecordingReader> RecordingReader::open(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::ifstream in(path, std::ios::binary);
  if (!in) return Error{Errc::not_found, fmt::format("{}: no such recording, or not to be read", name)};
  Bytes magic(kMagicBytes);
  in.read(reinterpret_cast<char*>(magic.data()), kMagicBytes);
  if (magic != recording_magic())
    return Error{Errc::bad_format, fmt::format("{}: is no recording of birdseyed, or one of another version", name)};
  RecordingReader reader(std::move(in), name);
  const auto first = reader.next_block();
  if (!first) return first.error();
  try {
    if (*first && (*first)->kind == kSettings) {
      reader.settings_ = nlohmann::json::parse((*first)->payload).get<CoreSettings>();
      return reader;
    }
  } catch (const nlohmann::json::exception&) {
  }
  return Error{Errc::bad_format, fmt::format("{}: does not say what it was recorded with", name)};
}

Result<std::optional<RecordingReader::Block>> RecordingReader::next_block() {
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
  block.payload.assign(bytes.begin() + kBlockHead, bytes.end() - sizeof(std::uint64_t));
  return std::optional<Block>(std::move(block));
}

Result<std::optional<RawEvent>> RecordingReader::next() {
  auto block = next_block();
  if (!block) return block.error();
  if (!*block) return std::optional<RawEvent>();
  try {
    if (auto event = event_of((*block)->kind, (*block)->payload)) return event;
  } catch (const nlohmann::json::exception&) {
  }
  return Error{Errc::bad_format, fmt::format("{}: holds an event that makes no sense", name_)};
}

}  // namespace birdseye::device
