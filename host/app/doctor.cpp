#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/doctor/examination.hpp"
#include "host/files/write_files.hpp"
#include "host/window/ask_display.hpp"

namespace birdseye::host {

namespace {

struct DoctorOptions {
  Examination examination;
  std::filesystem::path json;
};

/// Everything that can be asked, said to a person and written down.
Result<ExitCode> examine(const DoctorOptions& options) {
  std::vector<Question> questions = questions_of(this_machine(), options.examination);
  questions.push_back(display_question());
  std::string area;
  const std::vector<Check> checks = ask_all(questions, [&area](const Check& check) {
    if (check.area != area) fmt::print("{}\n", check.area);
    fmt::print("{}", lines_of(check));
    std::fflush(stdout);  // the next may take its time
    area = check.area;
  });
  fmt::print("{}\n", sum_of(checks));
  if (auto written = write_file(options.json, text_of(check_json(checks))); !written) return written.error();
  return any_bad(checks) ? ExitCode::verdict_fail : ExitCode::success;
}

}  // namespace

void add_doctor(CLI::App& app, CommandStatus& status) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* command = app.add_subcommand(
      "doctor", "what of this machine works, what does not, and what to do about it; changes nothing");
  Examination& named = options->examination;
  command->add_option("--server", named.server, "the appliance: whether it answers, and what it says of itself")
      ->type_name("[NAME@]HOST:PORT");
  command
      ->add_option("--config", named.config, "a configuration of birdseyed: whether it is sound, and its devices here")
      ->type_name("FILE");
  command->add_option("--ct", named.ct.path, "a CT: whether it can be read")->type_name("PATH");
  add_ct_options(*command, named.ct);
  command->add_option("--record", named.record, "a scope's calibration record: whether it is sound, and what it holds")
      ->type_name("FILE");
  command
      ->add_option("--out", named.results,
                   "the folder where results would go: how much room there is (default: this one)")
      ->type_name("FOLDER");
  command->add_option("--json", options->json, "all that was found, for whoever helps from afar")->type_name("FILE");
  command->callback([options, &status] {
    const auto done = examine(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
