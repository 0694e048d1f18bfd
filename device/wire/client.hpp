#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "calibration/time/clock_relation.hpp"
#include "calibration/time/discipline.hpp"
#include "device/wire/foreign_feed.hpp"
#include "device/wire/link.hpp"
#include "device/wire/unpacker.hpp"

namespace birdseye::wire {

/// A host's end of the wire. The other end is an appliance, or any OpenIGTLink server that sends video and poses; the
/// first messages tell which.
class Client {
 public:
  /// Tries until the deadline: an appliance that is starting is not an error yet.
  static Result<std::unique_ptr<Client>> connect(const std::string& host, int port, Deadline deadline,
                                                 ForeignSettings foreign = {});
  /// The same over a link that stands already. name: of the other side, for messages.
  static std::unique_ptr<Client> over(std::unique_ptr<Link> link, std::string name, ForeignSettings foreign = {});

  /// The next event; empty at the deadline; Errc::disconnected when the appliance has gone.
  Result<std::optional<Event>> next(Deadline deadline);
  /// Says what this client wants; without it, it gets everything.
  Result<void> subscribe(const Subscription& subscription, Deadline deadline);
  /// Asks that the camera's exposure, gain, white balance and focus be held, or let go; what became of it comes as an
  /// event. When the last client that holds them leaves, they are let go.
  Result<void> lock_camera(bool on, Deadline deadline);

  /// A time of the appliance on this machine's CLOCK_MONOTONIC, with a sigma. It is related by the narrowest of the
  /// questions that next() asks the appliance from time to time, or by clocks that a network protocol (PTP, NTP) keeps
  /// together at both ends, whichever is surer. Times of a server that is no appliance are related by arrivals. Empty
  /// until there was an answer.
  [[nodiscard]] std::optional<RelatedTime<HostTime>> host_from_device(DeviceTime time) const;
  /// Lets host_from_device() use the clocks that a network protocol keeps together; without this call, only questions
  /// count. discipline: what this machine's kernel says of its clock. wall_minus_monotonic: the time of day less
  /// CLOCK_MONOTONIC.
  void use_discipline(const ClockDiscipline& discipline, Duration wall_minus_monotonic);
  /// What a server that is no appliance of ours is, and what of it is passed over; empty for an appliance.
  [[nodiscard]] std::string peer_words() const { return foreign_ ? foreign_->words() : ""; }
  /// Whether what goes over the wire can be read and changed on its way.
  [[nodiscard]] bool is_plain() const { return !link_->is_known(); }
  /// By what name the machine that answers is known here, by its key; empty: none was asked for.
  [[nodiscard]] std::string machine() const { return link_->peer_name(); }

 private:
  Client(std::unique_ptr<Link> link, std::string name, ForeignSettings foreign);
  Result<void> send(const Packet& packet, Deadline deadline);
  [[nodiscard]] Error gone() const;
  Result<bool> fill(std::size_t size, Deadline deadline);
  /// The next message, header and body; empty at the deadline. It lies in buffer_ until the next call.
  Result<std::optional<std::span<const std::uint8_t>>> next_message(Deadline deadline);
  /// Gives the foreign feed the messages that have come already, some of them at a time.
  Result<void> drain();
  /// Judges by a message what the other side is, where that is not known yet.
  void judge(const Header& header);
  void ask();
  void ask_the_time();
  void take(const ClockPong& pong);
  [[nodiscard]] std::optional<ClockChoice> choose() const;

  std::unique_ptr<Link> link_;
  std::string name_;
  std::vector<std::uint8_t> buffer_;
  std::size_t have_ = 0;
  Unpacker unpacker_;
  ForeignSettings foreign_settings_;
  std::optional<ForeignFeed> foreign_;  ///< set once the other side has shown itself to be no appliance
  bool appliance_ = false;              ///< the other side has shown itself to be an appliance
  bool asked_for_poses_ = false;
  HostTime connected_;
  ClockRelation relation_;
  HostTime next_question_;
  int questions_ = 0;
  struct Discipline {
    ClockDiscipline discipline;
    Duration wall_minus_monotonic;
  };
  std::optional<Discipline> here_, there_;
};

}  // namespace birdseye::wire
