#include "host/app/commands.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>
#include <vector>

#include "calibration/base/lower_case.hpp"
#include "drivers/system/program.hpp"
#include "host/app/input_files.hpp"
#include "host/files/write_files.hpp"
#include "host/recording/recording_writer.hpp"

namespace birdseye::host {

void CommandStatus::take(const Result<void>& outcome) {
  if (!outcome) refuse(outcome.error());
}

void CommandStatus::refuse(const Error& error) {
  print_error("birdseye", error.what);
  code = ExitCode::unusable_input;
}

namespace {

namespace fs = std::filesystem;

/// Whether it names what is written, maybe after it was read. --keep,--show names labels.
bool is_output(const CLI::Option& option) {
  constexpr std::array kOutputs{
      "--out",     "--json", "--report",     "--picture", "--pictures", "--movie",     "--map",
      "--history", "--keep", "--list-texts", "--factors", "--study",    "--right-out", "--right-from-left-out",
      "--export"};
  return !option.check_name("--show") &&
         std::ranges::any_of(kOutputs, [&option](const char* name) { return option.check_name(name); });
}

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

/// Two of the command's files may not be one. A device or a pipe takes the texts of both.
void check_against_output(const CLI::Option& out, const std::string& path, const CLI::Option& other) {
  if (stays(path) || is_folder(path)) return;
  for (const std::string& given : other.results()) {
    if (!given.empty() && same_file(given, path))
      throw CLI::ValidationError(out.get_name(),
                                 path + " is written by " + other.get_name() + ", too; name another file");
  }
}

/// An option that is read, with all that the command reads by it.
struct Input {
  const CLI::Option* option;
  std::vector<fs::path> files;  ///< and folders
};

Input input_of(const CLI::Option& option) {
  Input in{&option, {}};
  const auto add = [&in](const std::vector<fs::path>& files) {
    in.files.insert(in.files.end(), files.begin(), files.end());
  };
  for (const std::string& given : option.results()) {
    add(input_files(given));
    if (option.check_name("--case")) add(files_of_case(given));
  }
  return in;
}

void check_against_input(const CLI::Option& out, const std::string& path, const Input& in) {
  std::error_code ignored;
  if (stays(path) || !fs::is_regular_file(path, ignored)) return;
  for (const fs::path& file : in.files) {
    if (fs::equivalent(file, path, ignored)) {
      throw CLI::ValidationError(out.get_name(), path + " is read, by " + in.option->get_name() +
                                                     ", and would be written over; name another file");
    }
  }
}

/// Whether a reader of the folder would take it: those of pictures, slices, and poses pass over what commands write
/// beside them. A folder that a command of ours wrote, or a window, is read with all that it holds.
bool is_taken_from(const CLI::Option& in, const fs::path& file) {
  constexpr std::array kOfOurs{"recording", "folder",  "--recording", "--operation",
                               "--path",    "--views", "--live-log",  "--resume"};
  constexpr std::array kPassedOver{".json", ".html", ".yaml", ".yml", ".csv", ".svg"};
  return file.filename() == kRecordingSheet ||
         std::ranges::any_of(kOfOurs, [&in](const char* name) { return in.check_name(name); }) ||
         std::ranges::count(kPassedOver, lower_case(file.extension().string())) == 0;
}

/// A file that is there, lies in a folder that is read, and is read with it.
void check_against_folder(const CLI::Option& out, const std::string& path, const Input& in) {
  std::error_code ignored;
  if (stays(path) || !fs::is_regular_file(path, ignored) || !is_taken_from(*in.option, path)) return;
  for (const fs::path& file : in.files) {
    if (is_folder(file) && fs::equivalent(fs::absolute(path, ignored).parent_path(), file, ignored)) {
      throw CLI::ValidationError(out.get_name(), path + " lies in the folder that is read, by " +
                                                     in.option->get_name() +
                                                     ", and would be written over; name another file");
    }
  }
}

/// Whether the command writes its results into a folder that it reads, too, as live with --out and --resume.
bool is_written_into(const CLI::Option& in, const std::vector<CLI::Option*>& options) {
  return std::ranges::any_of(options, [&in](const CLI::Option* option) {
    return is_output(*option) && std::ranges::any_of(option->results(), [&in](const std::string& folder) {
             return is_folder(folder) && std::ranges::any_of(in.results(), [&folder](const std::string& given) {
                      std::error_code ignored;
                      return fs::equivalent(given, folder, ignored);
                    });
           });
  });
}

void check_outputs(CLI::App& command) {
  const std::vector<CLI::Option*> options = command.get_options();
  std::vector<Input> inputs;
  for (const CLI::Option* const option : options) {
    if (!is_output(*option)) inputs.push_back(input_of(*option));
  }
  for (const CLI::Option* const out : options) {
    if (!is_output(*out)) continue;
    for (const std::string& path : out->results()) {
      if (path.empty()) continue;
      for (const CLI::Option* const other : options) {
        if (other != out && is_output(*other)) check_against_output(*out, path, *other);
      }
      for (const Input& in : inputs) {
        check_against_input(*out, path, in);
        if (!is_written_into(*in.option, options)) check_against_folder(*out, path, in);
      }
    }
  }
}

}  // namespace

void refuse_outputs_over_inputs(CLI::App& app) {
  app.parse_complete_callback([&app] { check_outputs(app); });
  for (CLI::App* const command : app.get_subcommands({})) refuse_outputs_over_inputs(*command);
}

std::string png_name(const std::string& file) {
  return lower_case(std::filesystem::path(file).extension().string()) == ".png"
             ? ""
             : file + ": is written as PNG; name it .png";
}

}  // namespace birdseye::host
