#include "host/link/appliance_link.hpp"

#include <fmt/format.h>

#include <charconv>

namespace birdseye::host {

namespace {

constexpr int kUsualPort = 18944;
constexpr Duration kLinkPatience = Duration::from_ms(8000);

}  // namespace

Result<std::unique_ptr<wire::Client>> connect_appliance(const std::string& address,
                                                        const wire::ForeignSettings& foreign) {
  const std::size_t colon = address.rfind(':');
  int port = kUsualPort;
  if (colon != std::string::npos) {
    const char* const end = address.data() + address.size();
    const auto [rest, fault] = std::from_chars(address.data() + colon + 1, end, port);
    if (fault != std::errc() || rest != end || port < 1 || port > 65535)
      return Error{Errc::bad_value, fmt::format("\"{}\" is no address of an appliance: give HOST:PORT", address)};
  }
  const std::string host = address.substr(0, colon);
  if (host.empty())
    return Error{Errc::bad_value, fmt::format("\"{}\" is no address of an appliance: give HOST:PORT", address)};
  auto client = wire::Client::connect(host, port, Deadline::after(kLinkPatience), foreign);
  if (!client) {
    return Error{
        client.error().code,
        fmt::format("{}; does birdseyed run there, and is its [wire] bound to that address?", client.error().what)};
  }
  return client;
}

}  // namespace birdseye::host
