#pragma once

#include <memory>
#include <optional>
#include <string>

#include "calibration/geometry/transform.hpp"
#include "calibration/time/clock.hpp"
#include "device/wire/server.hpp"
#include "drivers/system/background.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/operation/patient.hpp"

namespace birdseye::host {

/// Where a frame that is on the screen has the patient.
struct PublishedFrame {
  HostTime exposed;
  std::optional<Transform<Tracker, Patient>> tracker_from_patient;
  std::optional<Transform<Camera, Patient>> camera_from_patient;  ///< only where the overlay is drawn
};

/// Gives the registered CT to 3D Slicer and other programs over OpenIGTLink (docs/manual/live.md): TRANSFORM messages
/// with each frame, the CT as it is seen now as an IMAGE to each client that comes and whenever it changes. A client
/// that does not keep up loses the oldest transforms, one that takes nothing for ten seconds is disconnected.
class Publisher {
 public:
  /// address: "PORT", of this machine alone, or "ADDRESS:PORT", of paired machines too, by TLS; "plain:ADDRESS:PORT" is
  /// for whoever comes. Port 0 is any that is free. A port in use is an error that names it.
  static Result<std::unique_ptr<Publisher>> listen(const std::string& address);

  /// The CT, and how it is deformed where it is. Packed on a thread of its own; version: another number for another
  /// shape. To be called again and again: it starts what is to be done and gives out what is ready.
  void show(const std::shared_ptr<const PatientPlan>& plan, const DisplacementField* field, std::uint64_t version);
  void show(const PublishedFrame& frame);
  /// Why no overlay is drawn; empty: it is. Sent where it changes.
  void tell(const std::string& why_not);
  [[nodiscard]] int port() const { return server_->port(); }

 private:
  explicit Publisher(std::unique_ptr<wire::Server> server) : server_(std::move(server)) {}

  std::unique_ptr<wire::Server> server_;
  std::optional<std::uint64_t> version_;  ///< that is packed, or being packed
  std::optional<std::string> told_;
  Background<wire::Packet> packing_;
};

}  // namespace birdseye::host
