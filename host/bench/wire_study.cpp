#include "host/bench/wire_study.hpp"

#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "calibration/base/median.hpp"
#include "device/wire/client.hpp"
#include "device/wire/server.hpp"
#include "device/wire/tls_link.hpp"
#include "drivers/identity/machine_key.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/interrupt.hpp"
#include "drivers/system/thread.hpp"
#include "drivers/system/wait.hpp"
#include "host/bench/bench_machine.hpp"
#include "host/bench/processor_time.hpp"

namespace birdseye::host {

namespace {

constexpr int kWidth_px = 1920, kHeight_px = 1080;
constexpr double kRate_hz = 60;
constexpr const char* kHere = "127.0.0.1";

using Tls = std::shared_ptr<const wire::Tls>;
using Pictures = std::vector<std::shared_ptr<const std::vector<std::uint8_t>>>;

/// More than a processor keeps at hand, as a camera's are.
Pictures noise() {
  std::mt19937 rng(1);
  Pictures pictures;
  for (int i = 0; i < 8; ++i) {
    auto pixels = std::make_shared<std::vector<std::uint8_t>>(std::size_t{3} * kWidth_px * kHeight_px);
    for (std::uint8_t& value : *pixels) value = static_cast<std::uint8_t>(rng() & 0xFFU);
    pictures.push_back(std::move(pixels));
  }
  return pictures;
}

/// Both ends as this machine's key lets them: each is the other.
Result<Tls> own_tls(const std::filesystem::path& folder) {
  const auto key = MachineKey::open(folder);
  if (!key) return key.error();
  return wire::Tls::make(*key, [](const PublicKey&) { return std::optional<std::string>("this machine"); });
}

Result<std::unique_ptr<wire::Client>> connect(int port, const Tls& tls) {
  const Deadline deadline = Deadline::after(Duration::from_seconds(10));
  auto socket = wire::connect_socket(kHere, port, deadline);
  if (!socket) return socket.error();
  if (!tls) return wire::Client::over(wire::link_over(*std::move(socket)), kHere);
  auto link = wire::TlsLink::over(*std::move(socket), tls, wire::TlsLink::Side::client);
  if (!link) return link.error();
  auto shaken = wire::shake_hands(*std::move(link), kHere, deadline);
  if (!shaken) return shaken.error();
  return wire::Client::over(*std::move(shaken), kHere);
}

struct Measured {
  double server_percent = 0, client_percent = 0;  ///< of a core
  std::uint64_t sent = 0, lost = 0;
};

/// Reads frames until it is stopped.
class Reader {
 public:
  explicit Reader(std::unique_ptr<wire::Client> client) : client_(std::move(client)) {
    thread_ = OwnedThread([this](const std::stop_token& stop) { run(stop); });
  }
  std::atomic<std::uint64_t> frames = 0;
  std::atomic<double> cpu_s = 0;

 private:
  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto event = client_->next(Deadline::after(Duration::from_ms(50)));
      if (!event) return;
      if (*event && std::holds_alternative<wire::VideoFrame>(**event)) ++frames;
      cpu_s = thread_cpu_s();
    }
  }

  std::unique_ptr<wire::Client> client_;
  OwnedThread thread_;
};

Result<Measured> measure(const Pictures& pictures, const Tls& tls, double seconds) {
  wire::Admission admission;
  admission.tls = tls;
  if (tls) admission.is_local = [](const std::string&) { return false; };
  auto server = wire::Server::listen(kHere, 0, std::move(admission));
  if (!server) return server.error();
  (*server)->publish(wire::pack(wire::Status{true, ""}, device_now()));
  auto client = connect((*server)->port(), tls);
  if (!client) return client.error();
  Reader reader(*std::move(client));
  while ((*server)->clients() == 0) sleep_for(Duration::from_ms(5));
  Measured out;
  const double process_before_s = process_cpu_s(), reader_before_s = reader.cpu_s;
  const DeviceTime begin = device_now();
  const auto count = static_cast<std::uint64_t>(seconds * kRate_hz);
  for (; out.sent < count && !interrupted(); ++out.sent) {
    sleep_until(begin + Duration::from_seconds(static_cast<double>(out.sent) / kRate_hz));
    wire::VideoFrame frame;
    frame.info.sequence = out.sent;
    frame.width_px = kWidth_px;
    frame.height_px = kHeight_px;
    frame.rgb = pictures[out.sent % pictures.size()];
    (*server)->publish(wire::pack(frame));
  }
  const double elapsed_s = (device_now() - begin).seconds();
  for (const Deadline end = Deadline::after(Duration::from_seconds(1)); reader.frames < out.sent && !end.passed();)
    sleep_for(Duration::from_ms(10));
  const double client_s = reader.cpu_s - reader_before_s;
  out.client_percent = 100 * client_s / elapsed_s;
  out.server_percent = 100 * (process_cpu_s() - process_before_s - client_s) / elapsed_s;
  out.lost = out.sent - reader.frames;
  return out;
}

}  // namespace

Result<nlohmann::json> wire_study(const WireStudyOptions& options) {
  const auto folder = std::filesystem::temp_directory_path() / ("birdseye-bench-wire-" + std::to_string(::getpid()));
  auto tls = own_tls(folder);
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  if (!tls) return tls.error();
  const Pictures pictures = noise();
  nlohmann::json out;
  out["machine"] = bench_machine();
  std::vector<double> more_at_server, more_at_client;
  for (int round = 0; round < options.rounds; ++round) {
    Measured by_way[2];
    for (const bool by_tls : {false, true}) {
      const auto measured = measure(pictures, by_tls ? *tls : nullptr, options.seconds);
      if (!measured) return measured.error();
      if (interrupted()) return Error{Errc::disconnected, "interrupted; nothing is left running"};
      by_way[by_tls ? 1 : 0] = *measured;
      out["rounds"].push_back({{"tls", by_tls},
                               {"cpu_percent_server", measured->server_percent},
                               {"cpu_percent_client", measured->client_percent},
                               {"frames", measured->sent},
                               {"frames_lost", measured->lost}});
    }
    more_at_server.push_back(by_way[1].server_percent - by_way[0].server_percent);
    more_at_client.push_back(by_way[1].client_percent - by_way[0].client_percent);
  }
  out["tls_cpu_percent_more_server"] = median_of(more_at_server);
  out["tls_cpu_percent_more_client"] = median_of(more_at_client);
  return out;
}

}  // namespace birdseye::host
