#include "host/app/commands.hpp"

int main(int argc, char** argv) {
  using namespace birdseye::host;
  CLI::App app{"birdseye: a registered, deformable CT over live laparoscopic video"};
  app.require_subcommand(1);
  CommandStatus status;
  add_demo(app, status);
  add_register(app, status);
  add_render(app, status);
  add_volume(app, status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::unusable_input);
  }
  return static_cast<int>(status.code);
}
