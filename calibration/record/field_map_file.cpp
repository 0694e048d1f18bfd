#include "calibration/record/field_map_file.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "calibration/base/nesting.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/record/checksum.hpp"
#include "calibration/record/field_map_json.hpp"
#include "calibration/record/sha256.hpp"
#include "calibration/record/strict_json.hpp"

namespace birdseye::calibration {

namespace {

constexpr int kVersion = 1;

std::optional<Grade> grade_of(const std::string& name) {
  for (const Grade grade : {Grade::pass, Grade::marginal}) {
    if (name == name_of(grade)) return grade;
  }
  return std::nullopt;
}

Error no_map(const std::string& why) {
  return {Errc::bad_format, fmt::format("is no map of the field, {}; make one with birdseye calibrate field", why)};
}

Result<FieldMapFile> map_of(const nlohmann::json& json) {
  FieldMapNotes notes;
  json.at("made_utc").get_to(notes.made_utc);
  json.at("software").get_to(notes.software);
  json.at("made_from").get_to(notes.made_from);
  json.at("held_out_mm").get_to(notes.held_out_mm);
  if (!is_measured_error(notes.held_out_mm))
    return no_map(fmt::format("for its held_out_mm is {:g}, which no measurement gives", notes.held_out_mm));
  if (json.contains("tracker")) json.at("tracker").get_to(notes.tracker);
  const auto grade = grade_of(json.at("verdict").get<std::string>());
  if (!grade) return no_map("or one whose verdict was fail");
  notes.grade = *grade;
  auto map = FieldMap::from(json.at("map").get<FieldMapData>());
  if (!map) return map.error();
  return FieldMapFile{*std::move(map), std::move(notes), "", std::nullopt};
}

nlohmann::json json_of(const FieldMap& map, const FieldMapNotes& notes) {
  nlohmann::json json{{"format", kFieldMapFormat},        {"version", kVersion},
                      {"made_utc", notes.made_utc},       {"software", notes.software},
                      {"made_from", notes.made_from},     {"verdict", name_of(notes.grade)},
                      {"held_out_mm", notes.held_out_mm}, {"map", map.data()}};
  if (!notes.tracker.empty()) json["tracker"] = notes.tracker;
  return json;
}

}  // namespace

Identity field_of_tracker(const Identity& tracker) {
  Identity out = tracker;
  std::erase_if(out, [](const auto& named) { return named.first.starts_with("bird"); });
  return out;
}

std::string field_misfit(const Identity& of_map, const Identity& tracker) {
  if (of_map.empty()) return {};
  const std::string why = misfit("tracker", of_map, tracker, "the field's map");
  return why.empty() ? why : why + ": map this tracker's field (birdseye calibrate field --bind HOST:PORT)";
}

std::string signed_sha256(const FieldMap& map, const FieldMapNotes& notes) {
  return sha256_of(text_of_json(json_of(map, notes)));
}

std::string field_map_text(const FieldMap& map, const FieldMapNotes& notes,
                           const std::optional<FileSignature>& signature) {
  nlohmann::json json = json_of(map, notes);
  if (signature) json[kSignedKey] = json_of_signature(*signature);
  json[kChecksumKey] = checksum_of(text_of_json(json));
  return text_of_json(json, 1) + "\n";
}

Result<FieldMapFile> parse_field_map(const std::string& text) {
  if (nests_too_deeply(text, Notation::json)) return no_map("it nests lists deeper than any");
  try {
    auto json = strict_json<nlohmann::json>(text);
    const bool is_strict = !json.is_discarded();
    if (!is_strict) json = nlohmann::json::parse(text);  // to say why
    if (!json.is_object() || json.value("format", "") != kFieldMapFormat)
      return no_map("it does not say that it is one");
    if (json.at("version").get<int>() != kVersion)
      return no_map(fmt::format("or of a version other than {}", kVersion));
    const auto checksum = json.at(kChecksumKey).get<std::string>();
    json.erase(kChecksumKey);
    if (!has_checksum(text_of_json(json), checksum))
      return no_map("or was changed since it was made: its checksum does not fit");
    if (!is_strict)
      return no_map("or was changed since it was made: it says something twice, or goes on behind its end");
    std::optional<FileSignature> signature;
    if (json.contains(kSignedKey)) signature = signature_of_json(json.at(kSignedKey));
    json.erase(kSignedKey);
    auto out = map_of(json);
    if (!out) return out.error();
    out->sha256 = sha256_of(text_of_json(json));
    out->signature = std::move(signature);
    out->of_010 = checksum.starts_with("crc64");
    return out;
  } catch (const std::exception&) {  // of the parser's many kinds, and a map's own
    return no_map("or not a whole one");
  }
}

}  // namespace birdseye::calibration
