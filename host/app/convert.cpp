#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "drivers/identity/this_machine.hpp"
#include "drivers/system/durable.hpp"
#include "drivers/system/program.hpp"
#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/operation/operation_010.hpp"
#include "host/volume/import.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

struct ConvertOptions {
  VolumeSource ct;
  fs::path folder, out;
};

/// What the new operation holds, and what of it nobody knows.
void tell(const Operation& operation, const ConvertOptions& options) {
  print_line(fmt::format("{}: an operation of {}: {}{}{}", (options.out / "operation.json").string(),
                         operation.made_utc, operation.calibrated ? "calibrated, " : "",
                         operation.registered ? "registered, " : "", operation.deformed ? "deformed" : "not deformed"));
  print_notes(
      {fmt::format("nobody can tell whether a file of {} was changed since: that they are as the window wrote "
                   "them, you answer for: live takes it up with --accept-unsigned",
                   options.folder.string())});
  if (operation.registered && operation.registered->found_with.tracker.empty())
    print_notes({"by which tracker the patient was registered is not known: live asks whether it is the same"});
  if (operation.calibrated && !operation.calibrated->scope.figures().held_out_px)
    print_notes({"how far hand-eye is off is not known: calibrate the scope before an overlay is drawn"});
}

Result<void> run(const ConvertOptions& options) {
  std::error_code ignored;
  if (fs::equivalent(options.out, options.folder, ignored)) {
    return Error{Errc::bad_value, fmt::format("--out {}: is the folder that is converted, and would be written over; "
                                              "name another",
                                              options.out.string())};
  }
  if (has_operation(options.out)) {
    return Error{Errc::bad_value,
                 fmt::format("--out {}: holds an operation; name another folder", options.out.string())};
  }
  const auto ct = import_body(options.ct);
  if (!ct) return ct.error();
  print_notes(ct->notes);
  auto operation = read_operation_010(options.folder, ct->volume);
  if (!operation) return operation.error();
  operation->ct_stated = options.ct.stated;
  // This machine signs that it wrote it, not that what it was made of is as it was.
  operation->doubt = "it was made of files of version 0.1, which signed nothing";
  const auto machine = ThisMachine::open();
  if (!machine) return machine.error();
  if (auto made = make_folder_durably(options.out); !made) return made.error();
  if (auto written = write_operation(options.out, *operation, *machine); !written) return written;
  tell(*operation, options);
  return {};
}

}  // namespace

void add_convert(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<ConvertOptions>();
  CLI::App& command =
      *app.add_subcommand("convert", "what the window of version 0.1.0 kept, as an operation that live --resume takes");
  command.add_option("folder", options->folder, "the --out folder of that window")->required()->type_name("FOLDER");
  command.add_option("--ct", options->ct.path, "the CT that it had: a DICOM folder, NIfTI, NRRD or MetaImage")
      ->required()
      ->type_name("PATH");
  add_ct_options(command, options->ct);
  command.add_option("--out", options->out, "folder for the new operation")->required()->type_name("FOLDER");
  command.callback([options, &status] { status.take(run(*options)); });
}

}  // namespace birdseye::host
