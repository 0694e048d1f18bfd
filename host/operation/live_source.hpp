#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/system/background.hpp"
#include "drivers/system/clock.hpp"
#include "host/link/event_stream.hpp"
#include "host/simulated/simulated_cart.hpp"

namespace birdseye::host {

class RecordingReader;

/// Where events come from: an appliance on the wire, or another OpenIGTLink server, which is connected to again for as
/// long as it takes, or a simulated cart of our own, which is started once, and again where somebody asks for it. Never
/// holds the caller up.
class LiveSource {
 public:
  static std::unique_ptr<LiveSource> of_appliance(const std::string& address,
                                                  const wire::ForeignSettings& foreign = {});
  /// The same, by what connects, on a thread of its own. name: of the other side, for people.
  using Client = std::function<Result<std::unique_ptr<wire::Client>>()>;
  static std::unique_ptr<LiveSource> of_client(const std::string& name, const Client& connect_client);
  /// Makes the patient in settings.folder first.
  static std::unique_ptr<LiveSource> of_simulator(SimulatedCartSettings settings);

  /// A recording, as fast as it was made. events_sha256: as RecordingReader::Settings has it. Errors: there is none, or
  /// it is damaged from its first line on.
  static Result<std::unique_ptr<LiveSource>> of_recording(const std::filesystem::path& path, double speed = 1,
                                                          const std::string& events_sha256 = {});

  /// The next event, waiting for it until the deadline.
  std::optional<wire::Event> next(Deadline deadline);
  [[nodiscard]] bool connected() const { return events_ != nullptr; }
  /// False for a recording, which nobody must take for the present.
  [[nodiscard]] bool live() const { return live_; }
  /// Whether starting has failed and is not tried any more: retry() tries again.
  [[nodiscard]] bool may_retry() const { return given_up_ && live_ && cart_ == nullptr; }
  void retry();
  /// Connected to what, or why not, in words.
  [[nodiscard]] std::string words() const;
  /// By the newest frame or pose; empty until that is known. A recorded frame or pose counts as taken at the
  /// moment at which it is played.
  [[nodiscard]] std::optional<ClockGap> host_from_device() const;
  /// Of what came over the wire and waits.
  [[nodiscard]] std::vector<QueueFill> fills() const {
    return stream_ != nullptr ? stream_->fills() : std::vector<QueueFill>();
  }
  /// The simulated cart, once it runs.
  [[nodiscard]] SimulatedCart* cart() const { return cart_.get(); }

 private:
  /// What connecting gives: the cart where there is one to start.
  struct Connection {
    std::unique_ptr<SimulatedCart> cart;
    std::unique_ptr<wire::Client> client;
  };
  using Connect = Background<Result<Connection>>;
  LiveSource(std::string name, Connect::Work connect);
  void take_link(Result<Connection> link);
  void link_again();
  void note_played(const std::optional<wire::Event>& event);
  [[nodiscard]] std::string notes() const;

  std::string name_, words_;
  Connect::Work connect_;
  Connect connecting_;
  HostTime again_;
  bool given_up_ = false;
  std::unique_ptr<SimulatedCart> cart_;
  std::unique_ptr<EventSource> events_;
  EventStream* stream_ = nullptr;               ///< events_, where they come over the wire
  const RecordingReader* recording_ = nullptr;  ///< events_, where they are recorded
  std::optional<ClockGap> played_;              ///< the newest frame or pose of a recording
  bool live_ = true;
};

}  // namespace birdseye::host
