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
  if (code != Errc::bad_value) return "";
  const std::string named = address.machine.empty() ? "" : " --name " + address.machine;
  return fmt::format("; pair the two machines: birdseye pair {}{}", address.host, named);
}

Error not_shown(const ServerAddress& address, const char* why) {
  return {Errc::bad_value, fmt::format("{}: {}, so that nothing shows whether it is {}; leave out {}@", address.name(),
                                       why, address.machine, address.machine)};
}

Error another(const ServerAddress& address, const std::string& machine) {
  return {Errc::bad_value, fmt::format("{}: {} answers there, and not {}; look which machine has this address, and "
                                       "give {}@{} if it is the one that is meant",
                                       address.name(), machine, address.machine, machine, address.name())};
}

Result<std::unique_ptr<wire::Link>> connect_by_tls(UniqueFd socket, const ServerAddress& address, Deadline deadline) {
  auto tls = wire::Tls::of_this_machine();
  if (!tls) return tls.error();
  auto link = wire::TlsLink::over(std::move(socket), *std::move(tls), wire::TlsLink::Side::client);
  if (!link) return link.error();
  auto shaken = wire::shake_hands(*std::move(link), address.name(), deadline);
  if (!shaken) return Error{shaken.error().code, shaken.error().what + remedy(address, shaken.error().code)};
  const std::string machine = (*shaken)->peer_name();
  if (!address.machine.empty() && machine != address.machine) return another(address, machine);
  return shaken;
}

}  // namespace

Result<ServerAddress> ServerAddress::parse(const std::string& text, int usual_port) {
  ServerAddress address{text, usual_port, text.starts_with(kPlain)};
  if (address.plain) address.host.erase(0, kPlain.size());
  if (const std::size_t at = address.host.rfind('@'); at != std::string::npos) {
    address.machine = address.host.substr(0, at);
    address.host.erase(0, at + 1);
    if (address.machine.empty()) return no_address(text);
  }
  const std::size_t colon = address.host.rfind(':');
  if (colon != std::string::npos) {
    const char* const end = address.host.data() + address.host.size();
    const auto [rest, fault] = std::from_chars(address.host.data() + colon + 1, end, address.port);
    if (fault != std::errc() || rest != end || address.port < 1 || address.port > 65535) return no_address(text);
    address.host.resize(colon);
  }
  if (address.host.empty()) return no_address(text);
  if (address.plain && !address.machine.empty()) return not_shown(address, "shows no key where it speaks plain");
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
  const bool here = wire::is_loopback(wire::peer_of(*socket));
  if (here && !server->machine.empty()) return not_shown(*server, "is this machine, whose programs show no key");
  if (server->plain || here) return wire::Client::over(wire::link_over(*std::move(socket)), server->name(), foreign);
  auto link = connect_by_tls(*std::move(socket), *server, deadline);
  if (!link) return link.error();
  return wire::Client::over(*std::move(link), server->name(), foreign);
}

std::string answered_words(const std::string& address, const std::string& machine) {
  return machine.empty() ? "" : fmt::format("{} is {}, by its key", address, machine);
}

}  // namespace birdseye::host
