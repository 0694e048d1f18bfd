#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "calibration/base/verdict.hpp"
#include "host/app/commands.hpp"
#include "host/files/field_files.hpp"
#include "host/files/record_file.hpp"
#include "host/files/write_files.hpp"
#include "host/recording/recording_signature.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

/// The files that a calibration writes its results to; an empty path is not written.
struct ResultPaths {
  std::filesystem::path out, json, report, record;
  bool accept_unsigned = false;  ///< go on from a record, a recording or a map that no known machine signed
};

/// Adds `--out`, `--json`, `--report` and, where the calibration record has an entry for the result, `--record`
/// and `--accept-unsigned`.
/// out_help: what --out holds.
void add_result_options(CLI::App& command, ResultPaths& paths, const std::string& out_help, bool record = true);

/// For a command that takes a recording or a map of the field: --accept-unsigned is for these too, and needs no
/// --record.
void allow_unsigned_sources(CLI::App& command);

/// Whose recordings a calibration goes by, by the rule for all recordings: those of these paths that are recordings
/// or files of one, for files of poses may be such, too. The first doubt, and the sum of the first's events. An empty
/// path is nobody's.
Result<AdmittedRecording> admit_sources(const std::vector<std::filesystem::path>& sources, const ResultPaths& paths);
/// Whose map of the field it corrects poses by, likewise, or whose map the appliance at `server` has corrected them by.
/// map, server: empty where there is none.
Result<AdmittedField> admit_field(const std::filesystem::path& map, const std::string& server,
                                  const ResultPaths& paths);
/// What the verdict says of them: it passes no more where no known machine signed one. Answers what a record keeps of
/// that; empty: known machines signed both.
std::string tell_doubts(const AdmittedRecording& recording, const AdmittedField& field, Verdict& verdict);

/// Says on stderr that a file is not written for a verdict of fail, and whether one of an earlier run is there, which
/// somebody may take for this run's. Nothing of an empty path.
void tell_not_written(const std::filesystem::path& path);

/// Prints grade, reasons and next steps; writes json with `verdict`, `reasons` and `next_steps` added, and the page.
/// Unless the grade is fail, out_text goes to --out and the entry into --record: a worthless result is not left where
/// it could be used. `always` is written with them, whatever the grade is. Sets status by the grade, or to the error of
/// a file that cannot be written: then none is.
void finish_calibration(const ResultPaths& paths, const std::string& out_text, nlohmann::json json, HtmlPage page,
                        const Verdict& verdict, CommandStatus& status, const RecordEntry& entry = {},
                        const FileText& always = {});

}  // namespace birdseye::host
