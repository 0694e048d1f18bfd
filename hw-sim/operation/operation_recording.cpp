#include "hw-sim/operation/operation_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <span>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include "device/birdseyed/core.hpp"
#include "device/birdseyed/recording.hpp"
#include "device/wire/igtl_bytes.hpp"
#include "device/wire/packet.hpp"
#include "device/wire/unpacker.hpp"
#include "drivers/identity/appliance_seal.hpp"
#include "drivers/system/clock.hpp"
#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kWithFrames = 0.5;  // of recordings
constexpr double kMost_gb = 0.02;    // 20 MB: half a minute with frames, an hour without
constexpr Duration kMayLose = Duration::from_ms(1000), kSaidWithin = Duration::from_ms(2000);

std::uint64_t hash_of(const std::vector<std::uint8_t>& bytes, std::uint64_t hash) {
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < bytes.size(); i += sizeof word) {
    word = 0;
    std::memcpy(&word, &bytes[i], std::min(sizeof word, bytes.size() - i));
    hash = splitmix64(hash ^ word);
  }
  return hash;
}

DeviceTime own_time(const wire::VideoFrame& frame) {
  return frame.info.acquired;
}
DeviceTime own_time(const wire::ClockChange& change) {
  return change.at;
}
DeviceTime own_time(const wire::Pedal& pedal) {
  return pedal.at;
}
template <typename What>
DeviceTime own_time(const What& what) {
  return what.acquired;
}

struct Packed {
  DeviceTime time;
  wire::Packet packet;
};
/// What follows from the instruments alone; empty: it tells how the appliance is, of which nothing is recorded.
std::optional<Packed> pack(const wire::Event& event) {
  return std::visit(
      [](const auto& what) -> std::optional<Packed> {
        using What = std::decay_t<decltype(what)>;
        if constexpr (std::is_same_v<What, wire::VideoFrame> || std::is_same_v<What, wire::Birds> ||
                      std::is_same_v<What, wire::Doubt> || std::is_same_v<What, wire::ClockChange> ||
                      std::is_same_v<What, wire::Pedal>) {
          return Packed{own_time(what), wire::pack(what)};
        }
        return std::nullopt;
      },
      event);
}

bool is_of_camera(const wire::Event& event) {
  const auto* const change = std::get_if<wire::ClockChange>(&event);
  return std::holds_alternative<wire::VideoFrame>(event) || (change != nullptr && change->clock == "camera");
}

std::uint64_t hash_of(const wire::Packet& packet) {
  const std::uint64_t head = hash_of(*packet.head, 0);
  return packet.pixels ? hash_of(*packet.pixels, head) : head;
}

}  // namespace

OperationRecording::OperationRecording(std::filesystem::path folder, std::uint64_t seed)
    : machine_(ThisMachine::for_once()), disk_(folder, machine_, seed) {
  config_.folder = std::move(folder);
  config_.frames = hashed_uniform(seed, 0) < kWithFrames;
  config_.most_gb = kMost_gb;
  config_.create = [this](const auto&) {
    auto created = disk_.create();
    if (created) begun_ = host_now();
    return created;
  };
}

void OperationRecording::befall(const FaultTimeline& befalling, HostTime now) {
  const Fault* const late = befalling.active(FaultKind::appliance_disk_late);
  const auto takes = Duration::from_seconds(late != nullptr ? late->value("ms") * 1e-3 : 0);
  late_ = std::max(late_, takes);
  disk_.set_late(takes);
  const bool full = befalling.active(FaultKind::appliance_disk_full) != nullptr;
  if (full && begun_ && !full_) full_ = now;
  disk_.set_full(full);
}

/// Whether the appliance says that its recording has ended.
void OperationRecording::listen(const wire::Event& event, HostTime now) {
  const auto* const birds = std::get_if<wire::Birds>(&event);
  // The clocks of host and appliance are one here.
  if (full_ && !wrote_ && birds != nullptr && birds->acquired.ns > full_->ns) wrote_ = now;
  const auto* const health = std::get_if<wire::Health>(&event);
  if (health == nullptr || !wrote_ || now - *wrote_ < kSaidWithin) return;
  unsaid_ = unsaid_ || health->recording.find("ended") == std::string::npos;
}

void OperationRecording::take(const wire::Event& event, HostTime now) {
  listen(event, now);
  if (!config_.frames && is_of_camera(event)) return;
  const auto packed = pack(event);
  // A late network may still bring what the appliance said that ran before.
  if (!packed || !begun_ || packed->time.ns < begun_->ns) return;
  seen_[event.index()].push_back({now, hash_of(packed->packet)});
}

void OperationRecording::lose_power(HostTime now) {
  disk_.lose_power();
  cut_ = now;
}

std::string OperationRecording::judge() {
  std::string wrong;
  if (begun_) {
    ++judged_;
    wrong = wrong_with_last();
    std::error_code ignored;
    std::filesystem::remove(disk_.last(), ignored);
  }
  for (auto& kind : seen_) kind.clear();
  found_ = {};
  cut_.reset();
  begun_.reset();
  full_.reset();
  wrote_.reset();
  unsaid_ = false;
  late_ = Duration{0};
  return wrong;
}

std::string OperationRecording::wrong_with_last() {
  if (unsaid_) return "the disk was full, and the appliance has not said within 2 s that the recording has ended";
  const Duration waited{2 * late_.ns};  // for the sync in which it came, and the next
  std::optional<HostTime> until;        // empty: to the end
  if (cut_) until = *cut_ - kMayLose - waited;
  if (full_) until = std::min(until.value_or(*full_), *full_ - waited);
  const auto last = replay();
  // The power may go, or the disk be full, in the middle of a block, or before there is one.
  if (!last && !until) return last.error().what;
  std::error_code failed;
  const auto bytes = static_cast<double>(std::filesystem::file_size(disk_.last(), failed));
  if (last && bytes > kMost_gb * 1e9) until = std::min(until.value_or(HostTime{last->ns}), HostTime{last->ns});
  if (auto wrong = missing(until); !wrong.empty()) return wrong;
  return cut_ || full_ ? "" : unsigned_words();
}

Result<DeviceTime> OperationRecording::replay() {
  auto reader = device::RawEventReader::open(disk_.last());
  if (!reader) return reader.error();
  device::Core core(reader->settings());
  wire::Unpacker unpacker;
  DeviceTime last;
  for (;;) {
    const auto event = reader->next();
    if (!event) return event.error();
    if (!*event) return last;
    last = time_of(**event);
    for (const wire::Packet& packet : core.take(**event)) {
      const auto bytes = packet.bytes();
      for (std::span<const std::uint8_t> left(bytes); !left.empty();) {
        const auto body = wire::body_bytes(left.first(wire::kHeaderBytes));
        if (!body) return body.error();
        const std::size_t size = wire::kHeaderBytes + static_cast<std::size_t>(*body);
        const auto told = unpacker.push(left.first(size));
        if (!told) return told.error();
        if (*told)
          if (const auto* const again = std::get_if<wire::Event>(&**told)) find(*again);
        left = left.subspan(size);
      }
    }
  }
}

void OperationRecording::find(const wire::Event& event) {
  const auto& seen = seen_[event.index()];
  std::size_t& found = found_[event.index()];
  if (found == seen.size()) return;
  const auto packed = pack(event);
  if (!packed || hash_of(packed->packet) != seen[found].hash) return;
  ++found;
  ++found_again_;
}

std::string OperationRecording::missing(std::optional<HostTime> until) const {
  for (std::size_t kind = 0; kind < seen_.size(); ++kind) {
    const auto& seen = seen_[kind];
    if (found_[kind] == seen.size() || (until && seen[found_[kind]].at > *until)) continue;
    return fmt::format(
        "of {} events of kind {} that reached the host, the recording gives {} again; the next came at "
        "{:.3f} s{}",
        seen.size(), kind, found_[kind], static_cast<double>(seen[found_[kind]].at.ns) * 1e-9,
        cut_ ? fmt::format(", and the power went at {:.3f} s", static_cast<double>(cut_->ns) * 1e-9) : "");
  }
  return {};
}

std::string OperationRecording::unsigned_words() const {
  const auto seal = read_appliance_seal(disk_.last());
  if (!seal) return seal.error().what;
  const auto author = machine_.author_of(calibration::kApplianceRecordingFormat, seal->sha256, seal->signature);
  if (!author) return author.error().what;
  return author->standing == Author::Standing::known ? "" : "the recording is " + author->words();
}

}  // namespace birdseye::hw_sim
