#include "host/operation/publisher.hpp"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <bit>
#include <charconv>
#include <cstring>
#include <string_view>

#include "device/wire/clock_discipline.hpp"
#include "device/wire/tls.hpp"
#include "host/deform/deformed_volume.hpp"

namespace birdseye::host {

namespace {

constexpr std::string_view kPlain = "plain:";

/// 3D Slicer's world is RAS, the CT's frame LPS.
Eigen::Affine3d lps_from_ras() {
  return Eigen::Affine3d(Eigen::Scaling(-1.0, -1.0, 1.0));
}

wire::Packet packet_of(const Volume& volume, DeviceTime time) {
  static_assert(std::endian::native == std::endian::little, "voxels are sent as they lie here");
  auto voxels = std::make_shared<std::vector<std::uint8_t>>(2 * volume.hu.size());
  std::memcpy(voxels->data(), volume.hu.data(), voxels->size());
  return wire::pack(
      wire::PublishedVolume{"CT", volume.size, lps_from_ras() * volume.patient_from_voxel, std::move(voxels), time});
}

/// The time of day, which is what other programs stamp by.
DeviceTime time_of_day(HostTime time) {
  return DeviceTime{time.ns} + wall_minus_monotonic();
}

DeviceTime now() {
  return time_of_day(host_now());
}

}  // namespace

Result<std::unique_ptr<Publisher>> Publisher::listen(const std::string& address) {
  const bool plain = address.starts_with(kPlain);
  const std::string place = plain ? address.substr(kPlain.size()) : address;
  const std::size_t colon = place.rfind(':');
  const std::string bind = colon == std::string::npos ? "127.0.0.1" : place.substr(0, colon);
  const std::string digits = colon == std::string::npos ? place : place.substr(colon + 1);
  int port = -1;
  const char* const end = digits.data() + digits.size();
  const auto [rest, fault] = std::from_chars(digits.data(), end, port);
  if (fault != std::errc() || rest != end || port < 0 || port > 65535 || !wire::fault_of_bind(bind).empty()) {
    return Error{Errc::bad_value,
                 fmt::format("--publish: \"{}\" is no port of this machine: give PORT, or ADDRESS:PORT", address)};
  }
  wire::Admission admission;
  admission.allow_plain = plain;
  if (!wire::is_loopback(bind)) {
    auto tls = wire::Tls::of_this_machine();
    if (!tls) return tls.error().with_context("--publish");
    admission.tls = *std::move(tls);
  }
  auto server = wire::Server::listen(bind, port, std::move(admission));
  if (!server && server.error().code == Errc::in_use) {
    return Error{
        Errc::in_use,
        fmt::format("--publish: port {} on {} is in use; stop the other program or choose another", port, bind)};
  }
  if (!server) return Error{server.error().code, fmt::format("--publish: cannot listen on {}", address)};
  return std::unique_ptr<Publisher>(new Publisher(*std::move(server)));
}

void Publisher::show(const std::shared_ptr<const PatientPlan>& plan, const DisplacementField* field,
                     std::uint64_t version) {
  if (const auto packed = packing_.take()) server_->publish(*packed);
  if (!plan || packing_.running() || version_ == version) return;
  version_ = version;
  std::optional<DisplacementField> deformation;
  if (field != nullptr) deformation = *field;
  packing_.start([plan, deformation = std::move(deformation)](const std::stop_token&, const auto&) {
    if (!deformation) return packet_of(plan->ct, now());
    // On one core: the others have the live picture to draw.
    tbb::task_arena one(1);
    return packet_of(one.execute([&] { return deformed_volume(plan->ct, *deformation); }), now());
  });
}

void Publisher::tell(const std::string& why_not) {
  if (told_ == why_not) return;
  told_ = why_not;
  server_->publish(wire::pack(wire::Status{why_not.empty(), why_not}, now(), "Birdseye"));
}

void Publisher::show(const PublishedFrame& frame) {
  const DeviceTime time = time_of_day(frame.exposed);
  const auto publish = [&](const char* name, const Eigen::Matrix4d& to_from_patient) {
    server_->publish(wire::pack(wire::PublishedTransform{name, to_from_patient * lps_from_ras().matrix(), time}));
  };
  if (frame.tracker_from_patient) publish("PatientToTracker", frame.tracker_from_patient->matrix());
  if (frame.camera_from_patient) publish("PatientToCamera", frame.camera_from_patient->matrix());
}

}  // namespace birdseye::host
