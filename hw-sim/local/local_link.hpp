#pragma once

#include <cstddef>
#include <memory>

#include "calibration/time/clock.hpp"
#include "device/wire/link.hpp"

namespace birdseye::hw_sim {

/// A network within this process, with one machine that is listened at.
class LocalNetwork {
 public:
  struct Settings {
    std::size_t holds = std::size_t{1} << 20;  ///< bytes on their way in one direction; beyond, the sender waits
    Duration delay{};                          ///< of each byte
  };
  explicit LocalNetwork(const Settings& settings);

  /// For the server. One at a time; where there is none, who connects is refused.
  [[nodiscard]] std::unique_ptr<wire::Listener> listener() const;
  /// A client's end of a new connection.
  [[nodiscard]] std::unique_ptr<wire::Link> connect() const;
  /// From now on each byte that the server sends takes so much longer; none overtakes another.
  void set_late(Duration late) const;
  /// Cuts all connections that stand, as a cable does that is pulled.
  void cut() const;
  /// The server's machine has gone without a word: nothing comes from it any more, what is sent to it is lost, and
  /// connections stand until there is a listener again, which knows nothing of them.
  void fall_silent() const;

  struct State;

 private:
  std::shared_ptr<State> state_;
};

}  // namespace birdseye::hw_sim
