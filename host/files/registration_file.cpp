#include "host/files/registration_file.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string_view>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/record/sha256.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/files/text_files.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kTitle = "# patient_from_tracker of birdseye, mm; do not edit: a sum binds it\n";
constexpr std::string_view kFacts = "# ";
constexpr std::string_view kSum = "# sha256 ";

/// The remark after the title. Refuses one that is no object.
Result<nlohmann::json> facts_of(std::string_view text) {
  const std::string_view line = text.substr(kTitle.size(), text.find('\n', kTitle.size()) - kTitle.size());
  nlohmann::json facts =
      line.starts_with(kFacts) ? nlohmann::json::parse(line.substr(kFacts.size()), nullptr, false) : nlohmann::json();
  if (!facts.is_object()) return Error{Errc::bad_format, "its second line is no JSON object"};
  return facts;
}

/// Refuses a text whose last line is not the sum of all that stands before it.
Result<void> check_sum(std::string_view text) {
  const std::size_t at = text.rfind(kSum);
  if (at == std::string_view::npos) return Error{Errc::bad_format, "is cut off: its last line, with the sum, is gone"};
  const std::string sum = calibration::sha256_of(text.substr(0, at));
  if (text.substr(at) == fmt::format("{}{}\n", kSum, sum)) return {};
  return Error{Errc::bad_format, "was changed or damaged since it was written"};
}

}  // namespace

std::string registration_text(const RegistrationFile& registration) {
  nlohmann::json facts = nlohmann::json::object();
  if (!registration.ct_sha256.empty()) facts["ct_sha256"] = registration.ct_sha256;
  if (!registration.made_utc.empty()) facts["made_utc"] = registration.made_utc;
  if (registration.fre_mm) facts["fre_mm"] = *registration.fre_mm;
  std::string text =
      fmt::format("{}{}{}\n{}", kTitle, kFacts, facts.dump(), pose_text(registration.patient_from_tracker.matrix()));
  const std::string sum = calibration::sha256_of(text);
  return text + fmt::format("{}{}\n", kSum, sum);
}

Result<RegistrationFile> read_registration(const fs::path& path) {
  const auto read = read_whole_file(path, kMostTextBytes);
  if (!read) return read.error();
  const std::string& text = *read;
  const auto matrix = parse_pose(text, path);
  if (!matrix) return matrix.error();
  RegistrationFile out{Transform<Patient, Tracker>::from_matrix(*matrix)};
  const bool sealed = text.starts_with(kTitle) || text.find(kSum) != std::string::npos;
  // What is not sealed does not show which way it goes.
  if (!sealed && path.filename().string().find("tracker_from_patient") != std::string::npos) {
    return Error{Errc::bad_value, fmt::format("{}: by its name it is the inverse of what is asked for; give a "
                                              "patient_from_tracker.txt, which register fiducials and replay write",
                                              path.string())};
  }
  if (!sealed) return out;
  const auto refused = [&path](const Error& why) {
    return Error{Errc::bad_format, fmt::format("{}: {}; register again, or give a copy that is as it was written",
                                               path.string(), why.what)};
  };
  if (auto same = check_sum(text); !same) return refused(same.error());
  const auto facts = facts_of(text);
  if (!facts) return refused(facts.error());
  const auto text_at = [&](const char* name) {
    return facts->contains(name) && (*facts)[name].is_string() ? (*facts)[name].get<std::string>() : std::string();
  };
  out.ct_sha256 = text_at("ct_sha256");
  out.made_utc = text_at("made_utc");
  if (facts->contains("fre_mm") && (*facts)["fre_mm"].is_number()) out.fre_mm = (*facts)["fre_mm"].get<double>();
  if (out.fre_mm && !is_measured_error(*out.fre_mm))
    return refused({Errc::bad_format, fmt::format("its fre_mm is {:g}, which no measurement gives", *out.fre_mm)});
  return out;
}

Result<void> check_ct(const RegistrationFile& registration, const std::string& ct_sha256) {
  if (registration.ct_sha256.empty() || registration.ct_sha256 == ct_sha256) return {};
  return Error{Errc::bad_value,
               "is of another CT, or of this one with its voxels elsewhere; give the CT that was registered, and state "
               "of it what was stated then (--spacing, --orientation)"};
}

}  // namespace birdseye::host
