#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "drivers/identity/appliance_seal.hpp"
#include "drivers/identity/this_machine.hpp"
#include "drivers/system/program.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/app/commands.hpp"
#include "host/files/field_files.hpp"
#include "host/files/record_file.hpp"
#include "host/operation/operation.hpp"
#include "host/recording/recording_signature.hpp"
#include "host/recording/recording_writer.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

struct VerifyOptions {
  std::vector<fs::path> paths;
  std::string trust;
  bool key = false;
};

/// What one file, or a folder that is one recording, says of its writer.
struct Found {
  std::string what;  ///< "calibration record"
  std::string kind, sha256;
  std::optional<calibration::FileSignature> signature;
  std::vector<std::string> faults;  ///< what is not as it was signed
  std::string why_unsigned;         ///< more than that it is; or empty
  std::string rests_on{};           ///< what it rests on that no known machine had signed; empty: on nothing such
};

constexpr const char* k010SignedNothing = "it is of version 0.1, which signed nothing";

/// A record, a map or an operation that cannot be read is not as it was written either: its own sums tell.
Found changed(const std::string& what, const Error& error) {
  return {what, "", "", std::nullopt, {error.what}, ""};
}

Found of_record(const fs::path& path) {
  constexpr const char* kWhat = "calibration record";
  const auto read = read_signed_record(path);
  if (!read) return changed(kWhat, read.error());
  Found out{kWhat, calibration::kRecordFormat,           read->sha256, read->signature,
            {},    read->of_010 ? k010SignedNothing : ""};
  out.rests_on = doubt_of(read->record);
  return out;
}

Found of_field_map(const fs::path& path) {
  constexpr const char* kWhat = "map of the field";
  const auto read = read_field_map(path);
  if (!read) return changed(kWhat, read.error());
  return {kWhat, calibration::kFieldMapFormat,         read->sha256, read->signature,
          {},    read->of_010 ? k010SignedNothing : ""};
}

Found of_operation(const fs::path& path) {
  constexpr const char* kWhat = "operation";
  const auto read = read_signed_operation(path);
  if (!read) return changed(kWhat, read.error());
  Found out{kWhat, kOperationFormat, read->by.sha256, read->by.signature, {}, ""};
  out.rests_on = read->operation.doubt;
  return out;
}

Found of_session(const fs::path& folder) {
  constexpr const char* kWhat = "session recording";
  const auto read = read_recording_seal(folder);
  if (!read) return changed(kWhat, read.error());
  Found out{kWhat, kSessionRecordingFormat, read->sha256, read->signature, {}, ""};
  for (const std::string& file : read->changed) out.faults.push_back("changed: " + file);
  for (const std::string& file : read->missing) out.faults.push_back("missing: " + file);
  for (const std::string& file : read->added) out.faults.push_back("added: " + file);
  out.rests_on = read->rests_on;
  if (!read->ended) out.why_unsigned = "it was cut short";
  if (read->ended && !read->signature) out.why_unsigned = "version 0.1 signed nothing";
  return out;
}

Found of_appliance(const fs::path& path) {
  constexpr const char* kWhat = "appliance recording";
  const auto read = read_appliance_seal(path);
  if (!read) return changed(kWhat, read.error());
  Found out{kWhat, calibration::kApplianceRecordingFormat, read->sha256, read->signature, {}, ""};
  if (read->more) out.faults.emplace_back("added: bytes behind the signature");
  out.rests_on = read->rests_on;
  out.why_unsigned = "it was cut short, still grows, or is of version 0.1";
  return out;
}

bool begins_as(const char* format, const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string begin(200, ' ');
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin.find(format) != std::string::npos;
}

Result<std::vector<Found>> found_at(const fs::path& path) {
  std::error_code ignored;
  std::vector<Found> out;
  if (!fs::exists(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file or folder", path.string())};
  if (fs::is_directory(path, ignored)) {
    if (has_operation(path)) out.push_back(of_operation(path));
    if (fs::exists(path / kRecordingSheet, ignored) || fs::exists(path / kRecordingEvents, ignored))
      out.push_back(of_session(path));
  } else if (const auto file = open_file(path); !file) {
    return file.error();
  } else if (is_appliance_recording(path)) {
    out.push_back(of_appliance(path));
  } else if (path.filename() == kRecordingSheet) {
    out.push_back(of_session(path.parent_path().empty() ? fs::path(".") : path.parent_path()));
  } else if (begins_as(calibration::kRecordFormat, path)) {
    out.push_back(of_record(path));
  } else if (begins_as(calibration::kFieldMapFormat, path) ||
             read_field_map(path)) {  // its keys may stand in any order
    out.push_back(of_field_map(path));
  } else if (const auto read = read_signed_operation(path); read || begins_as(kOperationFormat, path)) {
    out.push_back(of_operation(path));
  } else if (path.extension() == ".json") {
    out.push_back(changed("no record, map of the field or operation, or damaged", read.error()));
  }
  if (!out.empty()) return out;
  return Error{
      Errc::bad_format,
      fmt::format("{}: is nothing that Birdseye signs; give a calibration record, a map of the field, a folder of an "
                  "operation or a session recording, or an appliance recording",
                  path.string())};
}

/// Prints what there is to say. True: all is as a known machine signed it.
bool tell(const fs::path& path, const Found& found, ThisMachine& machine, const std::string& trust, Error& refused) {
  const auto say = [&](const std::string& words) {
    fmt::print("{}\n", in_one_line(fmt::format("{}: {}: {}", path.string(), found.what, words)));
  };
  auto author =
      found.kind.empty() ? Result<Author>(Author()) : machine.author_of(found.kind, found.sha256, found.signature);
  if (!author) {
    say(author.error().what);
    return false;
  }
  const bool is_signed = author->standing != Author::Standing::nobody;
  if (!trust.empty() && author->standing == Author::Standing::known)
    say("its machine is known already; no name is given");
  if (!trust.empty() && author->standing == Author::Standing::unknown && found.faults.empty()) {
    if (const auto added = machine.trust(trust, author->key); !added) {
      refused = added.error();
      return false;
    }
    author = machine.author_of(found.kind, found.sha256, found.signature);
    say(fmt::format("{} is known from now on: what it signs is used here, and it may connect", trust));
  }
  for (const std::string& fault : found.faults) say(fault);
  if (!found.rests_on.empty()) say("rests on what no known machine had signed: " + found.rests_on);
  if (is_signed) {
    say(author->words() + (found.faults.empty() ? ", and as it was signed" : ", and not as it was signed"));
  } else if (!found.kind.empty()) {
    say(author->words() + (found.why_unsigned.empty() ? "" : "; " + found.why_unsigned));
  }
  return found.faults.empty() && found.rests_on.empty() && author->standing == Author::Standing::known;
}

Result<ExitCode> run(const VerifyOptions& options) {
  auto machine = ThisMachine::open();
  if (!machine) return machine.error();
  if (options.key) {
    const PublicKey& own = machine->key().public_key();
    fmt::print("{} {}\nfingerprint {}\n", machine->name(), own.hex(), own.fingerprint());
  }
  if (options.paths.empty() && !options.key)
    return Error{Errc::bad_value,
                 "verify: name a record, a map of the field, an operation or a recording, or give --key"};
  bool good = true;
  for (const fs::path& path : options.paths) {
    const auto found = found_at(path);
    if (!found) return found.error();
    for (const Found& one : *found) {
      Error refused;
      good = tell(path, one, *machine, options.trust, refused) && good;
      if (!refused.what.empty()) return refused.with_context("--trust");
    }
  }
  return good ? ExitCode::success : ExitCode::verdict_fail;
}

}  // namespace

void add_verify(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<VerifyOptions>();
  CLI::App& command =
      *app.add_subcommand("verify",
                          "says by whom and when records, maps, operations and recordings were signed, and whether "
                          "they are as they were");
  command
      .add_option("paths", options->paths,
                  "calibration records, maps of the field, folders of operations and recordings, .berec files")
      ->type_name("PATH");
  command
      .add_option("--trust", options->trust,
                  "know the machine that signed them from now on, by this name; compare its fingerprint first")
      ->type_name("NAME");
  command.add_flag("--key", options->key, "show this machine's name, public key and fingerprint");
  command.callback([options, &status] {
    const auto done = run(*options);
    done ? void(status.code = *done) : status.refuse(done.error());
  });
}

}  // namespace birdseye::host
