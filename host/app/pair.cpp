#include <fmt/format.h>

#include <memory>
#include <string>

#include "device/wire/pairing.hpp"
#include "drivers/identity/identity_folder.hpp"
#include "drivers/system/program.hpp"
#include "host/app/commands.hpp"
#include "host/link/appliance_link.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kWithin = Duration::from_ms(120'000);

struct PairOptions {
  std::string address, name;
};

Result<void> pair(const PairOptions& options) {
  const auto server = ServerAddress::parse(options.address, wire::kPairingPort);
  if (!server) return server.error();
  const auto folder = identity_folder();
  if (!folder) return folder.error();
  const std::string& name = options.name.empty() ? server->machine : options.name;
  const auto paired =
      wire::pair_as_client({*folder, name, wire::ask_people}, server->host, server->port, Deadline::after(kWithin));
  if (!paired) return paired.error().with_context("pair");
  print_line(fmt::format("paired with {}, in {}", paired->name, folder->string()));
  return {};
}

}  // namespace

void add_pair(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<PairOptions>();
  CLI::App* const command =
      app.add_subcommand("pair", "introduce this machine and an appliance by a code that people compare");
  command->add_option("appliance", options->address, "where birdseyed pair waits")
      ->type_name("HOST[:PORT]")
      ->required();
  command->add_option("--name", options->name, "by which to know the appliance (default: as it calls itself)");
  command->callback([options, &status] { status.take(pair(*options)); });
}

}  // namespace birdseye::host
