#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "calibration/base/verdict.hpp"
#include "host/app/commands.hpp"
#include "host/files/record_file.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

/// Where what a calibration found goes; those that are not given are not written.
struct ResultPaths {
  std::filesystem::path out, json, report, record;
};

/// `--out`, `--json`, `--report` and, for what a record has an entry for, `--record`. out_help: what --out holds.
void add_result_options(CLI::App& command, ResultPaths& paths, const std::string& out_help, bool record = true);

/// Prints grade, reasons and next steps; writes json with `verdict`, `reasons` and `next_steps` added, and the page.
/// out_text goes to --out and the entry into --record unless the grade is fail: a result without worth is not left
/// where it could be used. Sets status by the grade, or to the error of a file that cannot be written.
void finish_calibration(const ResultPaths& paths, const std::string& out_text, nlohmann::json json, HtmlPage page,
                        const Verdict& verdict, CommandStatus& status, const RecordEntry& entry = {});

}  // namespace birdseye::host
