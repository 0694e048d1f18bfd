#include "host/recording/recording_signature.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "calibration/record/sha256.hpp"
#include "calibration/record/strict_json.hpp"
#include "drivers/identity/appliance_seal.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/files/files_sha256.hpp"
#include "host/recording/recording_files.hpp"
#include "host/recording/recording_writer.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr const char* kSigned = "signed";
constexpr const char* kSums = "sha256";

/// Of the sheet without its signature.
std::string sheet_sha256(nlohmann::json sheet) {
  sheet.erase(kSigned);
  return calibration::sha256_of(calibration::text_of_json(sheet));
}

}  // namespace

void sign_recording(nlohmann::json& sheet, const std::map<std::string, std::string>& sums, const ThisMachine& machine) {
  sheet[kSums] = sums;
  sheet[kSigned] = json_of_signature(machine.sign(kSessionRecordingFormat, sheet_sha256(sheet)));
}

Result<RecordingSeal> read_recording_seal(const fs::path& folder) {
  const auto text = read_whole_file(folder / kRecordingSheet, kMostTextBytes);
  if (!text && text.error().code != Errc::not_found) return text.error();
  // Its sum is of its text made anew, which goes into lists as deep as they are.
  const auto sheet = text ? calibration::strict_json<nlohmann::json>(*text) : nlohmann::json();
  if (!sheet.is_object() || !sheet.contains("birdseye_recording")) {
    return Error{Errc::bad_format, fmt::format("{}: is missing or damaged; take a copy of the recording that is whole",
                                               (folder / kRecordingSheet).string())};
  }
  RecordingSeal out;
  out.sha256 = sheet_sha256(sheet);
  out.ended = sheet.value("ended", nlohmann::json()) == true;
  try {
    if (sheet.contains("rests_on")) sheet.at("rests_on").at("unsigned").get_to(out.rests_on);
    // Sums and signature are written together: with one alone, the other's name is damaged, and it was signed.
    if (!sheet.contains(kSigned) && !sheet.contains(kSums)) return out;
    const auto there = files_in_recording(folder);
    if (!there) return there.error();
    out.signature = calibration::signature_of_json(sheet.at(kSigned));
    const auto sums = sheet.at(kSums).get<std::map<std::string, std::string>>();
    for (const auto& [name, recorded] : sums) {
      const bool here = std::ranges::binary_search(*there, name);
      const auto sum = here ? files_sha256(folder / name) : Result<std::string>("");
      if (!sum) return sum.error();
      if (name == kRecordingEvents) out.events_sha256 = recorded;
      if (!here) out.missing.push_back(name);
      if (here && *sum != recorded) out.changed.push_back(name);
    }
    std::ranges::copy_if(*there, std::back_inserter(out.added), [&](const auto& name) { return !sums.contains(name); });
  } catch (const nlohmann::json::exception&) {
    return Error{Errc::bad_format, fmt::format("{}: is damaged in its signature; take a copy that is as it was written",
                                               (folder / kRecordingSheet).string())};
  }
  return out;
}

namespace {

Result<AdmittedRecording> admit_appliance_recording(const fs::path& path, const Authors& authors) {
  const auto seal = read_appliance_seal(path);
  if (!seal) return seal.error();
  if (seal->more)
    return Error{Errc::bad_format, fmt::format("{}: bytes were added behind its signature; take a copy that is as it "
                                               "was written",
                                               path.string())};
  auto doubt =
      authors.admit_with_rest(calibration::kApplianceRecordingFormat, seal->sha256, seal->signature, seal->rests_on);
  if (!doubt) return doubt.error().with_context(path.string());
  return AdmittedRecording{*std::move(doubt), ""};
}

/// Whether a folder holds a session recording, or what is left of one.
bool is_session_recording(const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(folder / kRecordingSheet, ignored) || fs::exists(folder / kRecordingEvents, ignored);
}

}  // namespace

std::optional<fs::path> recording_at(const fs::path& path) {
  if (is_appliance_recording(path)) return path;
  std::error_code error;
  if (fs::is_directory(path, error)) return is_session_recording(path) ? std::optional(path) : std::nullopt;
  // A link among a recording's files is one of them, and so is a file that a link elsewhere leads to.
  constexpr int kMostLinks = 40;  // as many as the kernel follows
  fs::path at = path;
  for (int n = 0; n <= kMostLinks; ++n) {
    const fs::path folder = at.has_parent_path() ? at.parent_path() : fs::path(".");
    if (is_session_recording(folder)) return folder;
    const fs::path to = fs::read_symlink(at, error);
    if (error) break;
    at = folder / to;
  }
  return std::nullopt;
}

Result<AdmittedRecording> admit_recording(const fs::path& named, const Authors& authors) {
  const auto recording = recording_at(named);
  if (!recording) return AdmittedRecording();
  const fs::path& path = *recording;
  if (is_appliance_recording(path)) return admit_appliance_recording(path, authors);
  std::error_code ignored;
  const bool sheet = fs::exists(path / kRecordingSheet, ignored);
  RecordingSeal seal;
  if (sheet || !authors.accept_unsigned) {
    auto read = read_recording_seal(path);
    if (!read) return read.error();
    seal = *std::move(read);
  }
  // One that was added may stand before another: of two files of one video the first is read.
  for (const auto& [files, what] :
       {std::pair{&seal.changed, "changed"}, std::pair{&seal.missing, "taken away"}, std::pair{&seal.added, "added"}}) {
    if (!files->empty())
      return Error{Errc::bad_format,
                   fmt::format("{}: was {} since the recording was signed: {}; take a copy that is as "
                               "it was written",
                               path.string(), what, fmt::join(*files, ", "))};
  }
  auto doubt = authors.admit_with_rest(kSessionRecordingFormat, seal.sha256, seal.signature, seal.rests_on)
                   .with_context(path.string());
  if (!doubt && !seal.signature && !seal.ended)
    return Error{doubt.error().code, doubt.error().what + " (it was cut short, and could not be signed)"};
  if (!doubt) return doubt.error();
  return AdmittedRecording{*std::move(doubt), seal.events_sha256};
}

}  // namespace birdseye::host
