#include "host/app/results.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "drivers/system/program.hpp"
#include "host/link/appliance_hardware.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

/// Before the work rather than after it.
std::string folder_is_there(const std::string& file) {
  const auto folder = std::filesystem::absolute(file).parent_path();
  std::error_code ignored;
  if (std::filesystem::is_directory(folder, ignored)) return "";
  return fmt::format("{}: there is no folder {}; make it first", file, folder.string());
}

/// Likewise: a file that is there and is no sound calibration record would be left alone.
std::string record_is_sound(const std::string& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return "";
  const auto record = read_signed_record(file);
  return record ? "" : record.error().what;
}

/// Likewise: who enters something signs all of the record.
std::string author_is_known(const std::string& file, bool accept_unsigned) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return "";
  const auto authors = Authors::of_this_machine(accept_unsigned);
  if (!authors) return authors.error().what;
  const auto read = read_record(file, *authors);
  return read ? "" : read.error().what;
}

Result<std::string> record_of(const ResultPaths& paths, const RecordEntry& entry, Grade grade) {
  const auto authors = Authors::of_this_machine(paths.accept_unsigned);
  if (!authors) return authors.error();
  return record_with(paths.record, entry, grade, *authors);
}

}  // namespace

void add_result_options(CLI::App& command, ResultPaths& paths, const std::string& out_help, bool record) {
  command.add_option("--out", paths.out, out_help)->type_name("FILE")->check(folder_is_there);
  command.add_option("--json", paths.json, "figures, verdict and reasons")->type_name("FILE")->check(folder_is_there);
  if (record) {
    CLI::Option* const into =
        command.add_option("--record", paths.record, "the scope's calibration record, which gets this as an entry")
            ->type_name("FILE")
            ->check(folder_is_there)
            ->check(record_is_sound);
    CLI::Option* const accept =
        command
            .add_flag("--accept-unsigned", paths.accept_unsigned,
                      "enter it also into a record that is not signed, or signed by a machine that is not known here, "
                      "and sign that")
            ->needs(into);
    // A check of the option, and not the command's parse_complete_callback: that is for what concerns all options.
    into->check([accept](const std::string& file) { return author_is_known(file, accept->as<bool>()); });
  }
  command.add_option("--report", paths.report, "a page with the figures and pictures (HTML)")
      ->type_name("FILE")
      ->check(folder_is_there);
}

void allow_unsigned_sources(CLI::App& command) {
  CLI::Option* const accept = command.get_option("--accept-unsigned");
  accept->remove_needs(command.get_option("--record"));
  accept->description(
      "go on also from a record, a recording or a map of the field that is not signed, or signed by a machine that is "
      "not known here");
}

Result<AdmittedRecording> admit_sources(const std::vector<std::filesystem::path>& sources, const ResultPaths& paths) {
  AdmittedRecording out;
  for (const auto& source : sources) {
    const auto recording = recording_at(source);
    if (source.empty() || !recording) continue;
    const auto authors = Authors::of_this_machine(paths.accept_unsigned);
    if (!authors) return authors.error();
    auto admitted = admit_recording(*recording, *authors);
    if (!admitted) return admitted.error();
    if (out.doubt.empty()) out.doubt = std::move(admitted->doubt);
    if (out.events_sha256.empty()) out.events_sha256 = std::move(admitted->events_sha256);
  }
  return out;
}

Result<AdmittedField> admit_field(const std::filesystem::path& map, const std::string& server,
                                  const ResultPaths& paths) {
  if (map.empty() && server.empty()) return AdmittedField();
  const auto authors = Authors::of_this_machine(paths.accept_unsigned);
  if (!authors) return authors.error();
  if (!map.empty()) return read_field_map(map, *authors);
  const auto doubt = ask_field_doubt(server);
  if (!doubt) return doubt.error();
  if (doubt->empty()) return AdmittedField();
  const std::string what = "its map of the field is " + *doubt;
  if (const auto admitted = authors->admit_resting_on(what); !admitted) return admitted.error().with_context(server);
  return AdmittedField{std::nullopt, *doubt};
}

std::string tell_doubts(const AdmittedRecording& recording, const AdmittedField& field, Verdict& verdict) {
  std::string kept;
  const auto tell = [&](const std::string& what, const std::string& doubt) {
    if (doubt.empty()) return;
    verdict.add(Grade::marginal, words("why_unsigned", what, doubt));
    if (kept.empty()) kept = fmt::format("the {} is {}", what, doubt);
  };
  tell(words("unsigned_recording"), recording.doubt);
  tell(words("unsigned_field"), field.doubt);
  return kept;
}

void tell_not_written(const std::filesystem::path& path) {
  if (path.empty()) return;
  std::error_code ignored;
  fmt::print(stderr, "birdseye: {} is not written: the verdict is fail{}\n", path.string(),
             std::filesystem::exists(path, ignored) ? "; what is there is of an earlier run" : "");
}

void finish_calibration(const ResultPaths& paths, const std::string& out_text, nlohmann::json json, HtmlPage page,
                        const Verdict& verdict, CommandStatus& status, const RecordEntry& entry,
                        const FileText& always) {
  json["verdict"] = name_of(verdict.grade);
  json["reasons"] = verdict.reasons;
  json["next_steps"] = verdict.next_steps;
  page.set_verdict(verdict);
  std::vector<FileText> files{{paths.json, text_of(json)}, {paths.report, page.html()}, always};
  if (verdict.grade != Grade::fail) {
    files.push_back({paths.out, out_text});
    if (!paths.record.empty()) {
      const auto record = record_of(paths, entry, verdict.grade);
      if (!record) {  // what was found is not lost for it
        (void)write_files({{paths.json, text_of(json)}, {paths.report, page.html()}, {paths.out, out_text}, always});
        return status.refuse(record.error());
      }
      files.push_back({paths.record, *record});
    }
  }
  if (const auto written = write_files(files); !written) return status.refuse(written.error());
  fmt::print("verdict: {}\n", name_of(verdict.grade));
  for (const std::string& reason : verdict.reasons) print_line(fmt::format("  {}", reason));
  for (const std::string& step : verdict.next_steps) print_line(fmt::format("next: {}", step));
  if (verdict.grade == Grade::fail) {
    status.code = ExitCode::verdict_fail;
    for (const auto& path : {paths.out, paths.record}) tell_not_written(path);
  }
}

}  // namespace birdseye::host
