#include "device/birdseyed/replay.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <string>

#include "device/birdseyed/instrument_thread.hpp"
#include "drivers/identity/appliance_seal.hpp"
#include "drivers/identity/this_machine.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::device {

Result<std::string> admit_replay(const std::filesystem::path& recording, bool accept_unsigned) {
  const auto seal = read_appliance_seal(recording);
  if (!seal) return seal.error();
  const auto refused = [&recording](const std::string& why) {
    return Error{Errc::bad_value, fmt::format("{}: {}", recording.string(), why)};
  };
  if (seal->more) return refused("bytes were added behind its signature; take a copy that is as it was written");
  const auto machine = ThisMachine::open();
  if (!machine && !accept_unsigned) return machine.error();
  const auto author = machine
                          ? machine->author_of(calibration::kApplianceRecordingFormat, seal->sha256, seal->signature)
                          : Result<Author>(Author());
  if (!author) return refused(author.error().what);
  std::string doubt = author->standing == Author::Standing::known ? "" : "is " + author->words();
  if (doubt.empty() && !seal->rests_on.empty())
    doubt = fmt::format("rests on what no known machine signed ({})", seal->rests_on);
  if (doubt.empty()) return seal->sha256;
  if (!accept_unsigned) return refused(doubt + "; --accept-unsigned plays it all the same");
  spdlog::warn("UNSIGNED: {} {}", recording.string(), doubt);
  return seal->sha256;
}

namespace {

// birdseyed records what it does several times a second.
constexpr Duration kHealthEvery = Duration::from_ms(1000);
constexpr Duration kLongWait = Duration::from_ms(10'000), kLongestWait = Duration::from_ms(3'600'000);

}  // namespace

Result<void> replay(const std::filesystem::path& recording, const std::string& sha256, wire::Server& server,
                    const std::stop_token& stop) {
  auto reader = RawEventReader::open(recording);
  if (!reader) return reader.error();
  Core core(reader->settings());
  std::optional<Duration> shift;  // from the recording's clock to this one
  Deadline health_due = Deadline::after(Duration());
  while (!stop.stop_requested()) {
    auto event = reader->next();
    if (!event) return event.error();
    if (!*event) break;
    const DeviceTime at = time_of(**event);
    if (!shift) shift = device_now() - at;
    const Duration wait = at + *shift - device_now();
    if (wait > kLongestWait) {
      return Error{Errc::bad_value,
                   fmt::format("{}: its next event is {:.0f} h later than the one before: a stamp is damaged",
                               recording.string(), wait.seconds() / 3600)};
    }
    if (wait > kLongWait)
      spdlog::warn("{}: nothing was recorded for the next {:.0f} s: waiting", recording.string(), wait.seconds());
    sleep_for(wait, stop);
    // An appliance tells its clients by its health, of which nothing is recorded.
    if (const std::string& doubt = reader->settings().field_unsigned; !doubt.empty() && health_due.passed()) {
      wire::Health health;
      health.state = "ready";
      health.field_unsigned = doubt;
      server.publish(wire::pack(health, device_now()));
      health_due = Deadline::after(kHealthEvery);
    }
    for (const wire::Packet& packet : core.take(**event)) server.publish(packet);
  }
  if (stop.stop_requested()) return {};
  if (reader->cut_short()) spdlog::warn("{}: ends inside a block, as after a power cut", recording.string());
  if (reader->sha256() == sha256) return {};
  return Error{Errc::bad_format,
               fmt::format("{}: was changed, or still written, while it was played: what was shown is not what was "
                           "admitted; take a copy that is as it was written, where only you can write",
                           recording.string())};
}

}  // namespace birdseye::device
