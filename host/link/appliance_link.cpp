#include "host/link/appliance_link.hpp"

#include <fmt/format.h>

#include <charconv>
#include <string_view>
#include <utility>

#include "device/wire/tcp_link.hpp"
#include "device/wire/tls.hpp"
#include "device/wire/tls_link.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kLinkPatience = Duration::from_ms(8000);
constexpr std::string_view kPlain = "plain:";

Error no_address(const std::string& text) {
  return {Errc::bad_value, fmt::format("\"{}\" is no address of an appliance: give HOST:PORT", text)};
}

/// What to do where two machines do not know each other, or one of them speaks no TLS.
std::string remedy(const ServerAddress& address, Errc code) {
  if (code == Errc::unsupported || code == Errc::timeout) {
    return fmt::format("; where it is a server that speaks no TLS, and nobody else is on that network, give {}{}",
                       kPlain, address.name());
  }
  return code == Errc::bad_value ? fmt::format("; pair the two machines: birdseye pair {}", address.host) : "";
}

Result<std::unique_ptr<wire::Link>> connect_by_tls(UniqueFd socket, const ServerAddress& address, Deadline deadline) {
  auto tls = wire::Tls::of_this_machine();
  if (!tls) return tls.error();
  auto link = wire::TlsLink::over(std::move(socket), *std::move(tls), wire::TlsLink::Side::client);
  if (!link) return link.error();
  auto shaken = wire::shake_hands(*std::move(link), address.name(), deadline);
  if (shaken) return shaken;
  return Error{shaken.error().code, shaken.error().what + remedy(address, shaken.error().code)};
}

}  // namespace

Result<ServerAddress> ServerAddress::parse(const std::string& text, int usual_port) {
  ServerAddress address{text, usual_port, text.starts_with(kPlain)};
  if (address.plain) address.host.erase(0, kPlain.size());
  const std::size_t colon = address.host.rfind(':');
  if (colon != std::string::npos) {
    const char* const end = address.host.data() + address.host.size();
    const auto [rest, fault] = std::from_chars(address.host.data() + colon + 1, end, address.port);
    if (fault != std::errc() || rest != end || address.port < 1 || address.port > 65535) return no_address(text);
    address.host.resize(colon);
  }
  if (address.host.empty()) return no_address(text);
  return address;
}

std::string ServerAddress::name() const {
  return fmt::format("{}:{}", host, port);
}

Result<std::unique_ptr<wire::Client>> connect_appliance(const std::string& address,
                                                        const wire::ForeignSettings& foreign) {
  const auto server = ServerAddress::parse(address);
  if (!server) return server.error();
  const Deadline deadline = Deadline::after(kLinkPatience);
  auto socket = wire::connect_socket(server->host, server->port, deadline);
  if (!socket) {
    return Error{
        socket.error().code,
        fmt::format("{}; does birdseyed run there, and is its [wire] bound to that address?", socket.error().what)};
  }
  if (server->plain || wire::is_loopback(wire::peer_of(*socket)))
    return wire::Client::over(wire::link_over(*std::move(socket)), server->name(), foreign);
  auto link = connect_by_tls(*std::move(socket), *server, deadline);
  if (!link) return link.error();
  return wire::Client::over(*std::move(link), server->name(), foreign);
}

}  // namespace birdseye::host
