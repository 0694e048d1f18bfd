#include "host/operation/live_source.hpp"

#include <algorithm>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "host/link/appliance_link.hpp"
#include "host/recording/recording_reader.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr std::size_t kMostFramesWaiting = 12;  // half a second: older frames are of no use to a picture that is live
constexpr Duration kConnectAgain = Duration::from_ms(1000);

}  // namespace

LiveSource::LiveSource(std::string name, Connect::Work connect)
    : name_(std::move(name)), words_(host::words("note_connecting", name_)), connect_(std::move(connect)) {
  if (connect_) connecting_.start(connect_);
}

std::unique_ptr<LiveSource> LiveSource::of_appliance(const std::string& address, const wire::ForeignSettings& foreign) {
  return of_client(address, [address, foreign] { return connect_appliance(address, foreign); });
}

std::unique_ptr<LiveSource> LiveSource::of_client(const std::string& name, const Client& connect_client) {
  const auto connect = [connect_client](const std::stop_token&, const Connect::Say&) -> Result<Connection> {
    auto client = connect_client();
    if (!client) return client.error();
    return Connection{nullptr, *std::move(client)};
  };
  return std::unique_ptr<LiveSource>(new LiveSource(name, connect));
}

std::unique_ptr<LiveSource> LiveSource::of_simulator(SimulatedCartSettings settings) {
  const auto connect = [settings = std::move(settings)](const std::stop_token& stop,
                                                        const Connect::Say& say) -> Result<Connection> {
    say(host::words("note_making"));
    if (auto made = SimulatedCart::make_patient(settings); !made) return made.error();
    if (stop.stop_requested()) return Error{Errc::disconnected, "cancelled"};
    say(host::words("note_starting"));
    auto cart = SimulatedCart::start(settings);
    if (!cart) return cart.error();
    auto client = wire::Client::connect("127.0.0.1", (*cart)->port(), Deadline::after(Duration::from_ms(20'000)));
    if (!client) return client.error();
    return Connection{*std::move(cart), *std::move(client)};
  };
  return std::unique_ptr<LiveSource>(new LiveSource(host::words("simulated_cart"), connect));
}

void LiveSource::take_link(Result<Connection> link) {
  if (!link) {
    given_up_ = name_ == host::words("simulated_cart");  // what could not be started once is not tried for ever
    words_ = given_up_ ? link.error().what : host::words("note_tried_again", link.error().what);
    again_ = host_now() + kConnectAgain;
    return;
  }
  if (link->cart) cart_ = std::move(link->cart);
  auto stream = std::make_unique<EventStream>(std::move(link->client), kMostFramesWaiting);
  stream_ = stream.get();
  events_ = std::move(stream);
  const std::string& machine = stream_->machine();
  words_ = stream_->is_plain() ? host::words("note_connected_plain", name_)
           : machine.empty()   ? host::words("note_connected", name_)
                               : host::words("note_connected_known", name_, machine);
}

Result<std::unique_ptr<LiveSource>> LiveSource::of_recording(const std::filesystem::path& path, double speed,
                                                             const std::string& events_sha256) {
  RecordingReader::Settings settings;
  settings.speed = speed;
  settings.events_sha256 = events_sha256;
  auto reader = RecordingReader::open(path, settings);
  if (!reader) return reader.error();
  std::unique_ptr<LiveSource> source(new LiveSource(path.string(), {}));
  source->recording_ = reader->get();
  source->events_ = *std::move(reader);
  source->live_ = false;
  source->words_ = host::words("note_playing", path.string());
  return source;
}

void LiveSource::retry() {
  if (!may_retry()) return;
  given_up_ = false;
  again_ = host_now();
  words_ = host::words("note_connecting", name_);
}

std::optional<wire::Event> LiveSource::next(Deadline deadline) {
  if (!events_) link_again();
  if (!events_) {
    sleep_until(deadline);
    return std::nullopt;
  }
  auto event = events_->next(deadline);
  if (event) {
    if (recording_ != nullptr) note_played(*event);
    return *std::move(event);
  }
  words_ = event.error().what + notes();
  events_.reset();
  stream_ = nullptr;
  recording_ = nullptr;
  again_ = host_now() + kConnectAgain;
  given_up_ = cart_ != nullptr || !live_;
  return std::nullopt;
}

void LiveSource::note_played(const std::optional<wire::Event>& event) {
  const auto acquired = event ? acquired_of(*event) : std::nullopt;
  if (acquired) played_ = ClockGap{*acquired, {host_now(), {}}};
}

void LiveSource::link_again() {
  if (auto link = connecting_.take()) take_link(*std::move(link));
  if (events_ || given_up_) return;
  if (!connecting_.running() && host_now() >= again_) connecting_.start(connect_);
  if (connecting_.running() && !connecting_.line().empty()) words_ = connecting_.line();
}

std::string LiveSource::words() const {
  const std::string peer = stream_ != nullptr ? stream_->peer_words() : "";
  return (peer.empty() ? words_ : words_ + ": " + peer) + notes();
}

/// What was dropped, or is amiss with the recording as far as it was read.
std::string LiveSource::notes() const {
  constexpr std::size_t kMost = 3;
  std::string out;
  if (const std::string dropped = stream_ != nullptr ? stream_->drops().words() : ""; !dropped.empty())
    out = "; " + dropped;
  if (recording_ == nullptr) return out;
  const std::vector<std::string>& notes = recording_->notes();
  for (std::size_t i = 0; i < std::min(notes.size(), kMost); ++i) out += "; " + notes[i];
  if (notes.size() > kMost) out += "; " + host::words("note_more", notes.size() - kMost);
  return out;
}

std::optional<ClockGap> LiveSource::host_from_device() const {
  return stream_ != nullptr ? stream_->host_from_device() : played_;
}

}  // namespace birdseye::host
